"""What a mismatch goes with, and what parts of a recording tell of the constants."""

import numpy as np
import pytest
from diagnosis.simulated import investigated

from prb3r.diagnosis.evidence.constants_by_part import clues, parts
from prb3r.diagnosis.evidence.missing_moments import laws, mechanism


@pytest.fixture(scope="module")
def calibrated():
    return investigated().calibrated


def test_a_part_that_is_the_whole_tells_nothing_and_is_left_out(calibrated):
    """Tensions that only rise are no part beside those that fall."""
    recording = calibrated.model.predict.recording
    whole = [(by, part) for by, part, mask in parts(recording, 4) if mask.all()]
    told = [(clue.by, clue.part) for clue in clues(calibrated)]
    assert told
    assert not set(whole) & set(told)
    for by in ("direction", "sequence", "segment"):
        assert sum(other == by for other, _ in told) != 1


def test_steps_are_divided_by_whether_tensions_rise_or_fall(calibrated):
    recording = calibrated.model.predict.recording
    total = recording.loads.tension.sum(1)
    before = np.where(recording.begins, 0.0, np.roll(total, 1))
    by_part = {part: mask for by, part, mask in parts(recording, 4) if by == "direction"}
    step = recording.readings.step
    assert np.array_equal(by_part["tensions rise"], (total > before)[step])
    assert np.array_equal(by_part["tensions fall"], (total < before)[step])


def test_no_pattern_is_looked_for_twice(calibrated):
    """Where all cables slip one way, what goes with that way goes with the tensions."""
    made = mechanism(calibrated)
    patterns = {pattern.of for pattern in laws(calibrated, made)}
    one_way = np.array_equal(np.abs(made.influences["direction"]), np.abs(made.influences["tension"]))
    assert ("direction" in patterns) != one_way
    influences = {**made.influences, "direction": -made.influences["tension"]}
    again = laws(calibrated, type(made)(made.moment, made.pull, influences))
    assert "direction" not in {pattern.of for pattern in again}
    assert {"tension", "bend", "constant"} <= {pattern.of for pattern in again}
