"""What `import prb3r` offers: names, examples that run, and anything reasonable where a manipulator is meant."""

import doctest
import inspect
import pickle
import subprocess
import sys
import tomllib
from pathlib import Path

import pandas as pd
import pytest
from matplotlib.figure import Figure

import prb3r

ROOT = Path(__file__).parents[1]
PROTOTYPE = ROOT / "studies/manipulators/two-segment.toml"
OBJECTS = "Cable Disk Manipulator Segment __version__ compare diagnose load_manipulator load_recording load_study"
DEEDS = "effects plot predict reach run_study sensitivities solve solve_in_blocks"
ERRORS = "EngineError Prb3rError RecordingError SpecError"
PROMISED = f"{OBJECTS} {DEEDS} {ERRORS}".split()
WITHOUT_EXAMPLES = {"__version__", *ERRORS.split()}
PULL = pd.DataFrame({"sequence": ["a"], "step": [1], "cable_1_n": [20.0]})


def test_completion_offers_what_is_promised_and_nothing_else():
    assert dir(prb3r) == sorted(PROMISED)
    assert all(getattr(prb3r, name) is not None for name in PROMISED)
    assert (Path(prb3r.__file__).parent / "py.typed").exists()


def test_nothing_heavy_is_loaded_before_it_is_needed():
    code = "import sys, prb3r; dir(prb3r); sys.exit(any(m in sys.modules for m in ('numba', 'pandas', 'matplotlib')))"
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT).returncode == 0


@pytest.mark.parametrize("name", [name for name in PROMISED if name != "__version__"])
def test_every_name_is_described_and_its_examples_hold(name, tmp_path, monkeypatch):
    offered = getattr(prb3r, name)
    assert inspect.getdoc(offered)
    (tmp_path / "studies").symlink_to(ROOT / "studies")
    monkeypatch.chdir(tmp_path)
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    finder = doctest.DocTestFinder(exclude_empty=True)
    examples = [test for test in finder.find(inspect.unwrap(offered), name, module=False, globs={}) if test.examples]
    said = []
    for test in examples:
        runner.run(test, out=said.append)
    assert not runner.failures, "".join(said)
    assert bool(examples) != (name in WITHOUT_EXAMPLES)


@pytest.fixture(scope="module")
def prototype():
    return prb3r.load_manipulator(PROTOTYPE)


def test_a_path_and_plain_data_stand_for_a_manipulator(prototype):
    expected = prb3r.solve(prototype, PULL)
    for given in (PROTOTYPE, str(PROTOTYPE), tomllib.loads(PROTOTYPE.read_text()), prototype.model_dump()):
        assert prb3r.solve(given, PULL).equals(expected)
    assert prb3r.solve(manipulator=PROTOTYPE, steps=PULL).equals(expected)


@pytest.mark.parametrize("given", [3, None, PULL, ["a"], {}, {"name": "x"}, "nowhere.toml", ROOT])
@pytest.mark.parametrize(
    "ask",
    [
        lambda given: prb3r.solve(given, PULL),
        lambda given: prb3r.sensitivities(given, PULL, ["cable_1_n"]),
        lambda given: prb3r.reach(given, x_m=0.4),
        lambda given: prb3r.plot(given),
    ],
    ids=["solve", "sensitivities", "reach", "plot"],
)
def test_what_is_no_manipulator_is_refused_in_words(ask, given):
    with pytest.raises(prb3r.SpecError) as caught:
        ask(given)
    assert str(caught.value)


def test_what_is_offered_can_be_sent_to_other_processes():
    for name in ("solve", "sensitivities", "reach", "plot", "run_study"):
        offered = getattr(prb3r, name)
        assert pickle.loads(pickle.dumps(offered)) is offered


def test_a_plot_shows_the_disks_where_they_are_on_given_axes(prototype):
    markers = prb3r.solve(prototype, PULL)
    axes = Figure().subplots()
    assert prb3r.plot(prototype, markers, axes=axes) is axes.figure
    tip = markers.iloc[-1]
    marks = [line.get_xydata()[0] for line in axes.lines if len(line.get_xydata()) == 1]
    assert any(mark == pytest.approx([1e3 * tip["x_m"], 1e3 * tip["y_m"]], abs=0.01) for mark in marks)
    below = prb3r.plot(prototype, markers)
    assert below.axes[0].get_legend() is None  # it would lie on the manipulator
    assert [text.get_text() for text in below.legends[0].get_texts()] == ["straight", "a"]
    with pytest.raises(prb3r.SpecError, match="no sequence ends"):
        prb3r.plot(prototype, markers.assign(x_m=float("nan")))
