"""The benchmark keeps its own rules: composition, seal, what is detectable."""

import dataclasses
import json
from collections import Counter

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from prb3r.errors import EngineError
from prb3r.present.proof.report import publish_proof
from prb3r.proof import prove as run
from prb3r.proof.concealed.camera import exact_readings, truth
from prb3r.proof.concealed.candidates import candidates, concealable
from prb3r.proof.concealed.composition import BENCH_CLASSES, counts, drawn_design, flavours, labels_of, requests
from prb3r.proof.concealed.design import Flavour, followed, largest_bend
from prb3r.proof.concealed.designs import design_of
from prb3r.proof.concealed.distances import distance_to_pairs, distance_without_a_step, linear_distance, nearest_by_kind
from prb3r.proof.concealed.drawing import label_of
from prb3r.proof.concealed.elsewhere import OTHER_DESIGN, OTHER_LOADS, target_states
from prb3r.proof.concealed.foreign import LAWS
from prb3r.proof.concealed.labels import Label, Request
from prb3r.proof.concealed.recordings import bias_of, recording_of
from prb3r.proof.concealed.responses import Responses
from prb3r.proof.concealed.sealing import Seal
from prb3r.proof.settings import SETTINGS

SEED = 77
NORM, APART = SETTINGS.sizes.detectable, SETTINGS.sizes.apart


def short_design(task):
    """As `drawn_design`, with three of the sequences."""
    design = drawn_design(task)
    return dataclasses.replace(design, program=design.program[:3])


@pytest.fixture(scope="module")
def responses():
    """Of few plates and three of the sequences."""
    return Responses(short_design((SEED, 0, Flavour.PLAIN)))


def test_a_full_run_is_composed_as_the_protocol_asks():
    whole = counts(1260)
    assert sum(whole.values()) == 1260 == SETTINGS.population.full
    assert whole["clean"] + whole["imperfect-clean"] >= 400
    assert whole["several"] >= 300
    assert sum(counts(61).values()) == 61
    designs = [
        design_of(SEED, k, flavour) for k, flavour in enumerate([Flavour.PLAIN] * 3 + [Flavour.LOADING, Flavour.POOR])
    ]
    asked = requests(SEED, 240, designs, BENCH_CLASSES)
    assert asked == requests(SEED, 240, designs, BENCH_CLASSES)
    assert [each.case for each in asked] == list(range(240))
    single = Counter(each.kind for each in asked if each.cls == "single")
    assert set(single) == set(concealable())
    assert max(single.values()) - min(single.values()) <= 1
    sizes = Counter(each.multiple for each in asked if each.cls == "single")
    assert set(sizes) == {1.0, 2.0, 5.0}
    assert max(sizes.values()) - min(sizes.values()) <= 2
    assert {each.kind for each in asked if each.cls == "foreign"} == set(LAWS)
    assert {designs[each.design].flavour for each in asked if each.cls == "hidden"} == {Flavour.LOADING}
    assert (
        Counter(each.kind for each in asked if each.cls == "clean")["awkward"]
        == counts(240, BENCH_CLASSES)["clean"] // 2
    )


@pytest.mark.parametrize("number", range(6))
def test_designs_bend_moderately_and_are_the_same_again(number):
    design = drawn_design((SEED, number, flavours(60)[number]))
    assert design == drawn_design((SEED, number, flavours(60)[number]))
    assert largest_bend(followed(design.manipulator, design.program)) == design.largest_bend <= 0.5
    pulled = Counter(
        name for steps in design.program for name in design.cables if any(step[f"cable_{name}_n"] for step in steps)
    )
    assert min(pulled[name] for name in design.cables) >= 3
    assert bool(design.loading_only) or design.flavour == Flavour.PLAIN


def test_engine_and_rig_agree_without_effects():
    assert bias_of(design_of(SEED, 0)) < 0.1


