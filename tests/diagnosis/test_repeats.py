"""Sequences that were pulled again tell how much readings scatter."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from diagnosis.simulated import Case, pulled_again, recorded, write_recording

from prb3r import solve
from prb3r.diagnosis.checks.repeats import Scatter, repeats_contradict, scatter
from prb3r.diagnosis.checks.setup.order import order_blunders
from prb3r.diagnosis.evidence.repeated_loads import matches
from prb3r.diagnosis.fit.calibrate import fit_constants
from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.investigate import investigate, run_stages
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.result.mismatch import mismatch_of
from prb3r.diagnosis.result.rig_remarks import scattered
from prb3r.diagnosis.settings import Settings
from prb3r.mechanics.chain import Loads
from prb3r.model.effects.plates import NonlinearPlate
from prb3r.recording.reading import load_recording
from prb3r.recording.recording import Kind


@pytest.mark.parametrize("factor", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("other", [1.0, 0.98])
def test_the_scatter_of_what_was_pulled_again_is_found_at_equal_and_at_other_loads(factor, other):
    found = scatter(pulled_again(factor, other=other), Settings())
    assert found.factor == pytest.approx(factor, rel=0.08)
    assert found.beyond_chance == (factor > 1)


def test_steps_that_constants_alone_do_not_reach_tell_no_scatter(monkeypatch):
    """Where no constants balance every step, some readings are not predicted."""
    many = pulled_again(2.0)

    def losing(*given, **settings):
        found = fit_constants(*given, **settings)
        lost = many.readings.step % 5 == 4
        return replace(found, solved=replace(found.solved, readings=np.where(lost, np.nan, found.solved.readings)))

    monkeypatch.setattr("prb3r.diagnosis.checks.repeats.fit_constants", losing)
    assert scatter(many, Settings()).factor == pytest.approx(2.0, rel=0.15)


@pytest.fixture(scope="module")
def pulled_in_other_steps(tmp_path_factory):
    """Four pulls of one cable in steps of 4, 3, 5 and 3.5 N, read with a noise of 0.3 mm."""
    folder, rng = tmp_path_factory.mktemp("steps"), np.random.default_rng(5)
    write_recording(folder)
    pulls = {f"pull{k}": np.arange(1, int(36 / step)) * step for k, step in enumerate((4.0, 3.0, 5.0, 3.5))}
    rows = [
        {"sequence": name, "step": k, "cable_1_n": pull}
        for name, steps in pulls.items()
        for k, pull in enumerate(steps, 1)
    ]
    steps = pd.DataFrame(rows).assign(slip_1=-1)
    states = solve(folder / "manipulator.toml", steps)
    markers = states.loc[states["disk"] > 0, ["sequence", "step", "disk", "x_m", "y_m"]]
    markers[["x_m", "y_m"]] += 3e-4 * rng.standard_normal((len(markers), 2))
    steps.to_csv(folder / "steps.csv", index=False)
    markers.to_csv(folder / "markers.csv", index=False)
    return load_recording(folder)


def test_pictures_at_another_step_repeat_less_well(pulled_in_other_steps):
    """Readings under equal loads are of one arm, whatever bends it; one step later they are not."""
    settings, right = Settings(), pulled_in_other_steps
    later = next(r for r in order_blunders(right) if "every sequence belong to the step after" in r.blunder)
    shifted = later.mend(right).recording
    pair = [(each, fit_constants(predictor(each, settings), settings=settings).constants) for each in (shifted, right)]
    assert repeats_contradict(*pair, settings)  # mended where there is nothing to mend
    assert not repeats_contradict(*pair[::-1], settings)  # a shift that was made, and is mended
    assert not repeats_contradict(pair[1], pair[1], settings)


def test_other_paths_are_no_repetition():
    assert not list(matches(recorded(Case(hidden=())), Settings()))
    assert scatter(recorded(Case(hidden=())), Settings()) is None
    assert not list(matches(pulled_again(1.0, times=2, other=0.8), Settings()))


def test_every_step_of_a_repetition_matches_its_own():
    many = pulled_again(1.0, times=2)
    count = many.loads.steps // 2
    assert [(each.step, each.before, each.after) for _, each in matches(many, Settings())] == [
        (k, k + count, k + count) for k in range(count)
    ]


@pytest.mark.long
def test_a_camera_that_moved_between_repetitions_is_no_noise():
    many = pulled_again(1.0, times=2)
    later = many.of_sequence >= len(many.sequences) // 2
    shifted = later[many.readings.step] & (many.readings.kind == Kind.Y)
    moved = many.with_values(many.readings.value + 0.002 * shifted)
    assert not scatter(moved, Settings()).beyond_chance
    assert scatter(moved, Settings()).factor == pytest.approx(1, rel=0.1)
    found = run_stages(Task(moved))
    assert found.verdict == "unexplained"
    assert "frame" in found.mismatch.depends_on


@pytest.mark.long
def test_readings_that_scatter_more_than_stated_are_no_effect():
    found = investigate(Task(pulled_again(2.0)))
    assert found.verdict == "adequate"
    assert found.before.largest > found.before.threshold  # under the stated noise there seemed to be something
    nothing = mismatch_of(found)
    assert nothing.statement == "Nothing is left that chance does not explain."
    assert (nothing.plates, nothing.sequences, nothing.depends_on) == ((), (), ())
    assert found.choice.level.level.scale == pytest.approx(2, rel=0.1)
    assert any("pulled again" in remark and "more than chance allows" in remark for remark in found.remarks)
    assert any("times the stated one" in remark for remark in found.remarks)


def test_a_model_that_is_far_off_is_no_noise_where_loads_lie_far_apart():
    """Cable 1 pulled and let go, read at every 15 N and at every 75 N; plates stiffen as no constant can imitate."""
    plain = recorded(Case(hidden=()))
    pulls = [10, 25, 40, 55, 70, 85, 70, 55], [10, 85, 20], [17, 32, 47, 62, 77, 85, 70, 55], [10, 85, 30]
    own = np.repeat(np.arange(4), [len(each) for each in pulls])
    tension = np.outer(np.concatenate(pulls), [1.0, 0, 0, 0])
    falling = np.concatenate([np.diff(each, prepend=0) < 0 for each in pulls])
    nothing = Loads(*(np.zeros((len(own), *field.shape[1:])) for field in plain.loads))
    loads = nothing._replace(tension=tension, slip=np.where(falling, 1.0, -1.0)[:, None] * np.ones(4))
    numbers = np.concatenate([1 + np.arange(len(each)) for each in pulls])
    steps = pd.DataFrame({"sequence": own.astype(str), "step": numbers})
    disks = plain.manipulator.plates
    places = np.repeat(np.arange(len(own)), disks), np.tile(1 + np.arange(disks), len(own))
    readings = type(plain.readings)(*places, np.full(len(own) * disks, Kind.ANGLE), np.zeros(len(own) * disks))
    many = replace(plain, sequences=tuple("0123"), of_sequence=own, loads=loads, steps=steps, readings=readings)
    stiffening = NonlinearPlate(kind="nonlinear_plate", law="cubic", cubic_m2=0.05)
    found = scatter(many.with_values(predictor(many)(Constants(), [stiffening])), Settings())
    assert not found.beyond_chance
    assert found.steps >= Settings().fewest_repeats


@pytest.mark.parametrize(
    ("factor", "beyond", "said"),
    [
        (0.45, False, "so that no less noise is stated than there is"),
        (1.1, False, "which chance alone can do"),
        (1.4, True, "more than chance allows"),
    ],
)
def test_how_much_repeats_scatter_is_said_with_what_it_means(factor, beyond, said):
    (remark,) = scattered(Scatter(factor, 44, beyond))
    assert remark == f"what was pulled again (44 steps) scatters {factor} times as much as stated, {said}"
