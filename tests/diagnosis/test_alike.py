"""What sister rigs may have alike beside their material: clamps of one make, sensors of one bench, parts of one rig."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.sisters import E, write_sister

from prb3r.diagnosis.fit.calibrate import nominal_noise
from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.fit.joint import JointModel
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Model
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.library import hypotheses
from prb3r.diagnosis.library.groups import groups_of
from prb3r.diagnosis.library.scope import Scope
from prb3r.diagnosis.search.confounded import widening
from prb3r.diagnosis.search.joint_columns import moved_together
from prb3r.diagnosis.search.joint_pool import JointPool, joint_search, shared_constants
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.settings import Settings
from prb3r.diagnosis.together import diagnose_together
from prb3r.recording.reading import load_recording
from prb3r.recording.recording import Prior, Sharing

SOFT = {"kind": "clamp_compliance", "compliance_rad_per_n_m": 0.006}
STATED = Prior(youngs_modulus=0.05, friction_coefficient=0.3)


def recordings(folder, names=("short", "thick"), own=None):
    """Rigs without a law of bending, of which Young's modulus is as the files state it, within 5 %."""
    folders = [folder / f"{number} {name}" for number, name in enumerate(names)]
    for path, name in zip(folders, names, strict=True):
        write_sister(path, name, E, law=None, own=(dict(own),) if own else ())
    return [
        replace(load_recording(path), name=path.name, prior=STATED, sharing=Sharing(material=True, friction=True))
        for path in folders
    ]


def searched(recorded):
    """The joint search on some recordings, and the model that it starts from."""
    rigs, alone = [], []
    for recording in recorded:
        predict = predictor(recording)
        rigs.append(Model(predict, nominal_noise(predict)))
        alone.append(Search(hypotheses(Scope.of(recording, predict.chain, predict.equilibria(Constants()))), 0))
    groups = groups_of(recorded)
    model = JointModel(tuple(rigs), shared_constants(rigs, groups))
    return joint_search(alone, model, groups), alone


def odds_of(search, kind, rigs, **place):
    return next(
        np.exp(odds)
        for joint, odds in search.log_odds.items()
        if (joint.kind, joint.rigs) == (kind, rigs) and dict(joint.first.place) == place
    )


@pytest.mark.long
def test_what_one_rig_has_is_alike_on_all_or_its_own_and_both_together_are_as_probable_as_on_a_single_rig(tmp_path):
    search, alone = searched(recordings(tmp_path))
    for kind, alike in (("clamp_compliance", 0.9), ("base_compliance", 0.5)):
        single = [np.exp(odds) for one, odds in alone[0].log_odds.items() if (one.kind, one.place) == (kind, ())]
        assert odds_of(search, kind, (0, 1)) == pytest.approx(alike * single[0])
        assert odds_of(search, kind, (0,)) == pytest.approx((1 - alike) * single[0])
        assert odds_of(search, kind, (1,)) == pytest.approx((1 - alike) * single[0])


def test_a_part_is_alike_only_where_it_may_be_the_same_part(tmp_path):
    def in_common(recorded):
        search, _ = searched(recorded)
        return {(joint.kind, joint.first.place) for joint in search.library if len(joint.rigs) == 2}

    plate, sensor, hole = (
        ("weakened_plate", (("plate", 1),)),
        ("tension_offset", (("cables", ("a",)),)),
        ("hole_offset", (("cable", "a"),)),
    )
    sisters, twice = in_common(recordings(tmp_path)), in_common(recordings(tmp_path / "twice", ("short", "short")))
    assert sensor in sisters  # of one bench
    assert not sisters & {plate, hole}
    assert {plate, sensor, hole} <= twice


def test_rigs_that_share_nothing_have_nothing_alike(tmp_path):
    none = Sharing(material=False, friction=False)
    search, _ = searched([replace(each, sharing=none) for each in recordings(tmp_path)])
    assert all(len(joint.rigs) == 1 for joint in search.library)


@pytest.mark.parametrize("stated", [0.05, None])
def test_a_value_of_a_rigs_own_is_as_near_the_shared_one_as_both_are_stated(tmp_path, stated):
    """The difference of two numbers, each known to within sd, is known to within sd times the root of two."""
    prior = STATED.model_copy(update={"youngs_modulus": stated})
    search, _ = searched([replace(each, prior=prior) for each in recordings(tmp_path)])
    own = next(joint for joint in search.library if joint.parting and joint.kind == "own log_stiffness")
    expected = np.sqrt(2) * stated if stated else Settings().modulus_sd
    assert own.parting.prior_sd == pytest.approx(expected, rel=0.05)


@pytest.mark.long
def test_what_leaves_shared_constants_uncertain_is_fitted_beside_them(tmp_path):
    """Clamps on all rigs widen the modulus as the normal matrix of the model that has them says."""
    recorded = recordings(tmp_path, own=tuple(SOFT.items()))
    search, _ = searched(recorded)
    rigs = tuple(Model(predict, nominal_noise(predict)) for predict in map(predictor, recorded))
    model = JointModel(rigs, shared_constants(rigs, groups_of(recorded)))
    fitted = fit(model, np.zeros(model.count), least_promise=model.settings.small_gain)
    soft = next(joint for joint in search.library if (joint.kind, joint.rigs) == ("clamp_compliance", (0, 1)))
    beside, p = replace(model, hypotheses=(soft,)), np.append(fitted.p, 0.0)
    jacobian = beside.jacobian(p, beside.solve(p))
    wide, known = (np.sqrt(np.diag(np.linalg.inv(j.T @ j))) for j in (jacobian, fitted.jacobian))
    added = np.sqrt(wide[: len(known)] ** 2 - known**2)
    (moved,) = moved_together(fitted, [(soft, np.zeros(1))])
    assert widening(fitted, moved)[0] == pytest.approx(added[0], rel=1e-3)
    assert added[0] > model.settings.confounded * known[0]  # of ln E

    pool = JointPool(search, model.settings, [fitted])
    pool.add_confounded(fitted)
    assert frozenset([soft]) in pool.fits
    assert all(len(effects) <= 1 for effects in pool.fits)


@pytest.mark.long
def test_soft_clamps_of_one_make_are_found_on_all_rigs_with_one_compliance(tmp_path):
    """Of either rig alone they are hardly told from Young's modulus."""
    found = diagnose_together([Task(recording) for recording in recordings(tmp_path, own=tuple(SOFT.items()))])
    clamps = [each for each in found.common.shared if each.effect == "clamp_compliance"]
    assert len(clamps) == 1
    assert clamps[0].agrees
    told, true = clamps[0].together, SOFT["compliance_rad_per_n_m"]
    assert told.low - (told.high - told.low) / 4 < true < told.high + (told.high - told.low) / 4
    for diagnosis in found.diagnoses:
        assert diagnosis.verdict in ("explained", "ambiguous")
        assert [effect.kind for effect in diagnosis.effects] == ["clamp_compliance"]
        modulus = diagnosis.constants["youngs_modulus_pa"]
        assert modulus.low < E < modulus.high
    assert not any(found.common.own.values())
