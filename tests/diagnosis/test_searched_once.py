"""Two recordings that differ in what is set aside alone are searched once."""

import pytest
from diagnosis.planted import misnoted
from diagnosis.simulated import Case, recorded

from prb3r.diagnosis import stages
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.search.apply import serially
from prb3r.diagnosis.stages import search, searched_as, to_test


@pytest.mark.parametrize("aside", [True, False])
def test_weights_that_no_fit_has_seen_ask_for_no_other_search(aside, monkeypatch):
    right = recorded(Case(hidden=()))
    tested = to_test(Task(right), lambda stage: None, serially)
    before, count = search(tested), []
    monkeypatch.setattr(stages, "search_effects", lambda *given: count.append(given))
    unseen = {right.sequences[number] for number in tested.doubted.aside}
    name = min(name for name in right.sequences if (name in unseen) == aside)
    pulled = right.loads.tension[right.of_sequence == right.sequences.index(name)].max(0).argmax()
    wrong = misnoted(right, right.manipulator.cable_names[pulled], name, 1.1)
    again = searched_as(to_test(Task(wrong), lambda stage: None, serially), before)
    assert (len(count) == 0) == aside
    assert (again.choice is before.choice) == aside
    assert again.tested.doubted.recording.loads.tension.sum() > right.loads.tension.sum()
