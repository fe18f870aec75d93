"""The recommendation of a decision in sentences: the design that comes first, or those that are level, with reasons."""

import numpy as np

from prb3r.model.files.cells import count
from prb3r.study.decision import Decision
from prb3r.study.phrases import (
    capitalised,
    listed_names,
    preference_in_words,
    preferred_value_in_words,
    requirement_in_words,
    tightest_in_words,
    weights_in_words,
)

ALIKE_SHARE = 0.05
"""Relative difference in a preference below which designs are called alike."""
LEVEL = 0.02
"""Difference of scores below which designs are called level, as weights are not known that well."""
MOST_LEVEL = 3
"""Largest number of level designs that are told by name; of more the best in each preference, and a compromise.
Choice: names of designs are long."""
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
    if len(level) > MOST_LEVEL:
        head = f"{len(level)} designs are level"
        said += [whole] if decision.requirements else []
        said += _many_level(decision, level)
    elif len(level) > 1:
        head = f"{listed_names([decision.designs[j] for j in level])} are level"
        said += [whole] if decision.requirements else []
        said += _told_apart(decision, level)
    else:
        said += [f"{whole}; nearest to its bound, {tightest_in_words(decision, k)}"] if decision.requirements else []
        if decision.preferences:
            said += _ranked(decision, k)
        elif able > 1:
            said.append("no [[preference]] ranks them, and this one has the largest reserve")
    said += _failing(decision, level)
    return f"**{head}.** " + " ".join(f"{capitalised(sentence)}." for sentence in said)


def _failing(decision: Decision, told: list[int]) -> list[str]:
    """Sentences on cases in which designs fail, so that preferences leave them out: of those `told`, and of all."""
    if not decision.failed:
        return []
    cases = count(decision.shared, "case")
    said = [
        f"in {decision.fails[k]} of {cases} {decision.designs[k]} has no stable equilibrium"
        for k in told
        if decision.fails[k]
    ]
    left = decision.shared - decision.failed
    over = f"the {left} of {cases} in which no design fails" if left else "no case, as a design fails in each"
    return [*said, f"preferences are over {over}"]


def _of_one(decision: Decision) -> str:
    """Whether the only design keeps the requirements: the one nearest to its bound, or all that it breaks."""
    name = capitalised(decision.designs[0])
    if decision.winner is not None:
        return f"**{name} keeps every requirement.** Nearest to its bound, {tightest_in_words(decision, 0)}."
    return f"**{name} does not keep every requirement**: {'; '.join(broken_bounds(decision, 0))}."


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


def _many_level(decision: Decision, level: list[int]) -> list[str]:
    """Sentences on many designs whose scores are level: the best in each preference, and the one that gives up least
    of any."""
    scores = decision.score[level]
    said = [
        f"{_weighted(decision)} they score {scores.max():.2f} to {scores.min():.2f}, which weights are not known well "
        "enough to tell apart"
    ]
    best = [(k, words) for k in level if (words := _best_in(decision, k))]
    said += [f"{decision.designs[k]} has the best {listed_names(words)}" for k, words in best]
    behind = decision.worth[level].max(0) - decision.worth[level]
    k = level[int(np.argmin(behind.max(1)))]
    if k not in dict(best):
        all_of_it = range(len(decision.preferences))
        has = [f"{preference_in_words(decision, j)} {preferred_value_in_words(decision, k, j)}" for j in all_of_it]
        said.append(f"the one between them that gives up least is {decision.designs[k]}: {listed_names(has)}")
    if decision.requirements:
        said.append(f"nearest to its bound, {tightest_in_words(decision, k)}")
    return said


def _ranked(decision: Decision, k: int) -> list[str]:
    """Sentences on why preferences put design `k` first."""
    front = [j for j, on in enumerate(decision.front) if on]
    if len(front) == 1:
        several = len(decision.ranking) > 1
        others = "none of the others that do" if decision.requirements else "no other design"
        return [f"{others} is better in anything that was preferred"] if several else []
    words = _best_in(decision, k)
    second = next(other for other in decision.ranking[1:] if decision.front[other])
    against = f"{decision.score[k]:.2f} against {decision.score[second]:.2f} of {decision.designs[second]}"
    among = "" if all(decision.feasible) else "among these "
    unknown = [preference_in_words(decision, j) for j in indices(np.isneginf(decision.scores[k]))]
    every = len(front) == sum(map(bool, decision.feasible)) > 2
    return [
        *(
            ["none of them is beaten by another in everything that was preferred, so that weights alone decide"]
            if every
            else []
        ),
        *([f"{among}it has the best {listed_names(words)}"] if words else []),
        *([f"of {listed_names(unknown)} it has no value"] if unknown else []),
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
    short = indices(decision.margins[k] < 0)
    need = [requirement_in_words(decision, k, r) for r in short]
    return (
        f"**No design keeps every requirement.** {decision.designs[k]} comes closest: {listed_names(need)}. "
        "It would do if that were allowed."
    )


def _is_best(decision: Decision, k: int, j: int) -> bool:
    """Whether design `k` is the best by preference `j`, in which the designs on the front differ noticeably."""
    return decision.worth[k, j] == 1.0 and spread_on_front(decision, j) > ALIKE_SHARE


def broken_bounds(decision: Decision, k: int) -> list[str]:
    """The number and bound of each requirement that design `k` breaks, the worst first."""
    broken = sorted(indices(decision.margins[k] < 0), key=lambda r: decision.margins[k, r])
    return [requirement_in_words(decision, k, r) for r in broken]


def spread_on_front(decision: Decision, j: int) -> float:
    """Range of the numbers of preference `j` on the front, as a share of the largest magnitude."""
    values = decision.values.to_numpy(float)[decision.front, j]
    values = values[np.isfinite(values)]
    return float(np.ptp(values) / np.abs(values).max()) if len(values) and np.abs(values).max() > 0 else 0.0


def indices(true: np.ndarray) -> list[int]:
    """Indices at which a mask is true."""
    return np.flatnonzero(true).tolist()
