"""Recordings that cannot be used: everything wrong is said at once, with its place."""

import numpy as np
import pandas as pd
import pytest
from recording.dirty import READ, Bench

from prb3r.errors import RecordingError
from prb3r.recording.reading import load_recording


@pytest.fixture
def bench(tmp_path):
    return Bench(tmp_path)


def swapped(frame, row, name, value):
    """The table with another cell, whatever its type."""
    return frame.assign(**{name: frame[name].astype(object).mask(frame.index == row, value)})


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda m: m.assign(x_m=1000 * m.x_m, y_m=1000 * m.y_m), "but the manipulator is 0.476 m long; millimetres?"),
        (lambda m: m.assign(x_m=100 * m.x_m, y_m=100 * m.y_m), "0.476 m long; centimetres? write metres (84 of 84"),
        (
            lambda m: m.assign(x_m=m.x_m / 1e3, y_m=m.y_m / 1e3),
            "bench/markers.csv: x_m and y_m reach only 0.00047, but",
        ),
        (lambda m: swapped(m, 5, "y_m", 47), "row 6 is 47, but the manipulator is 0.476 m long (1 of 84 readings are"),
        (
            lambda m: m.assign(angle_rad=m.angle_rad * 180 / np.pi),
            "column angle_rad: row 16 is 16.4529; degrees? write",
        ),
        (lambda m: m.assign(bend_rad=5.0), "column bend_rad: row 1 is 5; degrees? write radians"),
        (lambda m: swapped(m, 3, "disk", 15), "column disk: there is no disk 15 (row 4); disks are 0 (base) to 14"),
        (lambda m: swapped(m, 3, "disk", -1), "there is no disk -1 (row 4)"),
        (lambda m: m.assign(disk=m.disk + 0.5), "there is no disk 1.5 (rows 1-84)"),
        (lambda m: swapped(m, 3, "disk", None), "column disk: row 4: empty; every row needs its disk"),
        (lambda m: m.assign(bend_rad=0.1, disk=m.disk - 1), "no plate ends at the base disk 0; the first bend is that"),
        (lambda m: swapped(swapped(m, 3, "step", 7), 4, "step", 7), "rows 4-5: sequence a has no step 7 in the steps"),
        (
            lambda m: m.assign(sequence=m.sequence.replace("b", "B")),
            "rows 43-84: no sequence 'B' in the steps; did you",
        ),
        (lambda m: swapped(m, 8, "x_m", "blurred"), "markers.csv column x_m: row 9 holds 'blurred', not a number"),
        (lambda m: swapped(m, 8, "x_m", "0,47"), "row 9 holds '0,47', not a number; write a decimal point"),
        (lambda m: swapped(m, 8, "x_m", np.inf), "column x_m: row 9 is infinite"),
        (lambda m: m.rename(columns={"x_m": "x_mm"}), "column x_mm: unknown column: lengths are given in metres, as"),
        (lambda m: m.drop(columns="disk"), "bench/markers.csv: column 'disk' is missing"),
        (lambda m: m.drop(columns=READ), "records nothing: give at least one of the columns x_m, y_m, angle_rad"),
        (lambda m: m.assign(x_m=None, y_m=None, angle_rad=None), "holds no readings: every cell is empty"),
    ],
)
def test_what_is_wrong_with_markers_is_said(bench, change, said):
    bench.markers = change(bench.markers)
    problems = bench.refusal()
    assert any(said in problem for problem in problems), problems


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda s: s[:0], "bench/steps.csv: holds no steps"),
        (lambda s: swapped(s, 3, "cable_1_n", -9), "column cable_1_n: row 4 is -9: a cable cannot push"),
        (
            lambda s: s.rename(columns={"cable_1_n": "cable_left_n"}),
            "column cable_left_n: unknown column: there is no cable left; the manipulator has the cables 1, 2, 3, 4",
        ),
        (
            lambda s: s.rename(columns={"cable_1_n": "cable_1"}),
            "column cable_1: unknown column; did you mean 'cable_1_n'?",
        ),
        (
            lambda s: pd.concat([s, s[:2].assign(cable_1_n=11.0)]),
            "sequence a: step 1 stands in rows 1, 7, step 2 stands in rows 2, 8, with different loads; a sequence that",
        ),
    ],
)
def test_what_is_wrong_with_steps_is_said(bench, change, said):
    bench.steps = change(bench.steps)
    problems = bench.refusal()
    assert any(said in problem for problem in problems), problems


