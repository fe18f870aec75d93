"""What a diagnosis answers in a few lines: how sure every effect is, what could stand in its place, what to do."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from diagnosis.simulated import UNEXPLAINED, Case, diagnosed, investigated, rival_of

from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.result.answer import by_sureness, exchanges, predicted_worse, sureness, what_to_do
from prb3r.diagnosis.result.effects import Separation
from prb3r.diagnosis.result.files import write_record
from prb3r.diagnosis.result.named import surviving
from prb3r.diagnosis.result.projection import summary_lines
from prb3r.diagnosis.result.proposals import proposed
from prb3r.diagnosis.result.tell import tell
from prb3r.diagnosis.search.experiment import best_experiments
from prb3r.diagnosis.search.rivals import Rival
from prb3r.diagnosis.settings import Settings
from prb3r.present.diagnosis.sentences import confirmation, nothing_named, nothing_to_measure, verdict_sentences

KINDS = "gravity", "pulley_friction", "weakened_plate", "precurvature", "tension_offset"


def survived(rng):
    """A diagnosis of sets of kinds with probabilities drawn at random, as far as its answer needs it, and these."""
    sets = {frozenset(rng.choice(KINDS, rng.integers(1, 5), replace=False).tolist()) for _ in range(6)}
    shares = rng.dirichlet(np.ones(len(sets)))
    ranked = sorted(zip(shares.tolist(), sets, strict=True), key=lambda pair: -pair[0])
    (_, named), *others = ranked
    presence = {kind: sum(share for share, kinds in ranked if kind in kinds) for kind in named}
    effects = [
        SimpleNamespace(kind=kind, partial=False, probability=p, in_doubt=False, certain=p >= Settings().certain)
        for kind, p in presence.items()
    ]
    models = [
        SimpleNamespace(probability=share, effects=[SimpleNamespace(kind=kind) for kind in kinds])
        for share, kinds in ranked
    ]
    lacking = tuple(tuple(sorted(kinds)) for _, kinds in others if not kinds >= named)
    stand = SimpleNamespace(models=models)
    found = SimpleNamespace(why="", effects=tuple(effects), posterior=stand, alternatives=lacking)
    return found, {kinds: share for share, kinds in ranked}


@pytest.mark.parametrize("seed", range(20))
def test_an_exchange_made_in_the_named_set_gives_the_other_set_and_both_are_told_by_their_shares(seed):
    found, probability = survived(np.random.default_rng(seed))
    named = {effect.kind for effect in found.effects}
    for kinds, other in zip(found.alternatives, exchanges(found), strict=True):
        assert (named - set(other.instead_of)) | set(other.other) == set(kinds)
        assert other.probability == probability[frozenset(kinds)]
        assert other.instead_of
        assert all(kind.replace("_", " ") in other.text for kind in (*other.other, *other.instead_of))
    lacked = {effect.kind: 1 - effect.probability for effect in found.effects}
    for kind, share in lacked.items():
        assert sum(o.probability for o in exchanges(found) if kind in o.instead_of) == pytest.approx(share)
    said = [effect.probability for effect in by_sureness(found)]
    assert said == sorted(said, reverse=True)
    assert all((sureness(effect) == "certain") == (lacked[effect.kind] <= 0.05) for effect in found.effects)


@pytest.mark.parametrize("seed", range(5))
def test_what_is_likely_but_not_named_is_what_to_look_for_where_all_that_is_named_is_certain(seed):
    found, probability = survived(np.random.default_rng(seed))
    named = {effect.kind for effect in found.effects}
    unnamed = {kind: sum(p for kinds, p in probability.items() if kind in kinds) for kind in set(KINDS) - named}
    likely = sorted((kind for kind, p in unnamed.items() if p > 0.5), key=lambda kind: -unnamed[kind])
    sure = tuple(SimpleNamespace(kind=kind, in_doubt=False, certain=True, rivals=()) for kind in named)
    around = {"verdict": "ambiguous", "setup": (), "rival_blunder": None, "experiments": (), "heldout": None}
    around |= {"settings": {}}
    said = what_to_do(SimpleNamespace(**vars(found) | {"effects": sure} | around))
    assert said.startswith("Look at the rig itself for " if likely else "Look first at what the notes doubt")
    assert [kind for kind in KINDS if kind.replace("_", " ") in said] == [kind for kind in KINDS if kind in likely]
    none = {"effects": (), "verdict": "adequate"}
    said = what_to_do(SimpleNamespace(**vars(found) | around | none))
    kinds = [kind for kind in KINDS if sum(p for those, p in probability.items() if kind in those) > 0.5]
    assert [kind for kind in KINDS if kind.replace("_", " ") in said] == kinds
    assert ("no effect needs to be added" in said) == (not kinds)


@pytest.mark.parametrize(("share", "kinds"), [(0.09, []), (0.2, ["worn hole"])])
def test_where_nothing_is_named_what_is_not_ruled_out_is_said_in_the_advice_and_on_the_page(share, kinds):
    models = [
        SimpleNamespace(probability=1 - share, effects=()),
        SimpleNamespace(probability=share, effects=(SimpleNamespace(kind="worn_hole"),)),
    ]
    told = {"verdict": "adequate", "setup": (), "rival_blunder": None, "why": "", "effects": (), "heldout": None}
    told |= {"settings": {}, "share_of_stated": 1.0, "posterior": SimpleNamespace(models=models)}
    found = SimpleNamespace(**told)
    assert "no effect needs to be added" in what_to_do(found)
    for said in (what_to_do(found), nothing_named(found), nothing_to_measure(found)):
        assert ("worn hole is not ruled out" in said.lower()) == bool(kinds)
    assert ("Nothing is missing" in nothing_named(found)) != bool(kinds)


def disputed():
    """A weak plate that could as well be a weak segment, with a probability of 0.4, and the program that tells them."""
    found, other = investigated(), rival_of(investigated())
    survivor = replace(found.choice.survivors[0], fitted=other, probability=0.4)
    first = replace(found.choice.survivors[0], probability=0.6)
    choice = replace(found.choice, survivors=(first, survivor))
    rival = Rival(other.model.hypotheses[0], other, 3.0, 1.0)
    pair = Separation(
        found.named[0].hypothesis.name, rival.hypothesis.name, best_experiments(found.explained, [other])[0]
    )
    named = (replace(found.named[0], rivals=(rival,)),)
    return tell(replace(found, verdict="ambiguous", choice=choice, named=named, experiments=(pair,)))


@pytest.mark.long
def test_the_closing_lines_tell_how_sure_what_is_named_is_and_what_could_stand_for_it():
    lines = summary_lines(disputed())
    assert any(line.startswith("- 60 %: ") for line in lines)
    assert "- or segment stiffness instead of weakened plate, 40 %" in lines
    assert not any(": certain" in line or line.startswith("- certain") for line in lines)
    plain = summary_lines(diagnosed())
    assert not any("instead of" in line for line in plain)


@pytest.mark.long
def test_effects_that_predict_what_no_fit_has_seen_worse_than_constants_are_not_recommended():
    found = diagnosed()
    assert "takes what was learnt to other designs" in what_to_do(found)
    errors = {"rmse_calibrated_m": 1e-3, "rmse_explained_m": 1.3e-3, "rmse_made_m": None, "noise_m": 1e-3}
    errors |= {"rmse_calibrated_rad": None, "rmse_explained_rad": None, "rmse_made_rad": None}
    worse = replace(found.heldout, **errors)
    said = what_to_do(replace(found, heldout=worse))
    (name,) = worse.sequences
    assert f"predicts {name}, which no fit has seen, to 1.3 mm where constants alone do to 1:" in said
    assert "take nothing of it to other designs" in said
    fine = {"rmse_explained_m": 1.1e-3}, {"noise_m": 1.2e-3}, {"rmse_made_m": 1e-3}  # parts of this rig make it up
    for other in (replace(worse, **change) for change in fine):
        assert "takes what was learnt to other designs" in what_to_do(replace(found, heldout=other))


@pytest.mark.long
def test_positions_and_angles_judge_together_each_in_its_noise():
    """Of twelve readings with errors of twice the noise eight fall to one and a half and four rise to 2.4: together
    they fall, whichever kind is the one that grows; if both grow both are told."""
    found = diagnosed()
    of_angles = {"rmse_calibrated_rad": 0.02, "rmse_explained_rad": 0.024, "rmse_made_rad": None, "noise_rad": 0.01}
    of_positions = {"rmse_calibrated_m": 2e-3, "rmse_explained_m": 1.5e-3, "rmse_made_m": None, "noise_m": 1e-3}
    held = replace(found.heldout, readings=12, positions=8, **of_angles, **of_positions)
    assert held.in_noise == pytest.approx((2.0, np.sqrt((8 * 1.5**2 + 4 * 2.4**2) / 12), held.in_noise.explained))
    assert not predicted_worse(replace(found, heldout=held))
    far = replace(held, rmse_explained_rad=0.05)  # sqrt((8 * 1.5^2 + 4 * 5^2) / 12) = 3.14
    assert predicted_worse(replace(found, heldout=far)).endswith("to 2.86 degrees where constants alone do to 1.15")
    both = replace(held, rmse_explained_m=2.6e-3)
    said = predicted_worse(replace(found, heldout=both))
    assert "to 2.6 mm where constants alone do to 2 and to 1.38 degrees where" in said


@pytest.mark.parametrize("worse", [False, True])
def test_a_sequence_in_which_nothing_of_what_is_named_acts_does_not_judge_it(worse):
    found = diagnosed()
    errors = {"rmse_calibrated_m": 1e-3, "rmse_explained_m": 0.05, "rmse_made_m": None, "noise_m": 1e-3}
    held = replace(found.heldout, felt=False, **(errors if worse else {}))
    said = what_to_do(replace(found, heldout=held))
    assert "explained.toml" in said
    assert "takes what was learnt to other designs" in said
    assert "take nothing of it" not in said
    (name,) = held.sequences
    assert f"Nothing of what is named acts in {name}, which no fit has seen and so cannot judge it" in said
    assert ("only the constants refitted beside it" in said) == worse
    assert "cannot judge" not in what_to_do(found)
    assert "it judges only the constants" in confirmation(replace(found, heldout=held))
    assert "it judges only the constants" not in confirmation(found)


def test_what_is_named_acts_where_it_moves_readings_beyond_their_noise():
    """A weak plate moves what is pulled.  An arm that nothing loads stands as it does without it."""
    found = investigated()
    assert found.heldout.felt
    recording = found.fresh.recording
    idle = recording.loads._replace(tension=np.zeros_like(recording.loads.tension))
    fresh = replace(found.fresh, predict=predictor(replace(recording, loads=idle)), predictions={})
    assert not fresh.feels(found.explained)
    slight = recording.loads._replace(tension=1e-3 * recording.loads.tension)
    fresh = replace(found.fresh, predict=predictor(replace(recording, loads=slight)), predictions={})
    assert not fresh.feels(found.explained)


def test_what_to_do_names_files_that_are_there_and_only_programs_that_tell(tmp_path):
    found = disputed()
    (pair,) = found.experiments
    assert pair.experiment.resolves
    write_record(found, tmp_path)
    said = what_to_do(found)
    assert all((tmp_path / word.strip(".,;")).exists() for word in said.split() if ".csv" in word or ".toml" in word)
    assert "next_experiment.csv" in said
    vain = replace(pair.experiment, separation=pair.experiment.asked / 2)
    said = what_to_do(replace(found, experiments=(pair._replace(experiment=vain),)))
    assert "next_experiment" not in said
    assert said.startswith(
        "Look at the rig itself for weakened plate: no load program that was tried tells weakened plate from "
        "segment stiffness."
    )
    several = Separation("a", "b", replace(vain, title="another")), pair
    assert "next_experiment_2.csv" in what_to_do(replace(found, experiments=several))
    for verdict, file in (("explained", "explained.toml"), ("adequate", "calibrated.toml")):
        said = what_to_do(diagnosed(Case() if verdict == "explained" else Case(hidden=())))
        assert file in said
        assert (tmp_path / file).exists()


@pytest.mark.long
def test_nobody_is_told_to_use_what_is_unexplained():
    found = diagnosed(UNEXPLAINED)
    assert found.verdict == "unexplained"
    for structured in (True, False):
        said = what_to_do(replace(found, structured=structured))
        assert "no name and no number" in said
        assert ".toml" not in said
    lone = replace(found.mismatch, sequences=("down",), depends_on=("sequence",))
    for mismatch in (lone, replace(lone, sequences=("down", "in")), replace(lone, depends_on=("step",))):
        assert ("Leave out sequence down" in what_to_do(replace(found, mismatch=mismatch))) == (mismatch is lone)
    lines = summary_lines(found)
    reason = next(k for k, line in enumerate(lines) if line.startswith("- unexplained, since"))
    assert all(reason < k for k, line in enumerate(lines) if line.startswith("- in part"))


@pytest.mark.long
def test_the_misfit_of_what_is_named_is_the_same_number_wherever_it_stands():
    """Also where survivors are those of a coarser likelihood, as nothing explains the recording."""
    for case in (Case(), UNEXPLAINED):
        found = diagnosed(case)
        named = {effect.name for effect in found.effects}
        told = [model.reduced_chi2 for model in found.models if set(model.effects) == named]
        assert told == [found.chi2.explained]


@pytest.mark.long
def test_survivors_under_a_coarser_likelihood_are_told_under_the_noise_of_the_chosen_model():
    """As fitted anew under it; the coarser noise leaves them less than half of that chi-square."""
    choice = investigated(UNEXPLAINED).choice
    noise, others = choice.fitted.model.noise, [each for each in choice.survivors if each.effects != choice.effects]
    told = surviving(replace(choice, survivors=tuple(others)), None)
    assert len(others) > 2
    for model, other in zip(told, others, strict=False):
        anew = fit(replace(other.fitted.model, noise=noise), other.fitted.p)
        assert other.fitted.reduced < anew.reduced / 2
        assert model.reduced_chi2 == pytest.approx(anew.reduced, rel=0.05)


def test_the_distance_of_a_program_that_tells_much_is_written_out():
    (pair,) = disputed().experiments
    (far,) = proposed([pair._replace(experiment=replace(pair.experiment, separation=1234.0))])
    assert "by a squared distance of 1234 in units of the noise" in far.statement


def test_effects_none_of_which_is_sure_are_said_to_be_looked_for():
    """Nothing at 19 %, a softer segment at 47, a weak plate at 29, anything else at 5."""
    sets = {(): 0.19, ("segment_stiffness",): 0.47, ("weakened_plate",): 0.29, ("hole_offset",): 0.05}
    models = [
        SimpleNamespace(probability=share, effects=[SimpleNamespace(kind=kind) for kind in kinds])
        for kinds, share in sets.items()
    ]
    found = SimpleNamespace(
        setup=(),
        why="",
        verdict="ambiguous",
        effects=(),
        share_of_stated=1.0,
        heldout=None,
        rival_blunder=None,
        experiments=(),
        alternatives=(),
        posterior=SimpleNamespace(models=models),
        settings=Settings().plain(),
    )
    said = what_to_do(found)
    assert said.startswith("Look at the rig itself for segment stiffness and weakened plate: some effect is likelier")
    assert verdict_sentences(found).endswith(
        "some effect is likelier there than none, though the recording does not tell which."
    )
    found.verdict = "adequate"
    assert "no effect is sure enough to be added, though some effect is likely there (81 %)" in what_to_do(found)


def test_chi_square_is_said_to_be_under_the_noise_that_was_found_where_that_is_another():
    found = diagnosed()
    for scale, said in ((1.2, False), (1.4, True)):
        lines = summary_lines(replace(found, noise=found.noise._replace(scale=scale)))
        assert any("under 1.4 times the stated noise" in line for line in lines) == said
