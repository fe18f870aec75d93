"""Tables as anyone could have written them, as text, as Parquet and as bytes: a right one, or a refusal in a sentence.

Hypothesis makes them up and looks for the smallest that ends otherwise; `fuzz.outcome` tells how one ended: a
traceback, a warning and a hang are no answers.
"""

import shutil
from pathlib import Path

import fuzz
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from prb3r.check import check_file as check_of
from prb3r.model.manipulator import load_manipulator

hypothesis = pytest.importorskip("hypothesis", reason="fuzzing needs the extra 'dev'")
st = pytest.importorskip("hypothesis.strategies")

STUDIES = Path(__file__).parents[1] / "studies"
RECORDING = STUDIES / "recordings/bench-example"
PROTOTYPE = STUDIES / "manipulators/two-segment.toml"
KNOWN = ["sequence", "step", "cable_1_n", "cable_2_kg", "slip_1", "tip_x_n", "disk14_y_n", "disk", "x_m", "angle_rad"]
NAMES = st.sampled_from([*KNOWN, "cable_1_kg", "cable_9_n", "disk99_x_n", "slip_x", "case_id", "", " step", "a\nb"])
ODD = ["", "1", "-1", "0.5", "nan", "inf", "-inf", "1e308", "9" * 400, "1e-320", "a", "'a", "=1+1", '"', "1,2", "\0"]
CELLS = st.one_of(st.sampled_from([*ODD, "\ufeff", " 3 ", "1_0", "true", "1979-05-27"]), st.text(max_size=8))
SETTINGS = hypothesis.settings(
    max_examples=120, deadline=None, derandomize=True, suppress_health_check=list(hypothesis.HealthCheck)
)
"""The same tables in every run."""
ANSWERS = ("right", "refused")


def rows(cells):
    """Names of columns and rows of cells, most tables with the columns that they must have."""
    names = st.lists(NAMES, max_size=5).map(lambda more: ["sequence", "step", *more])
    return st.one_of(names, st.lists(NAMES, max_size=5)).flatmap(
        lambda head: st.tuples(st.just(head), st.lists(st.lists(cells, max_size=len(head) + 1), max_size=5))
    )


def arrays(count):
    """Columns of any type, of so many cells."""
    kinds = st.one_of(
        st.lists(st.one_of(st.none(), st.integers(-(2**63), 2**63 - 1)), min_size=count, max_size=count),
        st.lists(st.one_of(st.none(), st.floats()), min_size=count, max_size=count),
        st.lists(st.one_of(st.none(), CELLS), min_size=count, max_size=count),
        st.lists(st.lists(st.integers(0, 3), max_size=2), min_size=count, max_size=count),
        st.lists(st.booleans(), min_size=count, max_size=count),
        st.lists(st.binary(max_size=4), min_size=count, max_size=count),
        st.lists(st.datetimes(), min_size=count, max_size=count),
        st.lists(st.decimals(-9, 9, places=2), min_size=count, max_size=count),
        st.lists(st.fixed_dictionaries({"a": st.integers(0, 9)}), min_size=count, max_size=count),
    )
    return kinds.map(pa.array).flatmap(
        lambda array: st.sampled_from([array, array.dictionary_encode() if pa.types.is_string(array.type) else array])
    )


@st.composite
def parquet(draw):
    """The bytes of a Parquet file, whole, cut off, or with a byte changed."""
    count = draw(st.integers(0, 4))
    names = draw(st.lists(NAMES, max_size=5, unique=True))
    names = [*dict.fromkeys(["sequence", "step", *names])] if draw(st.booleans()) else names
    table = pa.table([draw(arrays(count)) for _ in names], names=names)
    if draw(st.booleans()):
        table = table.replace_schema_metadata(
            {b"pandas": draw(st.sampled_from([b"{", b"[]", b'{"index_columns": 1}']))}
        )
    sink = pa.BufferOutputStream()
    pq.write_table(table, sink)
    content = bytearray(sink.getvalue().to_pybytes())
    if draw(st.booleans()):
        place = draw(st.integers(0, len(content) - 1))
        content = content[:place] if draw(st.booleans()) else content
        if place < len(content):
            content[place] ^= draw(st.integers(1, 255))
    return bytes(content)


def text(table):
    head, body = table
    return "\n".join(",".join(line) for line in (head, *body)).encode("utf-8", "surrogatepass")


@pytest.fixture(scope="module")
def steps(tmp_path_factory):
    """How checking the bytes of a table of steps ends, with the prototype; nothing else may be written."""
    folder, manipulator = tmp_path_factory.mktemp("tables"), load_manipulator(PROTOTYPE)

    def ended(name, content, patch):
        path = folder / name
        path.write_bytes(content)
        patch.setattr(fuzz, "check_file", lambda path, _: check_of(path, manipulator))
        found = fuzz.outcome(path)
        path.unlink()
        return found if not list(folder.iterdir()) else "has written files"

    return ended


@SETTINGS
@hypothesis.given(st.one_of(rows(CELLS).map(text), st.binary(max_size=60)))
def test_any_csv_of_steps_is_right_or_refused(steps, content):
    with pytest.MonkeyPatch.context() as patch:
        assert steps("steps.csv", content, patch) in ANSWERS


@SETTINGS
@hypothesis.given(parquet())
def test_any_parquet_of_steps_is_right_or_refused(steps, content):
    with pytest.MonkeyPatch.context() as patch:
        assert steps("steps.parquet", content, patch) in ANSWERS


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """How checking a recording ends of which one file is replaced."""
    folder = tmp_path_factory.mktemp("recordings") / "example"
    shutil.copytree(RECORDING, folder)
    kept = {path: path.read_bytes() for path in sorted(folder.iterdir())}

    def ended(name, content):
        (folder / name).write_bytes(content)
        found = fuzz.outcome(folder)
        written = sorted(folder.iterdir())
        (folder / name).write_bytes(kept[folder / name])
        return found if written == sorted(kept) else "has written files"

    return ended, {path.name: content for path, content in kept.items()}


@pytest.mark.long
@SETTINGS
@hypothesis.given(st.data())
def test_any_table_of_a_recording_is_right_or_refused(recording, data):
    """Whole tables that are made up, and cells of the right one exchanged."""
    ended, kept = recording
    name = data.draw(st.sampled_from([name for name in kept if name.endswith(".csv")]))
    lines = [line.split(",") for line in kept[name].decode().splitlines()]
    for _ in range(data.draw(st.integers(1, 3))):
        line = lines[data.draw(st.integers(0, len(lines) - 1))]
        line[data.draw(st.integers(0, len(line) - 1))] = data.draw(st.one_of(CELLS, NAMES))
    made_up = data.draw(st.booleans())
    content = (
        data.draw(rows(CELLS).map(text)) if made_up else "\n".join(map(",".join, lines)).encode("utf-8", "replace")
    )
    assert ended(name, content) in ANSWERS


def test_tables_are_found_right_too(steps, recording):
    """What is made up is not all refused, or nothing behind the first look would be tried."""
    with pytest.MonkeyPatch.context() as patch:
        assert steps("steps.csv", b"sequence,step,cable_1_n\na,1,5\n", patch) == "right"
    ended, kept = recording
    assert ended("recording.toml", kept["recording.toml"]) == "right"