@pytest.mark.parametrize(
    "kind", [pytest.param("weakened_plate", marks=pytest.mark.long), "pulley_friction", "disk_contact", "gravity"]
)
def test_a_detectable_size_is_that_by_direct_simulation(responses, kind):
    label = label_of(Request(0, SEED, "single", 0, kind, 2.0), responses, None)
    assert label.kinds == (kind,)
    manipulator = truth(responses.design, label.effects)
    exact = exact_readings(responses.design, manipulator, followed(manipulator, responses.design.program))
    white = responses.whiten(exact - responses.nominal)
    least = np.linalg.lstsq(responses.calibration, white, rcond=None)[0]
    assert np.linalg.norm(white - responses.calibration @ least) == pytest.approx(2 * NORM, rel=0.06)
    # the recording's own constants differ from the nominal ones: by up to a quarter in friction
    assert label.norm == pytest.approx(2 * NORM, rel=0.15)


def test_whitening_is_that_of_the_scatter_of_recordings(responses):
    """Recordings without effects, whitened with the rig's covariance, are standard normal, common scatter included."""
    label = Label(0, "clean", 0, 0)
    drawn = [recording_of(responses.design, dataclasses.replace(label, noise_seed=k)).readings.value for k in range(40)]
    white = np.array([responses.whiten(each.reshape(responses.nominal.shape) - responses.nominal) for each in drawn])
    white = white[:, : responses.nominal.size]
    assert np.mean(white**2) == pytest.approx(1, abs=0.03)
    everywhere = responses.basis[: responses.nominal.size].T @ white.T
    assert np.mean(everywhere**2) == pytest.approx(1, abs=0.4)


def test_the_seal_hides_shows_changes_and_refuses():
    labels = [
        Label(k, "single", 0, 5, effects=({"kind": "weakened_plate", "plate": 2, "factor": 0.8},)) for k in (0, 1)
    ]
    seal = Seal(labels)
    other = [
        labels[0],
        dataclasses.replace(labels[1], effects=({"kind": "weakened_plate", "plate": 3, "factor": 0.8},)),
    ]
    assert Seal(other).digest != seal.digest == Seal(labels).digest
    assert all(b"weakened" not in value for value in vars(seal).values() if isinstance(value, bytes))
    with pytest.raises(EngineError, match="1 verdicts are missing"):
        seal.opened([0])
    assert seal.opened([0, 1]) == labels


def test_a_broken_seal_is_refused():
    seal = Seal([Label(0, "clean", 0, 5)])
    seal._content = Seal([Label(0, "clean", 0, 6)])._content
    with pytest.raises(EngineError, match="not those that were sealed"):
        seal.opened([0])


def test_every_candidate_vanishes_with_its_size(responses):
    for group in candidates(responses.design):
        for each in group:
            if each.sized and each.kind != "nonlinear_plate":
                small = responses.to([each.effect(each.probe / 10)])
                assert np.linalg.norm(small) == pytest.approx(
                    np.linalg.norm(responses.per_unit(each) * each.probe / 10), rel=0.1
                )


def test_what_one_wrong_weight_can_imitate_is_all_at_one_step(responses):
    program = [list(steps) for steps in responses.program]
    step = max(
        range(len(program[0])), key=lambda k: sum(program[0][k][f"cable_{c}_n"] for c in responses.design.cables)
    )
    name = max((f"cable_{c}_n" for c in responses.design.cables), key=lambda key: program[0][step][key])
    program[0][step] = {**program[0][step], name: 0.7 * program[0][step][name]}
    weight = responses.whiten(responses.readings(program=[tuple(steps) for steps in program]) - responses.nominal)
    assert responses.norm(weight) > 2 * NORM
    assert distance_without_a_step(responses, weight) < 1e-6 * responses.norm(weight) ** 2
    physics = responses.to([{"kind": "pulley_friction", "efficiency": 0.97}])
    assert distance_without_a_step(responses, physics) > 0.3 * responses.norm(physics) ** 2


