"""Recordings at odds with the drawing of the rig are doubted before any fit; right ones are not."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.simulated import Case, recorded

from prb3r.mechanics.chain import Loads
from prb3r.recording.at_odds import at_odds
from prb3r.recording.recording import Kind, Readings


@pytest.fixture(scope="module")
def right():
    return recorded(Case(hidden=()))


def pulled(recording, factor):
    return replace(recording, loads=recording.loads._replace(tension=factor * recording.loads.tension))


def test_a_right_recording_is_not_doubted(right):
    assert not list(at_odds(right))
    assert not list(at_odds(pulled(right, 3.0)))


def test_exchanged_axes_are_doubted(right):
    kind = np.where(
        right.readings.kind == Kind.X, Kind.Y, np.where(right.readings.kind == Kind.Y, Kind.X, right.readings.kind)
    )
    (said,) = at_odds(replace(right, readings=right.readings._replace(kind=kind)))
    assert "are x_m and y_m exchanged" in said


def test_tensions_in_grams_are_doubted(right):
    (said,) = at_odds(pulled(right, 1000 / 9.81))
    assert "grams" in said
    assert "9.68e+03 N" in said


@pytest.mark.parametrize("kinds", [[Kind.X, Kind.Y], [Kind.ANGLE], [Kind.BEND]])
def test_they_are_doubted_by_whatever_tells_how_far_the_tip_turns(right, kinds):
    some = replace(right, readings=right.readings.where(np.isin(right.readings.kind, kinds)))
    assert len(list(at_odds(pulled(some, 100)))) == (kinds != [Kind.BEND])


def test_nothing_is_doubted_where_nothing_was_read_or_loaded(right):
    none = Readings(*(field[:0] for field in right.readings))
    assert not list(at_odds(replace(right, readings=none)))
    idle = Loads(*(np.zeros_like(field) for field in right.loads))
    assert not list(at_odds(replace(right, loads=idle)))
