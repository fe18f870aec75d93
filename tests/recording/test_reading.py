"""Recordings as benches give them: what is wrong is said at once, what is odd is used, counted and told."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from prb3r.errors import RecordingError
from prb3r.recording.reading import load_recording
from prb3r.recording.recording import Kind, RecordingFile
from prb3r.recording.writing import write_recording

ROOT = Path(__file__).parents[2]
MANIPULATOR = (ROOT / "studies/manipulators/two-segment.toml").read_text()
READ = ["x_m", "y_m", "angle_rad"]
MEASUREMENT = {"position_sd_m": 3e-4, "angle_sd_rad": 0.005, "tension_sd_relative": 0.003}


class Bench:
    """A folder whose files can be made dirty; clean, it holds 2 sequences of 3 steps and 6 x 14 x 3 readings."""

    def __init__(self, folder):
        self.folder, self.manipulator = folder / "bench", MANIPULATOR
        self.described = {"name": "bench", "manipulator": "manipulator.toml", "measurement": dict(MEASUREMENT)}
        rng, disk = np.random.default_rng(1), np.arange(1, 15)
        self.steps = pd.DataFrame(
            {"sequence": np.repeat(["a", "b"], 3), "step": [1, 2, 3] * 2, "cable_1_n": [10.0, 20, 30, 5, 15, 25]}
        )
        self.markers = pd.DataFrame(
            {
                "sequence": np.repeat(self.steps["sequence"].to_numpy(), 14),
                "step": np.repeat(self.steps["step"].to_numpy(), 14),
                "disk": np.tile(disk, 6),
                "x_m": np.tile(0.034 * disk - 0.002, 6) + 1e-3 * rng.normal(size=84),
                "y_m": 1e-2 * rng.normal(size=84),
                "angle_rad": 0.1 * rng.normal(size=84),
            }
        )

    def write(self, suffix=".csv"):
        described = RecordingFile.model_validate(self.described)
        write_recording(self.folder, described, self.manipulator, self.steps, self.markers, suffix)
        return self.folder

    def load(self, suffix=".csv"):
        return load_recording(self.write(suffix))

    def refusal(self, written=True):
        with pytest.raises(RecordingError) as caught:
            load_recording(self.write() if written else self.folder)
        return [str(problem).replace(f"{self.folder}", "bench") for problem in caught.value.problems]

    def edit(self, file, old, new):
        path = self.folder / file
        assert old in path.read_text()
        path.write_text(path.read_text().replace(old, new, 1))

    @property
    def cells(self):
        return int(self.markers[[kind.column for kind in Kind if kind.column in self.markers]].count().sum())


@pytest.fixture
def bench(tmp_path):
    return Bench(tmp_path)


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_clean_recording_has_every_reading_and_no_remark(bench, suffix):
    recording = bench.load(suffix)
    assert recording.remarks == ()
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
        ("angle_sd_rad", 0.5, "angle_sd_rad = 0.5 is 29 degrees; in radians?"),
        ("tension_sd_relative", 0.3, "tension_sd_relative = 0.3 is 30%; not in percent?"),
    ],
)
def test_deviations_of_another_unit_are_doubted(bench, key, value, said):
    bench.described["measurement"][key] = value
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


# wrong, and said


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
        "bench/manipulator.toml: no such file; did you mean 'manipulators.toml'?",
        "bench: both steps.csv and steps.parquet; keep one",
        "bench: no markers.csv or markers.parquet",
    ]


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
