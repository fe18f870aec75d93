"""Disks that were never read, and would tell what is named from what could stand in its place."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.simulated import Case, investigated, rival_of

from prb3r.diagnosis.checks.unread import disk_to_read


@pytest.fixture(scope="module")
def alternatives():
    """A choice between a weak plate 4 and a softer segment 2, which holds plates 4 to 6, with the readings of some
    disks alone; both sets are fitted to the readings of all."""
    found = investigated(Case())
    weak, soft = found.explained, rival_of(found)

    def among(disks, share=0.4):
        keep = np.isin(weak.recording.readings.disk, disks)
        recording = replace(weak.recording, readings=weak.recording.readings.where(np.flatnonzero(keep)))
        sets = []
        for each, probability in ((weak, 1 - share), (soft, share)):
            model = replace(each.model, predict=replace(each.model.predict, recording=recording))
            known = replace(each, model=model)
            sets.append(replace(found.choice.survivors[0], fitted=known, probability=probability))
        return replace(found.choice, fitted=sets[0].fitted, survivors=tuple(sets))

    return among


@pytest.mark.parametrize(("read", "asked"), [((6,), True), ((1, 2, 6), True), ((4, 6), False), (range(1, 7), False)])
def test_the_disk_at_the_end_of_a_weak_plate_tells_it_from_a_soft_segment(alternatives, read, asked):
    """Plate 4 ends at disk 4: a single hinge bends the arm there, a soft segment beyond it too."""
    said = disk_to_read(alternatives(list(read)))
    assert [text.split(":")[0] for text in said] == ["read disk 4 too, under the same loads"] * asked
    assert all(text.endswith('tell what is named from "segment_stiffness (segment 2)"') for text in said)


def test_no_disk_is_asked_for_where_nothing_else_is_likely(alternatives):
    assert disk_to_read(alternatives([6], share=0.04)) == []