def test_two_effects_are_near_their_sum_and_no_other_pair_need_be(responses):
    kinds = ("weakened_plate", "pulley_friction", "gravity")
    own = [next(each for each in responses.of_candidates if each.kind == kind) for kind in kinds]
    changes = [5 * NORM * each.columns[:, 0] / responses.norm(each.columns[:, 0]) for each in own]
    assert distance_to_pairs(responses, changes[0] + changes[1], own) < 1e-6
    assert min(linear_distance(responses, changes[0] + changes[1], each) for each in own) > APART
    assert distance_to_pairs(responses, sum(changes), own) > APART


def test_a_refit_with_the_full_rig_is_no_farther_than_by_the_linear_rule(responses):
    change = responses.to([{"kind": "segment_stiffness", "segment": 1, "factor": 0.7}])
    linear, refitted = (
        nearest_by_kind(responses, change, responses.of_candidates, ["segment_stiffness"], near)
        for near in (0.0, np.inf)
    )
    assert all(refitted[kind] <= linear[kind] for kind in linear)
    assert min(refitted.values()) < 0.9 * min(linear.values())


@pytest.mark.long
def test_a_small_run_from_end_to_end(monkeypatch, tmp_path):
    monkeypatch.setattr(run, "drawn_design", short_design)
    monkeypatch.setattr(run, "flavours", lambda cases, classes: [Flavour.PLAIN, Flavour.POOR])
    monkeypatch.setattr(run, "METHODS", {run.MAIN: run.METHODS[run.MAIN]})
    said = []
    proof = run.run_proof(4, SEED, 1, said.append, classes=BENCH_CLASSES)
    assert [case.label.case for case in proof.main] == list(range(4))
    assert any(proof.digest in text for text in said)
    assert said.index(f"labels sealed, SHA-256 {proof.digest}") < said.index("verdicts")
    assert max(proof.bias) < 1
    assert not [case.verdict.reason for case in proof.main if case.verdict.verdict == "failed"]
    publish_proof(proof, tmp_path)
    page, numbers = (tmp_path / "proof.md").read_text(), json.loads((tmp_path / "proof.json").read_text())
    assert proof.digest in page
    assert [row["score"] for row in numbers["scores"]["diagnose"]] == [goal.name for goal, _ in proof.scores()]
    assert all(f"| {goal.name} |" in page for goal, _ in proof.scores())
    assert numbers["settings"]["sizes"]["apart"] == 22
    first = proof.main[0]
    recording = recording_of(proof.designs[first.label.design], first.label)
    with threadpool_limits(1):  # as in a worker
        again = run.answer(run.VerdictTask(0, recording, frozenset(), run.MAIN, SEED))
    assert again.verdict == first.verdict.verdict
    assert [each.kind for each in again.named] == [each.kind for each in first.verdict.named]
    # Between processes sums differ in their last bits, and fits stop a relative 1e-6 short of their lowest point.
    assert again.chi2 == pytest.approx(first.verdict.chi2, rel=1e-6)
    assert again.largest == pytest.approx(first.verdict.largest, rel=1e-5)


def test_physics_outside_the_library_goes_to_another_design_unless_it_is_of_one_arm(responses):
    design, nobody = responses.design, np.zeros(2)
    other = {"name": OTHER_DESIGN, "manipulator": dict(design.manipulator), "program": [list(design.program[0])]}
    plain, *moved = (
        target_states(design, other | {"name": name}, (), nobody, None, law)[0].x
        for name, law in [
            (OTHER_DESIGN, None),
            (OTHER_DESIGN, ("leak", 0.2)),
            (OTHER_LOADS, ("waves", 0.3)),
            (OTHER_DESIGN, ("waves", 0.3)),
        ]
    )
    assert [bool(np.abs(x - plain).max() > 1e-5) for x in moved] == [True, True, False]


@pytest.mark.long
def test_labels_are_the_same_again():
    design = short_design((SEED, 5, Flavour.POOR))
    asked = [Request(0, SEED, "confusable", 1, "", 5.0), Request(1, SEED, "decoy", 1, "weight")]
    assert labels_of((design, asked)) == labels_of((design, asked))
