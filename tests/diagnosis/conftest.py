"""Scopes of rigs on which every kind is suspected somewhere, and all hypotheses about them."""

import pytest
from diagnosis.simulated import NITINOL
from diagnosis.suspected import MU, scope, sections

from prb3r.diagnosis.library import hypotheses


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
    closing = [each for each in hypotheses(limp) if each.kind == "notch_closing"]
    plateau = [each for each in hypotheses(nitinol) if each.kind == "superelastic_plate"]
    return [(each, MU) for each in (*hypotheses(rubbing), *closing, *plateau)] + [
        (each, 0.0) for each in hypotheses(frictionless)
    ]
