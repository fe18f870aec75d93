"""Explanations that cannot be told apart: what is said of them, and which experiment would."""

import json
from dataclasses import replace

import pandas as pd
import pytest
from diagnosis.simulated import (
    WEAK,
    investigated,
    rival_of,
)

from prb3r import load_manipulator, solve
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.result.effects import Separation
from prb3r.diagnosis.result.files import write_record
from prb3r.diagnosis.result.named import separations
from prb3r.diagnosis.result.projection import summary_lines
from prb3r.diagnosis.result.proposals import proposed
from prb3r.diagnosis.result.surviving import posterior_of
from prb3r.diagnosis.result.tell import tell
from prb3r.diagnosis.search.experiment import Experiment, best_experiments, programs, separation
from prb3r.diagnosis.search.rivals import Rival
from prb3r.diagnosis.settings import Settings


def disputed():
    """The diagnosis as if a rival could not be told from what it names."""
    found = investigated()
    other = rival_of(found)
    rival = Rival(other.model.hypotheses[0], other, 3.0, 1.0)
    named = replace(found.named[0], rivals=(rival,))
    experiment = best_experiments(found.explained, [other])[0]
    pair = Separation(named.hypothesis.name, rival.hypothesis.name, experiment)
    return tell(replace(found, verdict="ambiguous", named=(named,), experiments=(pair,)))


def test_the_model_that_is_named_is_marked_though_it_was_fitted_again():
    found = investigated()
    choice = replace(found.choice, fitted=fit(found.choice.fitted.model, found.choice.fitted.p))
    marked = [model.named for model in posterior_of(replace(found, choice=choice)).models]
    assert marked == [survivor.effects == choice.effects for survivor in choice.survivors]
    assert sum(marked) == 1
    assert choice.refuted_by(lambda fitted: fitted is not choice.fitted) == tuple(
        survivor for survivor in choice.survivors if survivor.effects != choice.effects
    )


def test_a_dispute_names_the_rival_and_proposes_steps_that_run(tmp_path):
    found = disputed()
    (tmp_path / "next_experiment_2.csv").write_text("of an earlier diagnosis\n")
    write_record(found, tmp_path)
    record = json.loads((tmp_path / "diagnosis.json").read_text())
    assert record["effects"][0]["indistinguishable_from"] == [found.experiments[0].second]
    (rival,) = record["effects"][0]["rivals"]
    assert rival["name"] == found.experiments[0].second
    factor = 3 / (2 + 1 / WEAK["factor"])  # of three plates with the compliance of these two and the weak one
    assert rival["parameters"] == {"factor": pytest.approx(factor, abs=0.06)}
    (proposed,) = record["next_experiment"]
    assert list(proposed) == ["statement", "separates", "separation", "steps"]
    assert proposed["separates"] == [list(found.experiments[0][:2])]
    assert not (tmp_path / "next_experiment_2.csv").exists()
    steps = pd.read_csv(tmp_path / "next_experiment.csv")
    assert len(steps) == len(proposed["steps"])
    states = solve(load_manipulator(tmp_path / "explained.toml"), tmp_path / "next_experiment.csv")
    assert (states["outcome"] == "converged").all()
    assert "cannot be told apart" in "\n".join(summary_lines(found))


def test_a_set_of_effects_that_stands_in_the_place_of_what_is_named_is_said_and_has_a_program():
    found, other = investigated(), rival_of(investigated())
    survivor = replace(found.choice.survivors[0], fitted=other, probability=0.4)
    choice = replace(found.choice, survivors=(*found.choice.survivors, survivor))
    (apart,) = separations(choice, found.named)
    assert (apart.first, apart.second) == ("weakened_plate (plate 4)", "segment_stiffness (segment 2)")
    best = best_experiments(found.explained, [other])[0]
    assert (apart.experiment.title, apart.experiment.separation) == (best.title, best.separation)
    rival = Rival(other.model.hypotheses[0], other, 3.0, 1.0)
    (once,) = separations(choice, [replace(found.named[0], rivals=(rival,))])  # as a rival, and not as a set again
    assert (once.first, once.second) == (apart.first, apart.second)
    none = replace(survivor, fitted=choice.calibrated)
    (alone,) = separations(replace(choice, survivors=(*found.choice.survivors, none)), found.named)
    assert alone.second == "constants alone"
    lines = summary_lines(tell(replace(found, verdict="ambiguous", choice=choice, experiments=(apart,))))
    assert "- or segment stiffness instead of weakened plate, 40 %" in lines


def test_proposed_readings_are_as_noisy_as_those_that_were_recorded():
    """Twice the noise leaves at least a quarter of the squared distance, and less than all of it."""
    fitted = investigated().explained
    other = rival_of(investigated())
    (_, steps), *_ = programs(fitted.model.predict.recording, Settings())
    noise = fitted.model.noise
    loud = replace(noise, level=noise.level._replace(scale=2 * noise.level.scale, tension=2 * noise.level.tension))
    apart = separation(fitted, other, steps)
    louder = separation(replace(fitted, model=replace(fitted.model, noise=loud)), other, steps)
    assert apart / 4 <= louder < 0.98 * apart


def test_a_program_that_separates_two_pairs_is_proposed_once(tmp_path):
    found = disputed()
    a, b, experiment = found.experiments[0]
    other = Experiment("read the shape without any load", experiment.steps[:1], 30.0, experiment.asked)
    weaker = replace(experiment, separation=experiment.separation / 2)
    pairs = Separation(a, b, experiment), Separation(a, "gravity", weaker), Separation(a, "precurvature", other)
    found = replace(found, experiments=pairs)
    first, second = proposed(found.experiments)
    assert first.separates == ((a, b), (a, "gravity"))
    assert first.separation == weaker.separation
    assert "enough to rank them rightly" in second.statement
    asked = experiment.asked
    few = proposed([Separation(a, b, replace(experiment, separation=asked / 3))])[0].statement
    assert few.startswith("No load program that was tried tells")
    write_record(found, tmp_path)
    assert {path.name for path in tmp_path.glob("*.csv")} == {"next_experiment_1.csv", "next_experiment_2.csv"}
