"""The table of scores of bench rigs: goals, which recordings count for each, and scores for information."""

from collections.abc import Sequence

import numpy as np

from prb3r.proof.concealed.drawing import OUTSIDE
from prb3r.proof.concealed.elsewhere import OTHER_DESIGN
from prb3r.proof.concealed.foreign import LAWS
from prb3r.proof.judging.goals import Goal, Measure, Test, share_measure
from prb3r.proof.judging.intervals import Score, median_of, ratio_of, share_of
from prb3r.proof.judging.opened import (
    OpenedCase,
    confident,
    failed,
    first_right,
    mentioned,
    named_or_failed,
    parameters,
    plate_error,
    plate_of,
    size_class,
)
from prb3r.proof.settings import SETTINGS

EDGE, PLAINLY, LARGE = SETTINGS.population.multiples
"""The three sizes of single effects, in smallest detectable ones: names and places are scored from the second size on,
parameter errors at the third."""


def _of(cls: str, *sizes: float) -> Test:
    """The test whether a recording is of a class and, if sizes are given, counts as one of them."""
    return lambda case: case.label.cls == cls and (not sizes or size_class(case.label) in sizes)


def _first(size: float) -> Measure:
    """The measure of the share of distinguishable single effects of a size that are named first."""
    return share_measure(lambda case: _of("single", size)(case) and case.label.distinguishable, first_right)


def _placed(case: OpenedCase) -> bool:
    """Whether a single, distinguishable effect of the larger sizes acts at just one plate or disk."""
    if not (_of("single", PLAINLY, LARGE)(case) and case.label.distinguishable):
        return False
    return plate_of(case.label.kinds[0], case.label.effects[0]) is not None


def _covering(cases: Sequence[OpenedCase]) -> Score:
    """Share of the intervals of parameters that cover the truth, single effects of the larger sizes."""
    chosen = [case for case in cases if _of("single", PLAINLY, LARGE)(case)]
    return share_of([covered for case in chosen for _, covered in parameters(case) if covered is not None])


def _errors(cases: Sequence[OpenedCase]) -> Score:
    """Median relative error of parameters, single effects of the largest size."""
    return median_of([error for case in cases if _of("single", LARGE)(case) for error, _ in parameters(case)])


def _heldout(cases: Sequence[OpenedCase]) -> Score:
    """Share of the excess squared error on held-out sequences that is removed, summed over single effects of the
    largest size.  A failed verdict removes nothing of the excess that is expected there."""
    parts = []
    for case in cases:
        if _of("single", LARGE)(case) and failed(case):
            parts.append((0.0, SETTINGS.protocol.heldout_share * case.label.norm**2))
        elif _of("single", LARGE)(case) and case.verdict.heldout is not None:
            before, after, count = case.verdict.heldout
            if before > count:
                parts.append((before - after, before - count))
    return ratio_of(parts)


def _after(cases: Sequence[OpenedCase]) -> Score:
    """Median held-out chi-square per reading with the explanation, single effects of the largest size."""
    chosen = [c.verdict.heldout for c in cases if _of("single", LARGE)(c) and c.verdict.heldout is not None]
    return median_of([after / count for _, after, count in chosen])


def outside(case: OpenedCase) -> bool:
    """Whether the physics is outside the library of the diagnosis, far from every single effect in it."""
    return case.label.cls in OUTSIDE and case.label.distance >= SETTINGS.sizes.far_outside


def far_outside(case: OpenedCase) -> bool:
    """Whether the physics is outside the library, and no two effects of the library together come near it."""
    return outside(case) and (case.label.pair_distance or 0.0) >= SETTINGS.sizes.apart


def held_by(case: OpenedCase) -> str:
    """The kind of effect by which the library holds the foreign law of a recording after all; empty: none, no law."""
    return LAWS[case.label.foreign[0]].held_by if outside(case) and case.label.foreign else ""


