"""How scores move with the settings: one number at a time, on the same recordings, and only what differs counts."""

import dataclasses
import json
from types import SimpleNamespace

import numpy as np
import pytest
from diagnosis.simulated import recorded
from threadpoolctl import threadpool_limits

from prb3r.diagnosis.settings import Settings
from prb3r.errors import SpecError
from prb3r.present.proof.sweep import publish_sweep, sweep_table
from prb3r.proof import sweep
from prb3r.proof.judging.intervals import Score
from prb3r.proof.judging.real_scores import REAL_GOALS
from prb3r.proof.judging.scores import GOALS
from prb3r.proof.judging.verdict import Verdict
from prb3r.proof.sweep import (
    NotedVerdict,
    NotingSettings,
    SettingsSweep,
    VariantScores,
    moved,
    noted_answer,
    numeric_settings,
    run_sweep,
    variants,
)
from prb3r.proof.tasks import VerdictTask, answer
from prb3r.runs.journal import Journal


@pytest.mark.parametrize("share", [-0.2, 0.2])
def test_every_number_moves_alone_and_nothing_else(share):
    settings = Settings()
    seen = []
    for variant in variants(settings, share):
        changed = {
            field.name
            for field in dataclasses.fields(Settings)
            if getattr(variant.settings, field.name) != getattr(settings, field.name)
        }
        assert changed == {variant.field}
        assert type(variant.value) is type(getattr(settings, variant.field))
        seen.append(variant.field)
    assert seen == list(numeric_settings(settings))
    scalars = [field.name for field in dataclasses.fields(Settings) if field.type in (int, float, "int", "float")]
    assert seen == scalars


def test_numbers_move_by_a_fifth_and_shares_stay_shares():
    assert moved(10.0, 0.2) == pytest.approx(12)
    assert moved(10.0, -0.2) == pytest.approx(8)
    assert (moved(2, 0.2), moved(2, -0.2), moved(40, 0.2)) == (3, 1, 48)
    assert moved(0.95, 0.2) == pytest.approx(0.96)
    assert moved(0.95, -0.2) == pytest.approx(0.94)
    assert 0 < moved(0.7, 0.2) < 1
    rates = [value for name, value in numeric_settings(Settings()).items() if name.endswith(("rate", "level", "share"))]
    assert len(rates) > 5
    assert all(0 < moved(value, share) < 1 for value in rates for share in (-0.2, 0.2))


def swept(changed):
    """A sweep of two settings, of which only the second changes anything: the first headline, by -25 points."""
    scores = tuple((goal, Score(0.5, 0.3, 0.7, 12, 6)) for goal in (*GOALS, *REAL_GOALS))
    lower = tuple((goal, Score(0.25, 0.1, 0.5, 12, 3) if k == 0 else score) for k, (goal, score) in enumerate(scores))
    still = VariantScores("bic_fall", 8.0, scores, 0, 1)
    moving = VariantScores("naming_rate", 0.0024, lower, changed, 9)
    up = dataclasses.replace(still, value=12.0), dataclasses.replace(moving, value=0.0036, scores=scores, changed=0)
    return SettingsSweep(5, "abc", 12, Settings(), scores, (still, moving), up, 60.0)


def test_the_table_says_what_moved_most_telling_first(tmp_path):
    table = sweep_table(swept(3))
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in table]
    headlines = [goal.short for goal in (*GOALS, *REAL_GOALS) if goal.short]
    assert [text.split(" (")[0] for text in cells[0][5:]] == headlines
    assert cells[2][:6] == ["as they are", "", "", "", "", "50.0 %"]
    assert cells[3][:6] == ["naming_rate", "0.003", "0.0024 / 0.0036", "9", "3 / 0", "-25.0 / 0"]
    assert cells[4][:5] == ["bic_fall", "10", "8 / 12", "1", "0 / 0"]
    publish_sweep(swept(3), tmp_path)
    rows = json.loads((tmp_path / "settings.json").read_text())["moved"]
    assert [(row["setting"], row["moved_to"], row["read"], row["changed"]) for row in rows][2:] == [
        ("naming_rate", 0.0024, 9, 3),
        ("naming_rate", 0.0036, 9, 0),
    ]
    assert len(rows[0]["scores"]) == len(GOALS) + len(REAL_GOALS)
    assert np.isclose(rows[2]["scores"][0]["value"], 0.25)
    assert "\n".join(table) in (tmp_path / "settings.md").read_text()


