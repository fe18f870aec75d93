"""The benchmark keeps its own rules: composition, seal, what is detectable, scores."""

import dataclasses
from collections import Counter

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from prb3r.errors import EngineError
from prb3r.proof import prove as run
from prb3r.proof.concealed.camera import read, truth
from prb3r.proof.concealed.candidates import candidates
from prb3r.proof.concealed.composition import KINDS, counts, drawn_design, flavours, labels_of, requests
from prb3r.proof.concealed.designs import LOADING, PLAIN, POOR, design_of, followed, largest_bend
from prb3r.proof.concealed.drawing import label_of
from prb3r.proof.concealed.foreign import LAWS
from prb3r.proof.concealed.labels import Label, Request
from prb3r.proof.concealed.recordings import bias_of, recording_of
from prb3r.proof.concealed.responses import APART, NORM, Bench, nearest
from prb3r.proof.concealed.sealing import Seal
from prb3r.proof.judging.intervals import median_of, wilson
from prb3r.proof.judging.methods import Claim, Verdict
from prb3r.proof.judging.opened import Judged, first_right, parameters, plate_error

SEED = 77


@pytest.fixture(scope="module")
def bench():
    return Bench(design_of(SEED, 4))


def test_a_full_run_is_composed_as_the_protocol_asks():
    whole = counts(1200)
    assert sum(whole.values()) == 1200
    assert whole["clean"] >= 400
    assert whole["single"] >= 400
    assert sum(counts(61).values()) == 61
    designs = [design_of(SEED, k, flavour) for k, flavour in enumerate([PLAIN, PLAIN, PLAIN, LOADING, POOR])]
    asked = requests(SEED, 240, designs)
    assert asked == requests(SEED, 240, designs)
    assert [each.case for each in asked] == list(range(240))
    single = Counter(each.kind for each in asked if each.cls == "single")
    assert set(single) == set(KINDS)
    assert max(single.values()) - min(single.values()) <= 1
    sizes = Counter(each.multiple for each in asked if each.cls == "single")
    assert set(sizes) == {1.0, 2.0, 5.0}
    assert max(sizes.values()) - min(sizes.values()) <= 2
    assert {each.kind for each in asked if each.cls == "foreign"} == set(LAWS)
    assert {designs[each.design].flavour for each in asked if each.cls == "hidden"} == {LOADING}
    assert Counter(each.kind for each in asked if each.cls == "clean")["awkward"] == counts(240)["clean"] // 2


@pytest.mark.parametrize("number", range(6))
def test_designs_bend_moderately_and_are_the_same_again(number):
    design = drawn_design((SEED, number, flavours(60)[number]))
    assert design == drawn_design((SEED, number, flavours(60)[number]))
    assert largest_bend(followed(design.manipulator, design.program)) == design.largest_bend <= 0.5
    pulled = Counter(
        name for steps in design.program for name in design.cables if any(step[f"cable_{name}_n"] for step in steps)
    )
    assert min(pulled[name] for name in design.cables) >= 3
    assert bool(design.loading_only) or design.flavour == PLAIN


def test_engine_and_bench_agree_without_effects():
    assert bias_of(design_of(SEED, 0)) < 0.1


@pytest.mark.parametrize("kind", ["weakened_plate", "pulley_friction", "disk_contact", "gravity"])
def test_a_detectable_size_is_that_by_direct_simulation(bench, kind):
    label = label_of(Request(0, SEED, "single", 0, kind, 2.0), bench, None)
    assert label.kinds == (kind,)
    manipulator = truth(bench.design, label.effects)
    exact = read(bench.design, manipulator, followed(manipulator, bench.design.program))
    white = bench.whiten(exact - bench.nominal)
    least = np.linalg.lstsq(bench.calibration, white, rcond=None)[0]
    assert np.linalg.norm(white - bench.calibration @ least) == pytest.approx(2 * NORM, rel=0.06)
    # the recording's own constants differ from the nominal ones: by up to a quarter in friction
    assert label.norm == pytest.approx(2 * NORM, rel=0.15)


def test_whitening_is_that_of_the_scatter_of_recordings(bench):
    """Simulated recordings without effects, whitened by the bench, are standard normal, common scatter included."""
    label = Label(0, "clean", 0, 0)
    drawn = [recording_of(bench.design, dataclasses.replace(label, noise_seed=k)).readings.value for k in range(40)]
    white = np.array([bench.whiten(each.reshape(bench.nominal.shape) - bench.nominal) for each in drawn])
    white = white[:, : bench.nominal.size]
    assert np.mean(white**2) == pytest.approx(1, abs=0.03)
    everywhere = bench.basis[: bench.nominal.size].T @ white.T
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


def test_wilson_intervals_are_the_published_ones():
    """Newcombe, Statistics in Medicine 17 (1998) 857, table I: 81 of 263, 15 of 148, 0 of 20, 1 of 29."""
    for hits, count, low, high in [
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ]:
        assert wilson(hits, count) == pytest.approx((low, high), abs=5e-5)


