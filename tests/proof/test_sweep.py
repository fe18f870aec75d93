"""How scores move with the settings: one number at a time, on the same recordings, and only what differs counts."""

import dataclasses
import json

import numpy as np
import pytest

from prb3r.diagnosis.settings import Settings
from prb3r.errors import SpecError
from prb3r.present.proof.sweep import publish_sweep, sweep_table
from prb3r.proof.judging.intervals import Score
from prb3r.proof.judging.scores import GOALS
from prb3r.proof.sweep import NotingSettings, SettingsSweep, VariantScores, moved, numeric_settings, run_sweep, variants


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
    scores = tuple((goal, Score(0.5, 0.3, 0.7, 12, 6)) for goal in GOALS)
    lower = tuple((goal, Score(0.25, 0.1, 0.5, 12, 3) if k == 0 else score) for k, (goal, score) in enumerate(scores))
    still = VariantScores("bic_fall", 8.0, scores, 0, 1)
    moving = VariantScores("naming_rate", 0.0024, lower, changed, 9)
    up = dataclasses.replace(still, value=12.0), dataclasses.replace(moving, value=0.0036, scores=scores, changed=0)
    return SettingsSweep(5, "abc", 12, Settings(), scores, (still, moving), up, 60.0)


def test_the_table_says_what_moved_most_telling_first(tmp_path):
    table = sweep_table(swept(3))
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in table]
    headlines = [goal.short for goal in GOALS if goal.short]
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
    assert len(rows[0]["scores"]) == len(GOALS)
    assert np.isclose(rows[2]["scores"][0]["value"], 0.25)
    assert "\n".join(table) in (tmp_path / "settings.md").read_text()


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
