"""A decision in sentences: the recommendation and its reasons, excluded designs, and what would change the ranking."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from prb3r.model.files.cells import count
from prb3r.study.decision import Decision
from prb3r.study.phrases import (
    NO_EQUILIBRIUM,
    bound_in_words,
    capitalised,
    listed_names,
    preference_in_words,
    preferred_value_in_words,
    requirement_in_words,
    tightest_in_words,
    weights_in_words,
    wish_in_words,
)
from prb3r.study.wishes import plain_text

ALIKE_SHARE = 0.05
"""Relative difference in a preference below which designs are called alike."""
LEVEL = 0.02
"""Difference of scores below which designs are called level, as weights are not known that well."""
MOST_TOLD = 12
"""Largest number of designs that are described one by one."""


def recommendation(decision: Decision) -> str:
    """The recommended design with reasons; where no design keeps the requirements, the one that comes closest.

    Of a single design, whether it keeps them.
    """
    return " ".join(filter(None, [_verdict(decision), decision.remark]))


def _verdict(decision: Decision) -> str:
    """The recommendation without the remark on what tells designs apart."""
    if decision.alone:
        return _of_one(decision)
    if decision.winner is None:
        return _nothing_does(decision)
    k = decision.ranking[0]
    able = sum(map(bool, decision.feasible))
    whole = f"{able} of {count(len(decision.designs), 'design')} keep{'s' * (able == 1)} every requirement"
    head, said = f"Recommendation: {decision.winner}", list[str]()
    level = _level(decision)
    if len(level) > 1:
        head = f"{listed_names([decision.designs[j] for j in level])} are level"
        said += [whole] if decision.requirements else []
        said += _told_apart(decision, level)
    else:
        said += [f"{whole}; nearest to its bound, {tightest_in_words(decision, k)}"] if decision.requirements else []
        if decision.preferences:
            said += _ranked(decision, k)
        elif able > 1:
            said.append("no [[preference]] ranks them, and this one has the largest reserve")
    return f"**{head}.** " + " ".join(f"{capitalised(sentence)}." for sentence in said)


def _of_one(decision: Decision) -> str:
    """Whether the only design keeps the requirements: the one nearest to its bound, or all that it breaks."""
    name = capitalised(decision.designs[0])
    if decision.winner is not None:
        return f"**{name} keeps every requirement.** Nearest to its bound, {tightest_in_words(decision, 0)}."
    return f"**{name} does not keep every requirement**: {'; '.join(_broken(decision, 0))}."


def _broken(decision: Decision, k: int) -> list[str]:
    """The number and bound of each requirement that design `k` breaks, the worst first."""
    broken = sorted(_numbers(decision.margins[k] < 0), key=lambda r: decision.margins[k, r])
    return [requirement_in_words(decision, k, r) for r in broken]


def reserves(decision: Decision) -> list[str]:
    """A sentence for each requirement: the number of the only design, and how far it is inside or off the bound."""
    numbers = range(len(decision.requirements))
    return [f"{capitalised(requirement_in_words(decision, 0, r))}." for r in numbers]


def _level(decision: Decision) -> list[int]:
    """The first design and those on the Pareto front whose scores are hardly less, the best first."""
    front = [k for k in decision.ranking if decision.front[k]] if decision.preferences else decision.ranking[:1]
    return [k for k in front if decision.score[front[0]] - decision.score[k] < LEVEL]


def _told_apart(decision: Decision, level: list[int]) -> list[str]:
    """Sentences on what tells designs apart whose scores are level: what each is best in, and the reserves of each."""
    names = {k: decision.designs[k] for k in level}
    scores = listed_names([f"{decision.score[k]:.2f}" for k in level])
    said = [f"{_weighted(decision)} they score {scores}, which weights are not known well enough to tell apart"]
    best = [(k, words) for k in level if (words := _best_in(decision, k))]
    said += [f"{names[k]} has the best {listed_names(words)}" for k, words in best[:MOST_TOLD]]
    said.append("; ".join(f"{weights_in_words(decision, k)} put {names[k]} first" for k in level))
    if decision.requirements:
        first, second, *_ = sorted(level, key=lambda k: -decision.margins[k].min())
        ahead = decision.margins[first].min() - decision.margins[second].min()
        reserves = f"nearest to its bound, {tightest_in_words(decision, first)}; of {names[second]}, "
        reserves += tightest_in_words(decision, second)
        if ahead > ALIKE_SHARE:
            said.append(f"what speaks for {names[first]} is its reserve: {reserves}")
        else:
            said.append(f"their reserves do not tell them apart either: of {names[first]}, {reserves}")
    return said


def _ranked(decision: Decision, k: int) -> list[str]:
    """Sentences on why preferences put design `k` first."""
    front = [j for j, on in enumerate(decision.front) if on]
    if len(front) == 1:
        several = len(decision.ranking) > 1
        return ["none of the others that do is better in anything that was preferred"] if several else []
    words = _best_in(decision, k)
    second = next(other for other in decision.ranking[1:] if decision.front[other])
    against = f"{decision.score[k]:.2f} against {decision.score[second]:.2f} of {decision.designs[second]}"
    among = "" if all(decision.feasible) else "among these "
    every = len(front) == sum(map(bool, decision.feasible)) > 2
    return [
        *(
            ["none of them is beaten by another in everything that was preferred, so that weights alone decide"]
            if every
            else []
        ),
        *([f"{among}it has the best {listed_names(words)}"] if words else []),
        f"{_weighted(decision)} it scores {against}",
        f"{weights_in_words(decision, k)} put it first{_oftener_first(decision, k)}",
    ]


def _best_in(decision: Decision, k: int) -> list[str]:
    """The preferences by which design `k` is the best, each with its number, where designs differ noticeably."""
    best = [j for j in range(len(decision.preferences)) if _is_best(decision, k, j)]
    return [f"{preference_in_words(decision, j)} ({preferred_value_in_words(decision, k, j)})" for j in best]


def _weighted(decision: Decision) -> str:
    """By what weights scores are."""
    return f"at {'equal' if len(set(decision.weights)) == 1 else 'the given'} weights"


def _oftener_first(decision: Decision, k: int) -> str:
    """The design that comes first at a larger share of all weights than design `k`, if there is one."""
    other = int(np.argmax(decision.win_share))
    if round(100 * decision.win_share[other]) <= round(100 * decision.win_share[k]):
        return ""
    return f", but {100 * decision.win_share[other]:.0f} % put {decision.designs[other]} first"


def _nothing_does(decision: Decision) -> str:
    """That no design keeps the requirements, with the bounds that the design with the smallest shortfall breaks."""
    reserve = decision.margins.min(1, initial=np.inf)
    k = int(np.argmax(reserve))
    if not np.isfinite(reserve[k]):
        want = "no stable equilibrium in some case" if decision.unsolved.any(1).all() else "cases without a value"
        return f"**No design keeps every requirement**, and none comes close: each has {want}."
    short = _numbers(decision.margins[k] < 0)
    need = [requirement_in_words(decision, k, r) for r in short]
    return (
        f"**No design keeps every requirement.** {decision.designs[k]} comes closest: {listed_names(need)}. "
        "It would do if that were allowed."
    )


def exclusions(decision: Decision) -> list[str]:
    """A sentence for each excluded design, with the bounds it breaks, the worst first; of many, only their number."""
    out = _numbers(~decision.feasible)
    said = [f"{len(out)} of {len(decision.designs)} designs are out."] if len(out) > MOST_TOLD else []
    for k in out if len(out) <= MOST_TOLD else ():
        said.append(f"**{decision.designs[k]}** is out: {'; '.join(_broken(decision, k))}.")
    return said


def bindings(decision: Decision) -> list[str]:
    """A sentence for each requirement: how many designs it excludes, and which of these it alone excludes."""
    said = []
    for r, requirement in enumerate(decision.requirements):
        quantity = decision.quantities[r]
        out, alone = decision.margins[:, r] < 0, decision.excluded_alone(r)
        allowed = bound_in_words(requirement, quantity, decision.beside(r))
        bound = f"{capitalised(wish_in_words(requirement, quantity))} {allowed}"
        why = f"without it {listed_names(alone)} would do" if alone else _no_other_way(decision, out, r)
        said.append(f"{bound} excludes {f'{out.sum()} of {len(out)}; {why}' if out.any() else 'no design'}.")
    return said


def _no_other_way(decision: Decision, out: np.ndarray, r: int) -> str:
    """Why none of the designs in the mask `out` (d,), which break requirement `r`, would do without it."""
    unsolved = decision.unsolved[out, r]
    lost, more = f"is {NO_EQUILIBRIUM} in some case", "breaks another bound too"
    return f"each of them {lost if unsolved.all() else f'{more} or {lost}' if unsolved.any() else more}"


def trades(decision: Decision) -> list[str]:
    """A sentence for each design that keeps the requirements and is not recommended.

    It tells what the design is better and worse at, or which design dominates it.  Of many designs, only the best
    ranked ones on the Pareto front are described.  Without preferences there are no sentences.
    """
    said, ranking = [], decision.ranking if decision.preferences else []
    if len(ranking) > MOST_TOLD:
        front = [k for k in ranking if decision.front[k]]
        said.append(
            f"Of the {len(ranking)} designs that keep every requirement {len(front)} "
            f"{'is' if len(front) == 1 else 'are'} on the Pareto front; the others can be dropped."
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
            said.append(f"**{name}** {_trade(decision, k)}; {weights_in_words(decision, k)} put it first.")
    return said


def _trade(decision: Decision, k: int) -> str:
    """What design `k` is better and worse at than the recommended one, the two largest differences of each."""
    first, count = decision.ranking[0], range(len(decision.preferences))
    gains = decision.worth[k] - decision.worth[first]
    better = sorted((j for j in count if gains[j] > 0), key=lambda j: -gains[j])
    worse = sorted((j for j in count if gains[j] < 0), key=lambda j: gains[j])
    told = [
        f"{preference_in_words(decision, j)} is {preferred_value_in_words(decision, k, j)} "
        f"against {preferred_value_in_words(decision, first, j)}"
        for j in (*better[:2], *worse[:2])
    ]
    split = min(len(better), 2)
    return f"is better at this: {listed_names(told[:split])}; the price: {listed_names(told[split:])}"


def changes_with_weights(decision: Decision) -> list[str]:
    """Sentences on how far each weight can move alone before another design comes first, and on preferences in which
    designs hardly differ."""
    if len(decision.preferences) < 2 or sum(decision.front) < 2:
        return []
    said, steady = [], []
    for j, preference in enumerate(decision.preferences):
        move, bounds = decision.move(j), []
        if move.below:
            bounds.append(f"below {move.low:.3g} {move.below} comes first")
        if move.above:
            bounds.append(f"above {move.high:.3g} {move.above}{'' if move.below else ' comes first'}")
        if bounds:
            said.append(f"Weight of {preference_in_words(decision, j)} ({preference.weight:g}): {'; '.join(bounds)}.")
        else:
            steady.append(preference_in_words(decision, j))
    if steady:
        said.append(f"No weight of {listed_names(steady)} alone changes what comes first.")
    small = [j for j in range(len(decision.preferences)) if 0 < _spread(decision, j) < ALIKE_SHARE]
    said += [
        f"The designs differ by {100 * _spread(decision, j):.1g} % in {preference_in_words(decision, j)} alone: "
        "it deserves little weight."
        for j in small
    ]
    return said


def changes_with_circumstances(winners: Mapping[str, Sequence[tuple[Any, str | None]]]) -> list[str]:
    """A sentence for each circumstance: which design wins at which of its values.

    Parameters
    ----------
    winners : by title of the circumstance, its values with the winner, see `by_circumstance`.
    """
    said = []
    for title, pairs in winners.items():
        names = list(dict.fromkeys(winner or "no design" for _, winner in pairs))
        if len(names) == 1:
            first = f"{names[0]} comes first" if pairs[0][1] else "no design keeps every requirement"
            said.append(f"{title}: {first} at each value by itself ({_span([value for value, _ in pairs])}).")
        else:
            parts = (
                (name, [plain_text(v) or "none" for v, winner in pairs if (winner or "no design") == name])
                for name in names
            )
            said.append(f"{title}: " + "; ".join(f"{name} at {listed_names(values)}" for name, values in parts) + ".")
    return said


def kept_in_circumstances(winners: Mapping[str, Sequence[tuple[Any, str | None]]]) -> list[str]:
    """A sentence for each circumstance: at which of its values the only design keeps every requirement.

    `winners` are as in `changes_with_circumstances`.
    """
    said = []
    for title, pairs in winners.items():
        kept, broken = ([value for value, winner in pairs if bool(winner) == able] for able in (True, False))
        if kept and broken:
            at, off = (listed_names([plain_text(value) or "none" for value in some]) for some in (kept, broken))
            said.append(f"{title}: every requirement is kept at {at}, not at {off}.")
        else:
            which = "each value by itself" if kept else "no value by itself"
            said.append(f"{title}: every requirement is kept at {which} ({_span([value for value, _ in pairs])}).")
    return said


def _span(values: Sequence[Any]) -> str:
    """Numbers as `first to last`, names as a list."""
    texts = [plain_text(value) or "none" for value in values]
    return listed_names(texts) if any(isinstance(value, str) for value in values) else f"{texts[0]} to {texts[-1]}"


def _numbers(true: np.ndarray) -> list[int]:
    """Indices at which a mask is true."""
    return np.flatnonzero(true).tolist()


def _is_best(decision: Decision, k: int, j: int) -> bool:
    """Whether design `k` is the best by preference `j`, in which the designs on the front differ noticeably."""
    return decision.worth[k, j] == 1.0 and _spread(decision, j) > ALIKE_SHARE


def _spread(decision: Decision, j: int) -> float:
    """Range of the numbers of preference `j` on the front, as a share of the largest magnitude."""
    values = decision.values.to_numpy(float)[decision.front, j]
    values = values[np.isfinite(values)]
    return float(np.ptp(values) / np.abs(values).max()) if len(values) and np.abs(values).max() > 0 else 0.0


def _dominating(decision: Decision, k: int) -> int:
    """Index of the best ranked design that dominates design `k`."""
    scores = decision.scores
    return next(j for j in decision.ranking if np.all(scores[j] >= scores[k]) and np.any(scores[j] > scores[k]))
