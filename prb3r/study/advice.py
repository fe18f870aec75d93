"""What else a decision tells, in sentences: excluded designs, what excludes them, and what would change the ranking."""

from collections.abc import Mapping, Sequence

import numpy as np

from prb3r.study.decision import Decision
from prb3r.study.phrases import (
    NO_EQUILIBRIUM,
    bound_in_words,
    capitalised,
    listed_names,
    preference_in_words,
    requirement_in_words,
    told_apart,
    weights_in_words,
    wish_in_words,
)
from prb3r.study.recommend import ALIKE_SHARE, MOST_TOLD, broken_bounds, indices, spread_on_front


def reserves(decision: Decision) -> list[str]:
    """A sentence for each requirement: the number of the only design, and how far it is inside or off the bound."""
    numbers = range(len(decision.requirements))
    return [f"{capitalised(requirement_in_words(decision, 0, r))}." for r in numbers]


def exclusions(decision: Decision) -> list[str]:
    """A sentence for each excluded design, with the bounds it breaks, the worst first; of many, only their number."""
    out = indices(~decision.feasible)
    said = [f"{len(out)} of {len(decision.designs)} designs are out."] if len(out) > MOST_TOLD else []
    for k in out if len(out) <= MOST_TOLD else ():
        said.append(f"**{decision.designs[k]}** is out: {'; '.join(broken_bounds(decision, k))}.")
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
        f"{preference_in_words(decision, j)} is {' against '.join(told_apart(decision, k, first, j))}"
        for j in (*better[:2], *worse[:2])
    ]
    gain, price = told[: min(len(better), 2)], told[min(len(better), 2) :]
    said = [f"is better at this: {listed_names(gain)}"] if gain else []
    said += [f"the price: {listed_names(price)}"] if price else []
    return "; ".join(said) or "is as good in everything"


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
    small = [j for j in range(len(decision.preferences)) if 0 < spread_on_front(decision, j) < ALIKE_SHARE]
    said += [
        f"The designs differ by {100 * spread_on_front(decision, j):.1g} % in {preference_in_words(decision, j)} "
        "alone: it deserves little weight."
        for j in small
    ]
    return said


def changes_with_circumstances(winners: Mapping[str, Sequence[tuple[str, str | None]]]) -> list[str]:
    """A sentence for each circumstance: which design wins at which of its values.

    Parameters
    ----------
    winners : by title of the circumstance, its values in words with the winner, see `by_circumstance`.
    """
    said = []
    for title, pairs in winners.items():
        names = list(dict.fromkeys(winner or "no design" for _, winner in pairs))
        if len(names) == 1:
            first = f"{names[0]} comes first" if pairs[0][1] else "no design will do"
            said.append(f"{title}: {first} at each value by itself ({_span([value for value, _ in pairs])}).")
        else:
            parts = ((name, [value for value, winner in pairs if (winner or "no design") == name]) for name in names)
            said.append(f"{title}: " + "; ".join(f"{name} at {listed_names(values)}" for name, values in parts) + ".")
    return said


def kept_in_circumstances(winners: Mapping[str, Sequence[tuple[str, str | None]]]) -> list[str]:
    """A sentence for each circumstance: at which of its values the only design keeps every requirement.

    `winners` are as in `changes_with_circumstances`.
    """
    said = []
    for title, pairs in winners.items():
        kept, broken = ([value for value, winner in pairs if bool(winner) == able] for able in (True, False))
        if kept and broken:
            at, off = listed_names(kept), listed_names(broken)
            said.append(f"{title}: every requirement is kept at {at}, not at {off}.")
        else:
            which = "each value by itself" if kept else "no value by itself"
            said.append(f"{title}: every requirement is kept at {which} ({_span([value for value, _ in pairs])}).")
    return said


def _span(values: Sequence[str]) -> str:
    """Numbers in words as `first to last`, names as a list."""
    if not all(value.removeprefix("−")[:1].isdigit() for value in values):
        return listed_names(values)
    first, last = (value.partition(" ") for value in (values[0], values[-1]))
    return f"{first[0] if first[2] == last[2] else values[0]} to {values[-1]}"


def _dominating(decision: Decision, k: int) -> int:
    """Index of the best ranked design that dominates design `k`."""
    scores = decision.scores
    return next(j for j in decision.ranking if np.all(scores[j] >= scores[k]) and np.any(scores[j] > scores[k]))
