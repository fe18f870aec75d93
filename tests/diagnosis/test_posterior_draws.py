"""Rigs drawn from a posterior act under the recorded loads as recorded, however little is told of their parts."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from diagnosis.simulated import investigated

from prb3r import load_recording, solve
from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.fit.calibrate import fit_constants
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.library import hypotheses
from prb3r.diagnosis.library.scope import Scope
from prb3r.diagnosis.result.surviving import posterior_of
from prb3r.diagnosis.search.pool import Survivor
from prb3r.model.files.toml import toml_text
from prb3r.model.manipulator import Manipulator

E, RIGID = 1.87e11, 1.87e11 * 0.03 * 8e-4**3 / 12
"""Nominal modulus, Pa, and bending stiffness of a plate, N m^2."""
NOISE = {"x_m": 3e-4, "y_m": 3e-4, "angle_rad": 0.005}


def rig(modulus=E, *effects):
    """Six equal plates without friction, with two cables to the tip: readings tell the stiffness of all, not whose."""
    cables = [{"name": name, "offset_m": at, "ends_at_segment": 1} for name, at in (("a", 0.02), ("b", -0.02))]
    plates = {"plates": 6, "length_m": 0.03, "clamp_m": 0.005, "width_m": 0.03, "thickness_m": 8e-4}
    plain = {"name": "rig", "model": "elastica", "youngs_modulus_pa": modulus, "friction": {"coefficient": 0.0}}
    return plain | {"disk": {"thickness_m": 0.004}, "segment": [plates], "cable": cables, "effect": list(effects)}


def recorded(folder, modulus, *effects):
    """A recording of the rig with another modulus and `effects`, without a prior of the modulus."""
    steps = pd.DataFrame(
        [
            {"sequence": name, "step": k, f"cable_{name}_n": 15.0 * k, f"slip_{name}": -1}
            for name in "ab"
            for k in (1, 2, 3, 4)
        ]
    ).fillna({"cable_a_n": 0.0, "cable_b_n": 0.0, "slip_a": -1, "slip_b": -1})
    true = solve(Manipulator.model_validate(rig(modulus, *effects)), steps)
    markers = true[true["disk"] > 0][["sequence", "step", "disk", *NOISE]].copy()
    rng = np.random.default_rng(1)
    for column, sd in NOISE.items():
        markers[column] += sd * rng.standard_normal(len(markers))
    exact = {"offset_m": 0.0, "length_m": 0.0, "thickness_relative": 0.0, "marker_m": 0.0}
    measured = {"position_sd_m": NOISE["x_m"], "angle_sd_rad": NOISE["angle_rad"]}
    told = {"name": "rig", "manipulator": "manipulator.toml", "measurement": measured, "tolerance": exact}
    (folder / "recording.toml").write_text(toml_text(told))
    (folder / "manipulator.toml").write_text(toml_text(rig()))
    steps.to_csv(folder / "steps.csv", index=False)
    markers.to_csv(folder / "markers.csv", index=False)
    return load_recording(folder)


@pytest.mark.parametrize(
    ("modulus", "kind", "hidden"),
    [
        (0.3 * E, "cable_bending", {"stiffness_n_m2": 0.3 * RIGID}),
        (2.0 * E, "clamp_compliance", {"compliance_rad_per_n_m": 0.5 * 0.02 / RIGID}),
        (E, "cable_bending", {}),
        (E, "clamp_compliance", {}),
        (E, "base_compliance", {}),
    ],
    ids=["stiff cables", "soft clamps", "limp cables", "firm clamps", "a firm base"],
)
def test_drawn_rigs_act_under_the_recorded_loads_as_recorded(tmp_path, modulus, kind, hidden):
    """Of p parameters the readings scatter by p of their variances in all, if they are all told."""
    recording = recorded(tmp_path, modulus, *([{"kind": kind, **hidden}] if hidden else []))
    plain = fit_constants(predictor(recording))
    library = hypotheses(Scope.of(recording, plain.model.predict.chain, plain.solved.states))
    effect = next(each for each in library if each.kind == kind)
    fitted = fit(plain.model.adding(effect), np.append(plain.p, 0.0))
    doubts, survivors = Doubts(np.ones(len(fitted.solved.readings))), (Survivor(fitted, 0.0, 1.0),)
    choice = replace(investigated().choice, fitted=fitted, survivors=survivors, doubts=doubts)
    posterior = posterior_of(replace(investigated(), choice=choice))
    drawn = [fitted.model.predict.solve(rig.constants, rig.effects) for rig in posterior.draws(100, seed=1)]
    off = [fitted.model.noise.whiten(each.readings - fitted.solved.readings) for each in drawn]
    assert np.mean(np.sum(np.square(off), axis=1)) < 2 * len(fitted.p)