def test_medians_have_intervals_of_order_statistics():
    score = median_of(range(1, 101))
    assert (score.value, score.count) == (50.5, 100)
    assert 38 <= score.low <= 42
    assert 59 <= score.high <= 63


def test_scores_of_one_verdict():
    true = {"kind": "weakened_plate", "plate": 3, "factor": 0.8}
    label = Label(0, "single", 0, 0, effects=(true,), norm=5 * NORM, nearest={"gravity": 50.0})
    claim = Claim("weakened_plate", {"plate": 3}, {"factor": (0.81, 0.79, 0.83)})
    case = Judged(label, Verdict(0, "diagnose", "explained", (claim,)), 0.3)
    assert first_right(case)
    assert plate_error(case) == 0
    ((error, covered),) = parameters(case)
    assert error == pytest.approx(1 - np.log(0.81) / np.log(0.8))
    assert covered
    beside = Claim("weakened_plate", {"plate": 4}, {"factor": (0.81, 0.79, 0.83)})
    assert plate_error(case._replace(verdict=Verdict(0, "diagnose", "explained", (beside,)))) == 1
    assert not first_right(case._replace(verdict=Verdict(0, "diagnose", "unexplained", (claim,))))
    assert parameters(case._replace(verdict=Verdict(0, "diagnose", "failed"))) == [(np.inf, False)]


def test_every_candidate_vanishes_with_its_size(bench):
    for group in candidates(bench.design):
        for each in group:
            if each.sized and each.kind != "nonlinear_plate":
                small = bench.response([each.effect(each.probe / 10)])
                assert np.linalg.norm(small) == pytest.approx(
                    np.linalg.norm(bench.unit(each) * each.probe / 10), rel=0.1
                )


def test_what_one_wrong_weight_can_imitate_is_all_at_one_step(bench):
    program = [list(steps) for steps in bench.program]
    step = max(range(len(program[0])), key=lambda k: sum(program[0][k][f"cable_{c}_n"] for c in bench.design.cables))
    name = max((f"cable_{c}_n" for c in bench.design.cables), key=lambda key: program[0][step][key])
    program[0][step] = {**program[0][step], name: 0.7 * program[0][step][name]}
    weight = bench.whiten(bench.readings(program=[tuple(steps) for steps in program]) - bench.nominal)
    assert bench.norm(weight) > 2 * NORM
    assert bench.without_a_step(weight) < 1e-6 * bench.norm(weight) ** 2
    physics = bench.response([{"kind": "pulley_friction", "efficiency": 0.97}])
    assert bench.without_a_step(physics) > 0.3 * bench.norm(physics) ** 2


def test_two_effects_are_near_their_sum_and_no_other_pair_need_be(bench):
    kinds = ("weakened_plate", "pulley_friction", "gravity")
    own = [next(each for each in bench.responses if each.kind == kind) for kind in kinds]
    changes = [5 * NORM * each.columns[:, 0] / bench.norm(each.columns[:, 0]) for each in own]
    assert bench.to_pairs(changes[0] + changes[1], own) < 1e-6
    assert min(bench.distance(changes[0] + changes[1], each) for each in own) > APART
    assert bench.to_pairs(sum(changes), own) > APART


def test_a_refit_with_the_full_rig_is_no_farther_than_by_the_linear_rule(bench):
    change = bench.response([{"kind": "segment_stiffness", "segment": 1, "factor": 0.7}])
    linear, refitted = (nearest(bench, change, bench.responses, ["segment_stiffness"], near) for near in (0.0, np.inf))
    assert all(refitted[kind] <= linear[kind] for kind in linear)
    assert min(refitted.values()) < 0.9 * min(linear.values())


def test_a_small_run_from_end_to_end(monkeypatch):
    monkeypatch.setattr(run, "flavours", lambda cases: [PLAIN, POOR])
    monkeypatch.setattr(run, "METHODS", {run.MAIN: run.METHODS[run.MAIN]})
    said = []
    proof = run.prove(6, SEED, 2, said.append)
    assert [case.label.case for case in proof.main] == list(range(6))
    assert any(proof.digest in text for text in said)
    assert said.index(f"labels sealed, SHA-256 {proof.digest}") < said.index("verdicts")
    assert max(proof.bias) < 1
    assert not [case.verdict.reason for case in proof.main if case.verdict.verdict == "failed"]
    first = proof.main[0]
    recording = recording_of(proof.designs[first.label.design], first.label)
    with threadpool_limits(1):  # as in a worker
        again = run.answered(run.Asked(0, recording, frozenset(), run.MAIN, SEED))
    assert again.verdict == first.verdict.verdict
    assert [each.kind for each in again.named] == [each.kind for each in first.verdict.named]
    assert again.chi2 == pytest.approx(first.verdict.chi2, rel=1e-9)  # sums differ in their last bits between processes
    assert again.largest == pytest.approx(first.verdict.largest, rel=1e-9)


def test_labels_are_the_same_again():
    design = design_of(SEED, 1, POOR)
    asked = [Request(0, SEED, "confusable", 1, "", 5.0), Request(1, SEED, "decoy", 1, "weight")]
    assert labels_of((design, asked)) == labels_of((design, asked))
