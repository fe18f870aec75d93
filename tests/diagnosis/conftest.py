"""Scopes of rigs on which every kind is suspected somewhere, and all hypotheses about them; a rig with a weak plate."""

import pytest
from diagnosis.learnt import write_learnt
from diagnosis.simulated import NITINOL, recorded
from diagnosis.suspected import MU, SAG, scope, sections

from prb3r.diagnosis.fit.calibrate import fit_constants
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.library import hypotheses
from prb3r.diagnosis.library.scope import Scope


@pytest.fixture(scope="session")
def calibrated():
    """Constants of a rig with a weak plate 4, which the file does not say."""
    return fit_constants(predictor(recorded()))


@pytest.fixture(scope="session")
def suspects(calibrated):
    """Every hypothesis on that rig."""
    predict = calibrated.model.predict
    return hypotheses(Scope.of(predict.recording, predict.chain, calibrated.solved.states))


@pytest.fixture(scope="session")
def rubbing():
    return scope()


@pytest.fixture(scope="session")
def frictionless():
    return scope(friction={"coefficient": 0.0})


@pytest.fixture(scope="session")
def limp():
    """Plates that bend to 0.3 rad and more, where notches of their length close at 0.5."""
    return scope(segment=sections(thickness_m=0.0006))


@pytest.fixture(scope="session")
def nitinol():
    """Plates of a modulus and strains at which their material may be superelastic."""
    modulus, thickness = NITINOL
    return scope(youngs_modulus_pa=modulus, segment=sections(thickness_m=thickness))


@pytest.fixture(scope="session")
def library(rubbing, frictionless, limp, nitinol):
    """Every hypothesis on some rig, with the friction coefficient beside it."""
    carried = [each for each in hypotheses(scope(effect=[SAG])) if each.kind == "tip_mass"]
    closing = [each for each in hypotheses(limp) if each.kind == "notch_closing"]
    plateau = [each for each in hypotheses(nitinol) if each.kind in ("superelastic_plate", "flag_hysteresis")]
    unweighed = [each for each in hypotheses(scope(disk={"thickness_m": 0.004})) if each.kind == "self_weight"]
    return [(each, MU) for each in (*hypotheses(rubbing), *closing, *plateau, *carried, *unweighed)] + [
        (each, 0.0) for each in hypotheses(frictionless)
    ]


@pytest.fixture(scope="module")
def weak_rig(tmp_path_factory):
    """The record of the diagnosis of the rig with a weak plate, with designs and steps to predict."""
    return write_learnt(tmp_path_factory.mktemp("learnt"))
