"""Which blunders a recording could hold, and what is asked of each."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.simulated import recorded

from prb3r.diagnosis.checks.setup.find import least_of_kinds, remedies
from prb3r.diagnosis.checks.setup.lengths import THICKNESS
from prb3r.diagnosis.settings import Settings


def test_disks_are_not_one_off_where_a_number_would_have_no_disk():
    known = recorded()
    everywhere = np.ones(known.readings.count, int)
    ends = {
        0: "the first disk after the base is counted as 0",
        known.manipulator.plates: "the base disk is counted as 1",
    }
    for label, possible in ends.items():
        seen = replace(known, readings=known.readings._replace(disk=label * everywhere))
        said = {remedy.blunder for remedy in remedies(seen, Settings()) if "one off" in remedy.blunder}
        assert said == {f"the disks are counted one off: {possible}"}


def test_one_of_all_blunders_is_said_by_chance_in_no_more_than_the_rate_asked_for():
    """A likelihood ratio exceeds x by chance in a share 1 / x at most (Markov): the shares of all remedies add up."""
    settings, among = Settings(), remedies(recorded(), Settings())
    least = least_of_kinds(among, settings)
    of_kind = {kind: sum(np.exp(-least[kind]) for other in among if other.kind == kind) for kind in least}
    assert sum(of_kind.values()) == pytest.approx(settings.blunder_rate)
    thick = of_kind.pop(THICKNESS)
    assert len(set(np.round(list(of_kind.values()), 12))) == 1
    assert max(of_kind.values()) / thick == pytest.approx(20.0, rel=0.01)  # odds, "strong" (Kass and Raftery)
