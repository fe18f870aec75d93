"""Recordings as benches give them: what is odd is used, counted and told."""

import numpy as np
import pandas as pd
import pytest
from recording.dirty import MANIPULATOR, READ, ROOT, Bench

from prb3r.check import check_file
from prb3r.recording.plausibility import implausible
from prb3r.recording.reading import load_recording
from prb3r.recording.recording import Kind


@pytest.fixture
def bench(tmp_path):
    return Bench(tmp_path)


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_clean_recording_has_every_reading_and_no_remark(bench, suffix):
    recording = bench.load(suffix)
    assert recording.remarks == ()
    assert repr(recording) == "Recording('bench', sequences=2, steps=6, readings=252)"
    assert recording.sequences == ("a", "b")
    assert recording.of_sequence.tolist() == [0, 0, 0, 1, 1, 1]
    assert recording.loads.tension[:, 0].tolist() == [10, 20, 30, 5, 15, 25]
    readings = recording.readings
    assert readings.count == 6 * 14 * 3
    expected = bench.markers.iloc[14 * readings.step + readings.disk - 1]
    columns = np.array([kind.column for kind in Kind])[readings.kind]
    assert readings.value.tolist() == [row[name] for (_, row), name in zip(expected.iterrows(), columns, strict=True)]
    part = recording.only([1])
    assert part.readings.count == 3 * 14 * 3
    assert part.loads.tension[:, 0].tolist() == [5, 15, 25]


def test_the_folder_and_its_file_are_the_same_recording(bench):
    folder = bench.write()
    assert load_recording(folder / "recording.toml").readings.count == load_recording(folder).readings.count


# odd, but used


def test_empty_cells_absent_rows_and_disks_are_counted(bench):
    bench.markers.loc[[3, 4], "x_m"] = np.nan
    bench.markers = bench.markers[bench.markers["disk"] != 9].drop(index=20)
    recording = bench.load()
    assert recording.readings.count == bench.cells == 77 * 3 - 2
    assert recording.remarks == (
        "2 of 231 cells of markers.csv are empty: not read",
        "disk 9 never read",
        "1 marker without a row in markers.csv at steps where others have one",
    )


def test_steps_without_readings_are_kept_and_told(bench):
    bench.markers = bench.markers[bench.markers["step"] != 2]
    recording = bench.load()
    assert len(recording.steps) == 6
    assert recording.remarks == ("2 steps without any reading",)


@pytest.mark.parametrize("kind", ["angle_rad", "bend_rad"])
def test_angles_or_bends_alone_need_no_deviation_of_positions(bench, kind):
    bench.markers = bench.markers.drop(columns=["x_m", "y_m"]).rename(columns={"angle_rad": kind})
    del bench.described["measurement"]["position_sd_m"]
    assert bench.load().readings.count == bench.cells == 84


def test_the_tip_alone_of_one_sequence(bench):
    bench.steps = bench.steps[:3]
    bench.markers = bench.markers[(bench.markers["sequence"] == "a") & (bench.markers["disk"] == 14)]
    recording = bench.load()
    assert recording.readings.count == 9
    assert recording.remarks == ("disks 1-13 never read",)
    unread, first, second = implausible(recording)
    assert unread.startswith("cables 2, 3, 4 without a column of tensions in the steps")
    assert first.startswith("one sequence alone: none can be set aside")
    assert second.startswith("no cable is ever let go again")


@pytest.mark.filterwarnings("error")
def test_angles_alone_are_as_plausible_as_any_and_nothing_is_said_of_positions(bench):
    bench.markers = bench.markers.drop(columns=["x_m", "y_m"])
    told = check_file(bench.write())
    assert "positions" not in told
    assert "angles within 0.005 rad" in told


def test_what_is_let_go_within_a_sequence_is_a_way_back(bench):
    assert any("let go" in doubt for doubt in implausible(bench.load()))  # a new sequence begins lower, from rest
    bench.steps.loc[2, "cable_1_n"] = 5.0
    assert not any("let go" in doubt for doubt in implausible(bench.load()))


