"""A decision in sentences: what is recommended and why, what is out and by how much, what would change it."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from prb3r.quantities import Quantity, describe
from prb3r.study.decide import Decision
from prb3r.study.designs import value_in_words
from prb3r.study.wishes import Criterion, Requirement, plain_text

ALIKE_SHARE = 0.05
"""Designs within this share of each other are called alike."""
LEVEL = 0.02
"""Scores that differ by less are called level: weights are not known that well."""
MOST_TOLD = 12
"""Up to this many designs that are out are told one by one."""
MOST_NAMED = 6
"""Up to this many designs of a kind are named."""


def wish_in_words(criterion: Criterion, quantity: Quantity) -> str:
    """What a criterion looks at, as the subject of a sentence."""
    if criterion.words:
        return criterion.words
    title = quantity.title[:1].lower() + quantity.title[1:]
    over = f"{criterion.quantile:g} quantile" if criterion.quantile is not None else criterion.over
    about = [] if criterion.over == "worst" else [over]
    about += [_circumstance(name, value) for name, value in criterion.where.items()]
    return f"{title} ({', '.join(about)})" if about else title


def bound_in_words(requirement: Requirement, quantity: Quantity) -> str:
    """`at most 150 N`."""
    side = "at most" if requirement.at_least is None else "at least"
    return f"{side} {value_in_words(requirement.limit, quantity)}"


def listed_names(names: Sequence[str]) -> str:
    """Names in a sentence; of many the first, and how many more."""
    names = list(names)
    if len(names) > MOST_NAMED:
        names = [*names[: MOST_NAMED - 1], f"{len(names) - MOST_NAMED + 1} more"]
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def recommendation(decision: Decision) -> str:
    """What to build, with its reasons; where nothing keeps the requirements, what comes closest."""
    if decision.winner is None:
        return _nothing_does(decision)
    k = decision.ranking[0]
    able = sum(map(bool, decision.feasible))
    said = []
    if decision.requirements:
        whole = f"{able} of {len(decision.designs)} designs keep{'s' * (able == 1)} every requirement"
        said.append(f"{whole}; nearest to its bound, {_tightest(decision, k)}")
    if decision.preferences:
        said += _ranked(decision, k)
    elif able > 1:
        said.append("no [[preference]] ranks them, and this one has the largest reserve")
    return f"**Recommendation: {decision.winner}.** " + " ".join(f"{_upper(sentence)}." for sentence in said)


def _ranked(decision: Decision, k: int) -> list[str]:
    front = [j for j, on in enumerate(decision.front) if on]
    if len(front) == 1:
        several = len(decision.ranking) > 1
        return ["none of the others that do is better in anything that was preferred"] if several else []
    best = [j for j in range(len(decision.preferences)) if _is_best(decision, k, j)]
    words = [f"{_wish(decision, j)} ({_value(decision, k, j)})" for j in best]
    second = next(other for other in decision.ranking[1:] if decision.front[other])
    against = f"{decision.score[k]:.2f} against {decision.score[second]:.2f} of {decision.designs[second]}"
    if decision.score[k] - decision.score[second] < LEVEL:
        against += ", so the two are level"
    equal = len(set(decision.weights)) == 1
    return [
        *(
            [f"it has the best {listed_names(words)}"]
            if words
            else ["it is best in nothing, and far behind in nothing"]
        ),
        f"at {'equal' if equal else 'the given'} weights it scores {against}",
        f"{_share(decision, k)} put it first",
    ]


def _nothing_does(decision: Decision) -> str:
    """The design whose largest shortfall is smallest, and the bounds it would need."""
    reserve = decision.margins.min(1, initial=np.inf)
    k = int(np.argmax(reserve))
    if not np.isfinite(reserve[k]):
        return "**No design keeps every requirement**, and none comes close: each has cases without a value."
    short = _numbers(decision.margins[k] < 0)
    need = [f"{_bounded(decision, k, r)} ({_distance(decision, k, r)})" for r in short]
    return (
        f"**No design keeps every requirement.** {decision.designs[k]} comes closest: {listed_names(need)}. "
        "It would do if that were allowed."
    )


def exclusions(decision: Decision) -> list[str]:
    """Of each design that is out, the bounds that it breaks, the worst first; of many designs how many."""
    out = _numbers(~decision.feasible)
    said = [f"{len(out)} of {len(decision.designs)} designs are out."] if len(out) > MOST_TOLD else []
    for k in out if len(out) <= MOST_TOLD else ():
        broken = sorted(_numbers(decision.margins[k] < 0), key=lambda r: decision.margins[k, r])
        reasons = [f"{_bounded(decision, k, r)} ({_distance(decision, k, r)})" for r in broken]
        said.append(f"**{decision.designs[k]}** is out: {'; '.join(reasons)}.")
    return said


def bindings(decision: Decision) -> list[str]:
    """Of each requirement how many designs it excludes, and which of them no other requirement does."""
    said = []
    for r, requirement in enumerate(decision.requirements):
        quantity = decision.quantities[r]
        count, alone = int((decision.margins[:, r] < 0).sum()), decision.excluded_alone(r)
        bound = f"{_upper(wish_in_words(requirement, quantity))} {bound_in_words(requirement, quantity)}"
        without = f"; without it {listed_names(alone)} would do" if alone else "; each of them breaks another bound too"
        said.append(f"{bound} excludes {f'{count} of {len(decision.designs)}{without}' if count else 'no design'}.")
    return said


def trades(decision: Decision) -> list[str]:
    """Of each other design that keeps the requirements: what it is better at, or which design leaves it no reason.

    Of many, the first ones on the front.
    """
    said, ranking = [], decision.ranking if decision.preferences else []
    if len(ranking) > MOST_TOLD:
        front = [k for k in ranking if decision.front[k]]
        said.append(
            f"{len(front)} of the {len(ranking)} designs that keep every requirement are on the Pareto front; the "
            "others can be dropped."
        )
        ranking = front[:MOST_TOLD]
    for k in ranking:
        name = decision.designs[k]
        if not decision.front[k]:
            rival = decision.designs[_dominating(decision, k)]
            said.append(
                f"**{name}** can be dropped: {rival} is at least as good in everything and better in something."
            )
        elif k != decision.ranking[0]:
            said.append(f"**{name}** {_trade(decision, k)}; {_share(decision, k)} put it first.")
    return said


def _trade(decision: Decision, k: int) -> str:
    """A design against the one that is recommended."""
    first, count = decision.ranking[0], range(len(decision.preferences))
    gains = decision.worth[k] - decision.worth[first]
    better = sorted((j for j in count if gains[j] > 0), key=lambda j: -gains[j])
    worse = sorted((j for j in count if gains[j] < 0), key=lambda j: gains[j])
    told = [
        f"{_wish(decision, j)} is {_value(decision, k, j)} against {_value(decision, first, j)}"
        for j in (*better[:2], *worse[:2])
    ]
    split = min(len(better), 2)
    return f"is better at this: {listed_names(told[:split])}; the price: {listed_names(told[split:])}"


def changes_with_weights(decision: Decision) -> list[str]:
    """How far each weight can move alone before another design comes first."""
    if len(decision.preferences) < 2 or sum(decision.front) < 2:
        return []
    said, steady = [], []
    for j, preference in enumerate(decision.preferences):
        move, bounds = decision.move(j), []
        if move.below:
            bounds.append(f"below {move.low:.3g} {move.below} comes first")
        if move.above:
            bounds.append(f"above {move.high:.3g} {move.above}")
        if bounds:
            said.append(f"Weight of {_wish(decision, j)} ({preference.weight:g}): {', '.join(bounds)}.")
        else:
            steady.append(_wish(decision, j))
    if steady:
        said.append(f"No weight of {listed_names(steady)} alone changes what comes first.")
    small = [j for j in range(len(decision.preferences)) if 0 < _spread(decision, j) < ALIKE_SHARE]
    said += [
        f"The designs differ by {100 * _spread(decision, j):.1g} % in {_wish(decision, j)} alone: "
        "it deserves little weight."
        for j in small
    ]
    return said


def changes_with_circumstances(winners: Mapping[str, Sequence[tuple[Any, str | None]]]) -> list[str]:
    """Which design comes first in each circumstance, by its title, looked at by itself."""
    said = []
    for title, pairs in winners.items():
        names = list(dict.fromkeys(winner or "no design" for _, winner in pairs))
        if len(names) == 1:
            span = f"{plain_text(pairs[0][0])} to {plain_text(pairs[-1][0])}"
            said.append(f"{title}: {names[0]} at each value by itself ({span}).")
        else:
            parts = (
                (name, [plain_text(v) or "none" for v, winner in pairs if (winner or "no design") == name])
                for name in names
            )
            said.append(f"{title}: " + "; ".join(f"{name} at {listed_names(values)}" for name, values in parts) + ".")
    return said


def _numbers(true: np.ndarray) -> list[int]:
    return np.flatnonzero(true).tolist()


def _upper(text: str) -> str:
    return text[:1].upper() + text[1:]


def _share(decision: Decision, k: int) -> str:
    return f"{100 * decision.win_share[k]:.0f} % of all weights"


def _is_best(decision: Decision, k: int, j: int) -> bool:
    """Whether no design on the front is better, and some is worse by more than a little."""
    return decision.worth[k, j] == 1.0 and _spread(decision, j) > ALIKE_SHARE


def _spread(decision: Decision, j: int) -> float:
    """How much the designs on the front differ in a preference, as a share of the largest value."""
    values = decision.values.to_numpy(float)[decision.front, j]
    values = values[np.isfinite(values)]
    return float(np.ptp(values) / np.abs(values).max()) if len(values) and np.abs(values).max() > 0 else 0.0


def _dominating(decision: Decision, k: int) -> int:
    """The best ranked design that leaves no reason for design `k`."""
    scores = decision.scores
    return next(j for j in decision.ranking if np.all(scores[j] >= scores[k]) and np.any(scores[j] > scores[k]))


def _wish(decision: Decision, j: int) -> str:
    return wish_in_words(decision.preferences[j], decision.quantities[len(decision.requirements) + j])


def _value(decision: Decision, k: int, j: int) -> str:
    return value_in_words(decision.values.iloc[k, j], decision.quantities[len(decision.requirements) + j])


def _bounded(decision: Decision, k: int, r: int) -> str:
    requirement, quantity, value = decision.requirements[r], decision.quantities[r], decision.bounded[k, r]
    bound = bound_in_words(requirement, quantity)
    if not np.isfinite(value):
        return f"{wish_in_words(requirement, quantity)} has no value in some case, {bound} required"
    wanted = "allowed" if requirement.at_least is None else "required"
    return f"{wish_in_words(requirement, quantity)} is {value_in_words(value, quantity)}, {bound} {wanted}"


def _distance(decision: Decision, k: int, r: int) -> str:
    """`12 % off` or `12 % inside`, of the bound."""
    margin, limit = decision.margins[k, r], decision.requirements[r].limit
    if not np.isfinite(margin):
        return "nothing to go by" if margin < 0 else "far inside"
    side = "off" if margin < 0 else "inside"
    if not limit:
        return f"{value_in_words(abs(margin), decision.quantities[r])} {side}"
    return f"{100 * abs(margin):{'.0f' if abs(margin) > 0.1 else '.2g'}} % {side}"


def _tightest(decision: Decision, k: int) -> str:
    r = int(np.argmin(decision.margins[k]))
    return f"{_bounded(decision, k, r)} ({_distance(decision, k, r)})"


def _circumstance(name: str, value: Any) -> str:
    if name == "broken_cables":
        return "all cables intact" if value == "" else f"cables {value} broken"
    values = value if isinstance(value, list) else [value]
    between = ": " if isinstance(values[0], str) else " "
    return f"{describe(name).title.lower()}{between}{listed_names([plain_text(v) or 'none' for v in values])}"