def test_a_score_that_no_recording_counts_for_has_no_column():
    none = dataclasses.replace(swept(3), scores=tuple((goal, Score(np.nan, np.nan, np.nan, 0)) for goal in GOALS))
    assert [cell.strip() for cell in sweep_table(none)[0].strip("|").split("|")][-1] == "changed"


def test_what_is_no_number_is_refused_before_any_work():
    with pytest.raises(SpecError, match="naming_rate"):
        run_sweep(8, 1, 1, only=["naming_rat"])
    with pytest.raises(SpecError, match="believe_all"):
        run_sweep(8, 1, 1, only=["believe_all"])


def test_what_is_read_is_noted_also_through_what_follows_from_it_and_in_copies():
    noting = NotingSettings()
    assert dict(noting.plain()) == Settings().plain()
    assert not noting.names
    assert noting.detectable == Settings().detectable
    assert {"alarm_rate", "missed_rate", "directions_assumed"} <= noting.names
    assert not {"bic_fall", "most_effects"} & noting.names
    copy = dataclasses.replace(noting, serial_shares=())
    assert copy.serial_shares == ()
    assert set(numeric_settings(Settings())) <= noting.names


@pytest.mark.long
def test_what_no_diagnosis_reads_moves_nothing():
    """All of it moved at once: the same verdict, names, sizes and likelihood."""
    task = VerdictTask(0, recorded(), frozenset(), "diagnose", 1)
    with threadpool_limits(1):
        noted = noted_answer(task)
        values = {name: value for name, value in numeric_settings(Settings()).items() if name not in noted.read}
        assert 10 < len(values) < len(numeric_settings(Settings())) - 40
        changed = dataclasses.replace(Settings(), **{name: moved(value, 0.2) for name, value in values.items()})
        again = answer(task._replace(settings=changed))
    assert noted.verdict.verdict == "explained"
    spent = {"seconds": 0.0, "forecasting": 0.0}
    assert dataclasses.replace(again, **spent) == dataclasses.replace(noted.verdict, **spent)


def test_an_interrupted_sweep_of_other_settings_is_no_part_of_this_one(monkeypatch, tmp_path):
    """What moved is known by its place among what was asked for, which is another one."""
    kept = tmp_path / "journal"
    monkeypatch.setattr(sweep, "concealed_recordings", lambda *_: NothingConcealed())
    monkeypatch.setattr(sweep, "noted_answer", stand_in_noted)
    monkeypatch.setattr(sweep, "answer", stand_in)
    monkeypatch.setattr(Journal, "discard", lambda journal: None)
    monkeypatch.setattr(sweep, "_scores", lambda opened: ())
    for only in ("bic_fall", "naming_rate"):
        found = run_sweep(1, 1, 1, kept=kept, only=[only])
        assert found.lower[0].changed == (only == "naming_rate")


class NothingConcealed:
    """One recording, of which only the settings are asked."""

    seal = SimpleNamespace(digest="")

    def verdict_task(self, case, method):
        return VerdictTask(case, "none", frozenset(), method, 1)

    def opened(self, verdicts):
        return verdicts


def stand_in(task):
    """A verdict that depends on one setting alone."""
    return Verdict(0, "diagnose", "adequate" if task.settings.naming_rate == Settings().naming_rate else "unexplained")


def stand_in_noted(task):
    return NotedVerdict(stand_in(task), frozenset(numeric_settings(Settings())))
