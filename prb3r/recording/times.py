"""What the times of a recording's steps say, and doubts about their unit, as sentences."""

from collections.abc import Iterator

from prb3r.model.step_checks import TIME
from prb3r.quantities import duration
from prb3r.recording.recording import Recording

LONGEST_PACE_S = 7200.0
"""Longest median time from one step to the next without a doubt, s: two hours.  Choice: whoever hangs weights and reads
takes seven seconds or more, which are two hours where milliseconds are taken for seconds.  Creep that is watched for
days may have fewer steps than that, so it is a doubt alone."""
SHORTEST_PACE_S = 0.005
"""Shortest one, s.  Choice: drives log a hundred or two hundred times a second; eighteen seconds are 0.005 hours, and
seven minutes 0.005 days, as spreadsheets keep times."""


def times_told(recording: Recording) -> Iterator[str]:
    """A sentence on how long the recording took and how fast its steps follow each other, if its steps have times."""
    if TIME not in recording.steps:
        return
    time, pace = recording.loads.time[:, 0], recording.pace_s
    each = "" if pace is None else f", {duration(pace)} from one step to the next (median)"
    yield f"its times ({TIME}) span {duration(float(time.max() - time.min()))}{each}"


def odd_times(recording: Recording) -> Iterator[str]:
    """A doubt if steps follow each other much more slowly, or faster, than anybody loads an arm."""
    pace = recording.pace_s
    if pace is None or SHORTEST_PACE_S <= pace <= LONGEST_PACE_S:
        return
    unit = "milliseconds" if pace > LONGEST_PACE_S else "hours or days"
    yield (
        f"by {TIME} it takes {duration(pace)} from one step to the next (median); are times in {unit}? they are taken "
        "as seconds, and so is all that goes with the time"
    )
