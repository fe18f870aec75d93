"""Whether a search misses what the readings tell: the truth, fitted, against what it finds."""

import numpy as np
import pytest
from diagnosis.simulated import WEAK, recorded

from prb3r.diagnosis.known import Task
from prb3r.diagnosis.search.apply import serially
from prb3r.diagnosis.settings import Settings
from prb3r.diagnosis.stages import to_search
from prb3r.proof.attained import attained, hypotheses_on

FAINT = {"kind": "gravity", "x_m_s2": 0.0, "y_m_s2": 0.01}
"""A thousandth of what the rig would notice."""


def searched(**settings):
    return to_search(Task(recorded(), settings=Settings(**settings)), lambda stage: None, serially)


@pytest.fixture(scope="module")
def found():
    return searched()


def test_a_search_that_finds_the_weak_plate_misses_nothing(found):
    what = attained(found, [WEAK])
    assert what.effects == ("weakened_plate (plate 4)",)
    assert not what.missed
    assert what.possible == pytest.approx(what.chosen, abs=0.01)


@pytest.mark.long
def test_a_search_that_fits_no_set_misses_it():
    # no model is near enough to the best to be expanded, and no effect is added for what it leaves uncertain
    blind = searched(expansion_reach=-1.0, exchanges=0, confounded=np.inf)
    what = attained(blind, [WEAK])
    assert what.missed
    assert what.possible > what.chosen + 10


def test_what_the_readings_do_not_tell_is_not_missed(found):
    what = attained(found, [WEAK, FAINT])
    assert what.effects == ("weakened_plate (plate 4)",)
    assert not what.missed


def test_of_what_the_library_lacks_nothing_is_asked(found):
    assert attained(found, [{"kind": "weakened_plate", "plate": 99, "factor": 0.5}]).chosen > -np.inf


@pytest.mark.parametrize(("stages", "place"), [(None, {}), (1, {}), (2, {"elements": 2}), (3, {"elements": 3})])
def test_plates_that_dissipate_are_sought_by_their_stages(found, stages, place):
    effect = {"kind": "hysteretic_plate", "slipping_share": 0.3, "yield_strain": 1e-3, "elements": stages}
    told = {name: value for name, value in effect.items() if value is not None}
    kinds = found.tested.doubted.search.library
    assert dict(hypotheses_on(told, kinds)[0].place) == place
    assert len(hypotheses_on(told, kinds)) == (1 if stages else 3)


def test_a_weak_plate_is_sought_where_it_is(found):
    (only,) = hypotheses_on(WEAK, found.tested.doubted.search.library)
    assert dict(only.place) == {"plate": 4}