@pytest.mark.parametrize(("key", "read"), [("position_sd_m", "x_m and y_m"), ("angle_sd_rad", "angle_rad")])
def test_a_kind_of_reading_needs_its_deviation(bench, key, read):
    del bench.described["measurement"][key]
    assert bench.refusal() == [f"bench/recording.toml:4 measurement: {key!r} is missing, but the markers record {read}"]


def test_far_positions_are_fine_where_the_frame_is_unknown(bench):
    bench.described["measurement"]["frame_position_sd_m"] = 10.0
    bench.markers["x_m"] += 5.0
    assert bench.load().readings.count == bench.cells


def test_everything_wrong_comes_in_one_go(bench):
    bench.markers.loc[0, "disk"] = 20
    bench.markers = bench.markers.assign(y_m=1000 * bench.markers["y_m"]).astype({"x_m": object})
    bench.markers.loc[1, "x_m"] = "?"
    bench.steps.loc[2, "cable_1_n"] = np.nan
    bench.steps = bench.steps.rename(columns={"step": "stage"})
    bench.write()
    bench.edit("recording.toml", "tension_sd_relative", "tension_sd")
    bench.edit("manipulator.toml", "plates = 7", "plates = 7.5")
    line = 1 + (bench.folder / "manipulator.toml").read_text().split("plates = 7.5")[0].count("\n")
    problems = bench.refusal(written=False)
    for said in (
        "bench/recording.toml:7 measurement.tension_sd: unknown key 'tension_sd'; did you mean 'tension_sd_relative'?",
        f"bench/manipulator.toml:{line} segment.1.plates: must be a whole number",
        "bench/steps.csv: column 'step' is missing",
        "bench/steps.csv column cable_1_n: row 3: empty; write 0 for no load",
        "bench/markers.csv column x_m: row 2 holds '?', not a number",
    ):
        assert any(problem.startswith(said) for problem in problems), (said, problems)
    bench.edit("manipulator.toml", "plates = 7.5", "plates = 7")
    problems = bench.refusal(written=False)
    for said in (
        "bench/steps.csv column stage: unknown column",
        "bench/markers.csv column disk: there is no disk 20 (row 1); disks are 0 (base) to 14",
        "bench/markers.csv column y_m: row",
    ):
        assert any(problem.startswith(said) for problem in problems), (said, problems)


def test_files_that_are_not_there_or_twice(bench, tmp_path):
    with pytest.raises(RecordingError, match="no such file or folder"):
        load_recording(tmp_path / "nowhere")
    bench.write(".parquet")
    bench.steps.to_csv(bench.folder / "steps.csv", index=False)
    (bench.folder / "markers.parquet").unlink()
    (bench.folder / "manipulator.toml").rename(bench.folder / "manipulators.toml")
    assert bench.refusal(written=False) == [
        "bench/recording.toml:2 manipulator: there is no file 'bench/manipulator.toml'; "
        "did you mean 'manipulators.toml'?",
        "bench: both steps.csv and steps.parquet; keep one",
        "bench: no markers.csv or markers.parquet",
    ]


def test_a_table_that_is_kept_beside_the_steps_under_another_name_is_none_of_the_recording(bench):
    bench.write()
    (bench.folder / "steps.old.csv").write_text("sequence,step\na,1\n")
    assert load_recording(bench.folder).readings.count == bench.cells


def test_a_recording_file_that_names_its_manipulator_alone_is_still_a_recording(bench):
    bench.write()
    (bench.folder / "recording.toml").write_text('name = "bench"\nmanipulator = "manipulator.toml"\n')
    assert bench.refusal(written=False) == ["bench/recording.toml:1: 'measurement' is missing"]


def test_one_mistake_is_told_once(bench):
    """Decimal commas leave no lengths to be judged, a wrong unit in a name is no lack of readings."""
    clean = bench.markers
    commas = {name: clean[name].map(lambda cell: f"{cell:.4f}".replace(".", ",")) for name in READ}
    bench.markers = clean.assign(**commas)
    assert all("decimal point" in problem for problem in bench.refusal())
    bench.markers = clean.rename(columns={"x_m": "x_mm", "y_m": "y_mm"}).drop(columns="angle_rad")
    assert [problem.split(":")[0] for problem in bench.refusal()] == [
        f"bench/markers.csv column {name}" for name in ("x_mm", "y_mm")
    ]