def _by_no_kind(case: OpenedCase) -> bool:
    """Whether the physics is outside the library, and no law that effects of one kind are in another form."""
    return outside(case) and not held_by(case)


def _asked_elsewhere(case: OpenedCase) -> bool:
    """Whether the physics is far outside the library and there are predictions of another design to judge."""
    return outside(case) and any(missed.name == OTHER_DESIGN for missed in case.missed)


def does_no_harm(case: OpenedCase) -> bool:
    """Whether the verdict is `unexplained`, or another design is predicted no worse than by calibration alone or within
    the noise.  A failed verdict counts as harm."""
    there = [missed for missed in case.missed if missed.name == OTHER_DESIGN]
    within = SETTINGS.real.excess**2
    if case.verdict.verdict in ("unexplained", "failed"):
        return case.verdict.verdict == "unexplained"
    return all(m.explained <= max(m.calibrated, within) for m in there)


def _flagged(case: OpenedCase) -> bool:
    """Whether the verdict is `ambiguous` and mentions both the true kind and one that cannot be told from it."""
    near = [kind for kind, far in case.label.nearest.items() if far < SETTINGS.sizes.same]
    kinds = mentioned(case.verdict)
    return case.verdict.verdict == "ambiguous" and case.label.kinds[0] in kinds and bool(kinds & set(near))


def _weight_named(case: OpenedCase) -> bool:
    """Whether the verdict is `adequate` and a remark names the step of the wrong weight."""
    if case.label.wrong_weight is None or case.verdict.verdict != "adequate":
        return False
    sequence, step, _, _ = case.label.wrong_weight
    wanted = f"sequence s{sequence + 1}, step {step + 1}: the weight on "
    return any(remark.startswith(wanted) for remark in case.verdict.remarks)


def _pair(case: OpenedCase) -> bool:
    """Whether a recording has a pair of effects of which no third kind imitates either."""
    return case.label.cls == "pair" and case.label.distance >= SETTINGS.sizes.apart


def _unexplained(case: OpenedCase) -> bool:
    return case.verdict.verdict == "unexplained"


def _sure_of_a_name(case: OpenedCase) -> bool:
    """Whether an effect is named for sure; a diagnosis that failed counts as one that does."""
    return bool(confident(case.verdict)) or failed(case)


def _both_of(words: str, which: Test) -> tuple[Goal, Goal]:
    """The two scores of recordings with physics outside the library, of those that `which` picks, for information."""
    return (
        Goal(f"{words}: `unexplained`", "", (), share_measure(which, _unexplained)),
        Goal(f"{words}: wrong confident name", "", (), share_measure(which, _sure_of_a_name)),
    )


def _false_constant(which: str) -> Measure:
    """The measure of the median relative error of E in the class where calibration hides the effect.

    `which` is the fit: `loading` (loading-only sequences), `calibrated` or `explained`.
    """

    def measure(cases: Sequence[OpenedCase]) -> Score:
        errors = []
        for case in cases:
            values = case.verdict.loading if which == "loading" else getattr(case.verdict, which)
            if case.label.cls == "hidden" and values is not None and case.verdict.verdict != "failed":
                errors.append(abs(float(np.expm1(values[0] - case.label.constants[0]))))
        return median_of(errors)

    return measure