def test_a_cable_without_a_column_and_a_sequence_without_loads_are_told(bench):
    bench.steps[["cable_2_n", "cable_3_kg", "cable_4_n"]] = 0.0
    assert not any("column" in doubt for doubt in implausible(bench.load()))
    bench.steps = bench.steps.drop(columns="cable_3_kg")
    bench.steps.loc[bench.steps["sequence"] == "b", "cable_1_n"] = 0.0
    said = list(implausible(bench.load()))
    assert any(doubt.startswith("cable 3 without a column of tensions") for doubt in said), said
    assert any(doubt.startswith("sequence b: no load at any step") for doubt in said), said


def test_a_sequence_in_grams_among_others_in_newtons_is_told(bench):
    assert not any("grams" in doubt for doubt in implausible(bench.load()))
    bench.steps.loc[bench.steps["sequence"] == "b", "cable_1_n"] *= 1000 / 9.80665
    (said,) = (doubt for doubt in implausible(bench.load()) if "grams" in doubt)
    assert said.startswith("sequence b is pulled by up to ")


def test_positions_of_the_base_are_readings_too(bench):
    bench.markers = pd.concat([bench.markers, bench.markers[:1].assign(disk=0, x_m=-0.002)])
    recording = bench.load()
    assert recording.readings.count == bench.cells
    assert recording.remarks[0].startswith("5 markers without a row")


def test_slightly_negative_forces_are_zero_counted_and_told(bench):
    bench.steps["cable_1_n"] = [-0.1, 20, 30, -0.2, 15, 25]
    recording = bench.load()
    assert recording.loads.tension[:, 0].tolist() == recording.steps["cable_1_n"].tolist() == [0, 20, 30, 0, 15, 25]
    assert recording.remarks == (
        "2 tensions of steps.csv slightly below zero (lowest cable_1_n = -0.2): force sensors at rest, taken as zero",
    )


def test_kilograms_are_newtons(bench):
    bench.steps = bench.steps.rename(columns={"cable_1_n": "cable_1_kg"})
    assert bench.load().loads.tension[0, 0] == pytest.approx(97.85)


def test_steps_out_of_order_are_sorted_and_keep_their_readings(bench):
    clean = bench.load()
    bench.steps = bench.steps.iloc[[3, 1, 0, 2, 5, 4]]
    bench.markers = bench.markers.sample(frac=1, random_state=1)
    recording = bench.load()
    assert recording.sequences == ("b", "a")
    assert recording.remarks == (
        "steps.csv: the rows of sequence b did not stand together; each is one sequence",
        "steps.csv: the steps of sequences b, a were out of order and are sorted by number",
    )
    pd.testing.assert_frame_equal(recording.only([1]).steps, clean.only([0]).steps)
    assert recording.only([1]).readings.value.tolist() == clean.only([0]).readings.value.tolist()


def test_repeated_rows_of_markers_are_used_once_and_counted(bench):
    cells = bench.cells
    bench.markers.loc[2, "y_m"] = np.nan
    bench.markers = pd.concat([bench.markers, bench.markers[:3]], ignore_index=True)
    recording = bench.load()
    assert recording.readings.count == cells - 1
    assert (
        recording.remarks[0] == "rows 85-87 of markers.csv (8 readings) repeat a row before exactly and are used once"
    )


def test_contradicting_readings_are_all_used(bench):
    bench.markers = pd.concat([bench.markers, bench.markers[:2].assign(x_m=0.03)], ignore_index=True)
    recording = bench.load()
    assert recording.readings.count == bench.cells
    assert recording.remarks == (
        "rows 1-2, 85-86 of markers.csv: 2 markers read more than once with different values; every reading is used",
    )


def test_a_sequence_repeated_with_equal_loads_is_taken_once(bench):
    bench.steps = pd.concat([bench.steps, bench.steps[:3]], ignore_index=True)
    bench.markers = pd.concat([bench.markers, bench.markers[:42].assign(y_m=0.01)], ignore_index=True)
    recording = bench.load()
    assert len(recording.steps) == 6
    assert recording.readings.count == bench.cells
    assert recording.remarks[0] == (
        "rows 7-9 of steps.csv: the same step with the same loads as a row before, taken once; "
        "a sequence that was pulled again needs a name of its own in both tables"
    )


def test_slips_are_ignored_where_friction_follows_the_history(bench):
    bench.manipulator = MANIPULATOR.replace("coefficient = 0.3", 'coefficient = 0.3\ndirection = "history"')
    bench.steps["slip_1"] = -1
    assert bench.load().remarks == ("slip_1 of steps.csv ignored: friction follows the cables' own travel (history)",)


