"""Two files of one rig, however they are written, and files that state effects themselves."""

import json

import numpy as np
import pytest
from diagnosis.simulated import E, diagnosed, manipulator

from prb3r import load_manipulator, predict
from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.result.carried_constants import carried_constants
from prb3r.diagnosis.result.files import write_record
from prb3r.diagnosis.result.same_rig import same_geometry
from prb3r.diagnosis.result.transfer import carried_effects
from prb3r.model.effects import EFFECT_KINDS
from prb3r.model.manipulator import Manipulator

PULLED = {"sequence": ["a", "a"], "step": [1, 2], "cable_1_n": [10.0, 30.0]}
WIDTH, THICKNESS = (manipulator()["segment"][0][name] for name in ("width_m", "thickness_m"))
STIFFNESS = E * WIDTH * THICKNESS**3 / 12


def rig(**changes):
    return Manipulator.model_validate(manipulator() | changes)


def by_stiffness(stiffness=STIFFNESS, **more):
    """The segments of the rig, known by their bending stiffness."""
    plain = [
        {k: v for k, v in each.items() if k not in ("width_m", "thickness_m")} for each in manipulator()["segment"]
    ]
    return [segment | {"bending_stiffness_n_m2": stiffness} | more for segment in plain]


def with_cables(change):
    return {"cable": [change(dict(cable)) for cable in manipulator()["cable"]]}


def listed_offsets(cable):
    return cable | {"offset_m": [cable["offset_m"]] * cable["ends_at_segment"]}


@pytest.mark.parametrize(
    "changes",
    [
        {"segment": by_stiffness()},
        {"segment": by_stiffness(float(f"{STIFFNESS:.4g}"))},
        {"segment": by_stiffness(outer_fibre_m=THICKNESS / 2)},
        {"segment": by_stiffness(STIFFNESS * 1.1), "youngs_modulus_pa": E * 1.1},
        {"segment": by_stiffness(), "youngs_modulus_pa": E * 1.1},
        with_cables(listed_offsets),
        {"cable": manipulator()["cable"][::-1]},
        {"youngs_modulus_pa": 2e11, "name": "another name", "model": "elastica"},
        {"disk": {"thickness_m": manipulator()["disk"]["thickness_m"]}},
    ],
    ids=["stiffness", "rounded", "fibre", "both scaled", "strain alone", "listed", "order", "constants", "mass"],
)
def test_one_rig_may_be_written_in_many_ways(changes):
    assert same_geometry(rig(), rig(**changes))
    assert same_geometry(rig(**changes), rig())


@pytest.mark.parametrize(
    "changes",
    [
        {"segment": [each | {"thickness_m": 1.01 * THICKNESS} for each in manipulator()["segment"]]},
        {
            "segment": [each | {"width_m": 2 * WIDTH} for each in manipulator()["segment"]],
            "youngs_modulus_pa": E / 2,
        },
        {"segment": by_stiffness(1.01 * STIFFNESS)},
        {"segment": by_stiffness(outer_fibre_m=THICKNESS)},
        {"segment": [each | {"plates": 2} for each in manipulator()["segment"]]},
        {"segment": [each | {"clamp_m": 0.007} for each in manipulator()["segment"]]},
        with_cables(lambda cable: cable | {"offset_m": -cable["offset_m"]}),
        with_cables(lambda cable: cable | {"ends_at_segment": 2}),
        with_cables(lambda cable: cable | {"name": f"cable {cable['name']}"}),
        {"disk": {"thickness_m": 0.005, "mass_kg": 0.05}},
        {"disk": {"thickness_m": 0.004, "mass_kg": 0.06}},
        {"disk": {"thickness_m": 0.004, "mass_kg": 0.05, "tip_mass_kg": 0.02}},
    ],
)
def test_another_rig_is_another_one(changes):
    assert not same_geometry(rig(), rig(**changes))
    assert not same_geometry(rig(**changes), rig())


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("learnt")
    write_record(diagnosed(), folder)
    return folder