GOALS: tuple[Goal, ...] = (
    Goal("clean sets with a named effect", "<=", (0.01,), share_measure(_of("clean"), named_or_failed), "invented"),
    Goal(
        f"right effect first, at {PLAINLY:g} times detectable", ">=", (0.95,), _first(PLAINLY), f"first at {PLAINLY:g}"
    ),
    Goal(f"right effect first, at {LARGE:g} times detectable", ">=", (0.99,), _first(LARGE), f"first at {LARGE:g}"),
    Goal(
        "truth among named and indistinguishable",
        ">=",
        (0.98,),
        share_measure(_of("single", PLAINLY, LARGE), lambda c: c.label.kinds[0] in mentioned(c.verdict)),
    ),
    Goal(
        "plate exactly",
        ">=",
        (0.92,),
        share_measure(lambda c: _placed(c) and not c.label.places, lambda c: plate_error(c) == 0),
    ),
    Goal("plate within one", ">=", (0.99,), share_measure(_placed, lambda c: plate_error(c) <= 1)),
    Goal("95 % intervals cover", "in", (0.90, 0.98), _covering, "covered"),
    Goal(f"parameter error at {LARGE:g} times, median", "<=", (0.05,), _errors),
    Goal("held-out excess error removed", ">=", (0.90,), _heldout, "held out"),
    Goal(
        "both of a pair named",
        ">=",
        (0.80,),
        share_measure(_pair, lambda c: set(c.label.kinds) <= {claim.kind for claim in confident(c.verdict)}),
        "pairs",
    ),
    Goal(
        "outside the library: `unexplained`",
        ">=",
        (0.90,),
        share_measure(outside, _unexplained),
        "outside",
    ),
    Goal(
        "outside the library: wrong confident name",
        "<=",
        (0.03,),
        share_measure(outside, _sure_of_a_name),
    ),
    Goal(
        "outside the library: `unexplained`, or another design no worse than by calibration alone",
        ">=",
        (0.95,),
        share_measure(_asked_elsewhere, does_no_harm),
        "outside, no harm",
    ),
    Goal("confusable flagged", ">=", (0.98,), share_measure(_of("confusable"), _flagged), "confusable"),
)
FOLLOWED = Goal("proposed experiment resolves the pair", ">=", (0.90,), lambda cases: share_of([]))
INFORMATION: tuple[Goal, ...] = (
    Goal("clean sets not adequate", "", (), share_measure(_of("clean"), lambda c: c.verdict.verdict != "adequate")),
    Goal(
        "right effect first, at the detectable size",
        "",
        (),
        share_measure(lambda c: _of("single", EDGE)(c) and c.label.distinguishable, first_right),
    ),
    Goal(
        "effect at the detectable size noticed",
        "",
        (),
        share_measure(_of("single", EDGE), lambda c: c.verdict.verdict not in ("adequate", "failed")),
    ),
    Goal(
        "pairs: truth named or indistinguishable, both",
        "",
        (),
        share_measure(_pair, lambda c: set(c.label.kinds) <= mentioned(c.verdict)),
    ),
    Goal(
        "wrong weight: adequate, and its step named",
        "",
        (),
        share_measure(lambda c: c.label.wrong_weight is not None, _weight_named),
    ),
    *_both_of("outside, two effects together included", far_outside),
    *_both_of("outside, no law that effects of one kind are", _by_no_kind),
    Goal(
        "outside, a law that effects of one kind are: this kind named",
        "",
        (),
        share_measure(
            lambda c: bool(held_by(c)), lambda c: held_by(c) in {claim.kind for claim in confident(c.verdict)}
        ),
    ),
    Goal("decoys with a named effect", "", (), share_measure(_of("decoy"), named_or_failed)),
    Goal("held-out chi-square a reading, median", "", (), _after),
    Goal("calibration hides it: true effect first", "", (), share_measure(_of("hidden"), first_right)),
    Goal(
        f"calibration hides it: loading alone fits (p > {SETTINGS.protocol.loading_fits:g})",
        "",
        (),
        share_measure(
            lambda c: c.label.cls == "hidden" and c.verdict.loading is not None,
            lambda c: c.verdict.loading is not None and c.verdict.loading[2] > SETTINGS.protocol.loading_fits,
        ),
    ),
    Goal("calibration hides it: error of E, loading alone, median", "", (), _false_constant("loading")),
    Goal("calibration hides it: error of E, all sequences, median", "", (), _false_constant("calibrated")),
    Goal("calibration hides it: error of E, explained, median", "", (), _false_constant("explained")),
    Goal("failed", "", (), share_measure(lambda c: True, lambda c: c.verdict.verdict == "failed")),
)