def test_blank_rows_of_a_spreadsheet_are_nothing(bench):
    bench.write()
    with (bench.folder / "markers.csv").open("a") as file:
        file.write(",,,,,\n , ,,,,\n")
    recording = load_recording(bench.folder)
    assert recording.readings.count == bench.cells
    assert recording.remarks == ("rows 85-86 of markers.csv hold nothing at all",)


def test_numbered_sequences_meet_across_formats(bench):
    numbered = {"a": 1, "b": 2}
    bench.steps["sequence"], bench.markers["sequence"] = (
        bench.steps["sequence"].map(numbered),
        bench.markers["sequence"].map(numbered),
    )
    bench.write()
    (bench.folder / "markers.csv").unlink()
    bench.markers.astype({"sequence": float, "step": float}).to_parquet(bench.folder / "markers.parquet")
    recording = load_recording(bench.folder)
    assert recording.sequences == ("1", "2")
    assert recording.readings.count == bench.cells


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("position_sd_m", 0.3, "position_sd_m = 0.3 is much for a length of 0.476 m; in metres?"),
        ("angle_sd_rad", 0.5, "angle_sd_rad = 0.5 is 28.6 degrees; in radians?"),
        ("tension_sd_relative", 0.3, "tension_sd_relative = 0.3 is 30%; not in percent?"),
    ],
)
def test_deviations_of_another_unit_are_doubted(bench, key, value, said):
    bench.described["measurement"][key] = value
    assert bench.load().remarks == (said,)


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("marker_m", 0.2, "marker_m = 0.2 under [tolerance] is much for a plate of 0.03 m; in metres?"),
        ("length_m", 0.01, "length_m = 0.01 under [tolerance] is much for a plate of 0.03 m; in metres?"),
        ("thickness_relative", 1.0, "thickness_relative = 1 is 100%; not in percent?"),
    ],
)
def test_tolerances_of_another_unit_are_doubted(bench, key, value, said):
    bench.described["tolerance"] = {key: value}
    assert bench.load().remarks == (said,)


@pytest.mark.parametrize("seed", range(20))
def test_no_reading_is_silently_dropped(bench, seed):
    """Cells that are not empty = readings + readings in rows that are reported as repeated, whatever the dirt."""
    rng = np.random.default_rng(seed)
    rows = rng.choice(84, rng.integers(10, 84), replace=False)
    markers = bench.markers.iloc[rows].reset_index(drop=True)
    markers[READ] = markers[READ].mask(rng.random((len(rows), 3)) < rng.choice([0, 0.1, 0.6]))
    exact = markers.iloc[rng.choice(len(rows), rng.integers(0, 9))]
    other = markers.iloc[rng.choice(len(rows), rng.integers(0, 9))].assign(angle_rad=rng.normal())
    markers = pd.concat([markers, exact, other]).sample(frac=1, random_state=seed)
    bench.markers = markers
    bench.steps = bench.steps.sample(frac=1, random_state=seed)
    recording = bench.load(str(rng.choice([".csv", ".parquet"])))
    repeats = [remark for remark in recording.remarks if "repeat a row" in remark]
    told = sum(int(remark.split("(")[1].split(" reading")[0]) for remark in repeats)
    assert recording.readings.count + told == bench.cells
    for k, kind in enumerate(Kind):
        if kind.column in bench.markers:
            kept = recording.readings.value[recording.readings.kind == k]
            assert set(kept) == set(bench.markers[kind.column].dropna())


# real ones

REAL = ROOT.parent / "shared/recordings"


@pytest.mark.skipif(
    not REAL.exists(), reason="the measured recordings are not beside the repository (../shared/recordings)"
)
@pytest.mark.parametrize(
    ("name", "readings", "steps", "below_zero"),
    [("notched-wrist-90", 375, 75, 0), ("notched-wrist-tip-first", 332, 83, 1)],
)
def test_the_measured_wrists(name, readings, steps, below_zero):
    recording = load_recording(REAL / name)
    assert recording.readings.count == readings
    assert (recording.readings.kind == Kind.BEND).all()
    assert len(recording.steps) == steps
    assert len(recording.sequences) == 5
    assert sum("slightly below zero" in remark for remark in recording.remarks) == below_zero