def test_the_recorded_rig_written_otherwise_is_predicted_alike(folder):
    """Young's modulus only turns strain into stress where stiffnesses are stated."""
    as_recorded = predict(folder, rig(), PULLED, draws=40)
    otherwise = predict(folder, rig(segment=by_stiffness(), youngs_modulus_pa=1e11), PULLED, draws=40)
    assert otherwise.left_behind == ()
    assert [effect.kind for effect in otherwise.manipulator.effect] == ["weakened_plate"]
    for name in ("x_m", "y_m", "y_low_m", "y_high_m"):
        np.testing.assert_allclose(otherwise.positions[name], as_recorded.positions[name], rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("name", ["calibrated", "explained"])
def test_files_that_the_diagnosis_wrote_are_predicted_as_the_nominal_one(folder, name):
    """What was found is in them already, and is not applied twice."""
    plain, own = (predict(folder, design, PULLED, draws=40) for design in (rig(), folder / f"{name}.toml"))
    assert own.manipulator.youngs_modulus_pa == pytest.approx(plain.manipulator.youngs_modulus_pa)
    assert own.manipulator.effect == plain.manipulator.effect
    for column in ("x_m", "y_m", "y_low_m", "y_high_m"):
        np.testing.assert_allclose(own.positions[column], plain.positions[column], rtol=1e-6, atol=1e-9)
    said = [remark for remark in own.remarks if "weakened plate from this diagnosis already" in remark]
    assert len(said) == (name == "explained")


def test_a_factor_found_on_stated_stiffnesses_is_not_applied_twice():
    """`calibrated.toml` scales the modulus and the stated stiffnesses alike."""
    found, here = Constants(log_stiffness=0.05), rig(segment=by_stiffness())
    calibrated = rig(segment=by_stiffness(STIFFNESS * np.exp(0.05)), youngs_modulus_pa=E * np.exp(0.05))
    assert carried_constants(found, here, calibrated).log_stiffness == pytest.approx(0.0, abs=1e-12)


def test_what_a_design_states_itself_stays_as_it_states_it():
    pulley, other = ({"kind": "pulley_friction", "efficiency": share} for share in (0.9, 0.95))
    found = [EFFECT_KINDS["pulley_friction"].model_validate(pulley)]
    for segment in (manipulator()["segment"], by_stiffness(0.1)):
        carried, left = carried_effects(found, rig(), rig(segment=segment, effect=[other]))
        assert carried == ()
        assert left == ("pulley friction, of which this design's file states its own",)
        known = rig(segment=segment, effect=[other])  # as the recorded rig's file had it: more was found beside it
        assert carried_effects(found, rig(effect=[other]), known) == (tuple(found), ())
    weak = EFFECT_KINDS["weakened_plate"](plate=2, factor=0.7)
    elsewhere = rig(effect=[{"kind": "weakened_plate", "plate": 3, "factor": 0.8}])
    assert carried_effects([weak], rig(), elsewhere) == ((weak,), ())


def test_a_coefficient_that_stays_behind_is_not_told_to_be_absent(folder):
    learnt = predict(folder, rig().replace("friction.wrap", "edges"), PULLED, draws=40)
    assert learnt.manipulator.friction.coefficient == rig().friction.coefficient
    assert any("what the design's file states" in remark for remark in learnt.remarks)


def test_effects_of_the_recorded_rigs_own_file_that_a_design_lacks_are_told(folder, tmp_path):
    record = json.loads((folder / "diagnosis.json").read_text())
    known = [{"kind": "pulley_friction", "efficiency": 0.9}, {"kind": "worn_hole", "disk": 2, "coefficient": 1.0}]
    law = {"kind": "empirical_moment", "terms": [{"of": "bend", "coefficient": 0.1}]}
    record["posterior"]["manipulator"]["effect"] = known
    (tmp_path / "diagnosis.json").write_text(json.dumps(record))
    told = "{}, which the file of the recorded rig states and this design's does not"
    other = rig(segment=[each | {"plates": 4} for each in manipulator()["segment"]])
    assert told.format("pulley friction") in predict(tmp_path, other).left_behind
    assert told.format("worn hole") not in predict(tmp_path, other).left_behind  # a fault of that rig
    assert predict(tmp_path, rig()).left_behind == tuple(map(told.format, ("pulley friction", "worn hole")))
    record["posterior"]["manipulator"]["effect"] = [law]  # an empirical law of that rig
    (tmp_path / "diagnosis.json").write_text(json.dumps(record))
    assert not [reason for reason in predict(tmp_path, other).left_behind if "empirical" in reason]
    assert predict(tmp_path, rig()).left_behind == (told.format("empirical moment"),)
    record["posterior"]["manipulator"]["effect"] = known
    (tmp_path / "diagnosis.json").write_text(json.dumps(record))
    assert predict(tmp_path, rig(effect=known)).left_behind == ()


def test_a_law_in_strain_stays_behind_where_the_rigs_file_states_no_fibre():
    law = EFFECT_KINDS["nonlinear_plate"](law="bilinear", knee_strain=1e-3, ratio=0.4)
    carried, left = carried_effects([law], rig(), rig(segment=by_stiffness()))
    assert carried == ()
    assert "needs outer_fibre_m" in left[0]


def test_clamps_that_give_way_carry_over_to_a_file_of_constant_curvature(folder, tmp_path):
    """A diagnosis predicts with the elastica, whatever model the design's file names."""
    record = json.loads((folder / "diagnosis.json").read_text())
    (plain, *_) = record["posterior"]["models"]
    clamps = {"kind": "clamp_compliance", "compliance_rad_per_n_m": 0.01}
    record["posterior"]["models"] = [
        plain | {"probability": 1.0, "named": True, "effects": [clamps], "free": [], "covariance": []}
    ]
    (tmp_path / "diagnosis.json").write_text(json.dumps(record))
    learnt = predict(tmp_path, rig(model="constant-curvature"))
    assert learnt.left_behind == ()
    assert [effect.kind for effect in learnt.manipulator.effect] == ["clamp_compliance"]
    assert load_manipulator(folder / "explained.toml").model == learnt.manipulator.model
