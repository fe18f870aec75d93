"""Phrases for sentences about a decision: names of criteria, their bounds, values and distances from a bound."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from prb3r.markdown import listed
from prb3r.mechanics.equilibrium import Outcome
from prb3r.model.files.cells import count
from prb3r.quantities import SHORT_FOR, Quantity, describe
from prb3r.study.chunk import CASE_CRASHED, CASE_FAILED
from prb3r.study.decision import Decision
from prb3r.study.designs import value_in_words
from prb3r.study.wishes import Criterion, Requirement, plain_text

MOST_NAMED = 6
"""Largest number of names that are listed in a sentence."""
UNBOUNDED = "without bound"
"""What is said of an infinite value."""


def wish_in_words(criterion: Criterion, quantity: Quantity) -> str:
    """The number that a criterion bounds or prefers, in words, as the subject of a sentence.

    A criterion's own words stand for the quantity and its circumstances; over what it is taken is told beside them.
    """
    over = f"{criterion.quantile:g} quantile" if criterion.quantile is not None else criterion.over
    about = [] if criterion.over == "worst" else [over]
    title = criterion.words or quantity.title[:1].lower() + quantity.title[1:]
    if not criterion.words:
        about += [_circumstance(name, value) for name, value in criterion.where.items()]
    return f"{title} ({', '.join(about)})" if about else title


def bound_in_words(requirement: Requirement, quantity: Quantity, beside: Sequence[float] = ()) -> str:
    """The bound of a requirement, such as `at most 150 N`, in a unit that suits the values `beside` it too."""
    side = "at most" if requirement.at_least is None else "at least"
    return f"{side} {value_in_words(requirement.limit, quantity, beside)}"


def known_in_words(value: float, quantity: Quantity, beside: Sequence[float] = (), sign: float = 0.0) -> str:
    """A value as `value_in_words` tells it, but `UNBOUNDED` if it is infinite.

    By the `sign` of a criterion, an infinitely bad value stands for a missing one and is a dash.
    """
    unbounded = np.isinf(value) and not float(value) * sign < 0
    return UNBOUNDED if unbounded else value_in_words(value, quantity, beside)


def listed_names(names: Sequence[str]) -> str:
    """Names as a list in a sentence; of many, the first ones and the number of the others.

    They are separated by semicolons where one of them has a comma, which would look like the end of the name; where one
    has "and", all are in quotation marks.
    """
    names = [f'"{name}"' for name in names] if any(" and " in name for name in names[:MOST_NAMED]) else list(names)
    commas = any("," in name for name in names)
    if len(names) > MOST_NAMED:
        names = [*names[: MOST_NAMED - 1], f"{len(names) - MOST_NAMED + 1} more"]
    return f"{'; '.join(names[:-1])}; and {names[-1]}" if commas and len(names) > 1 else listed(names)


NO_EQUILIBRIUM = "without a stable equilibrium"
FAILURE_IN_WORDS = {Outcome.DETOUR.label: "reached by a detour alone", CASE_FAILED: "failed", CASE_CRASHED: "crashed"}
"""What is said of cases by their outcome; `NO_EQUILIBRIUM` of all others but converged ones."""


def failures_in_words(outcomes: Mapping[str, int], of: str = "") -> str:
    """How many cases did not converge and why, from the number of cases by outcome; empty if all did.

    Such as `2 without a stable equilibrium and 1 failed`; `of` follows the first number: `2 of them ...`.
    """
    counts = dict.fromkeys((NO_EQUILIBRIUM, *FAILURE_IN_WORDS.values()), 0)
    for outcome, number in outcomes.items():
        if outcome != Outcome.CONVERGED.label:
            counts[FAILURE_IN_WORDS.get(outcome, NO_EQUILIBRIUM)] += number
    told = [(words, number) for words, number in counts.items() if number]
    return listed([f"{number:,} {of * (not k)}{words}" for k, (words, number) in enumerate(told)]) if told else ""


def capitalised(text: str) -> str:
    """A text with a capital first letter, its other letters unchanged."""
    return text[:1].upper() + text[1:]


def weights_in_words(decision: Decision, k: int) -> str:
    """The share of weights at which design `k` comes first, such as `40 % of all weights`."""
    return f"{100 * decision.win_share[k]:.0f} % of all weights"


def preference_in_words(decision: Decision, j: int) -> str:
    """The number of preference `j` (from 0) in words, as the subject of a sentence."""
    return wish_in_words(decision.preferences[j], decision.quantities[len(decision.requirements) + j])


def preferred_value_in_words(decision: Decision, k: int, j: int) -> str:
    """The number of design `k` by preference `j`, with its unit."""
    c, sign = len(decision.requirements) + j, decision.preferences[j].sign
    return known_in_words(decision.values.iloc[k, j], decision.quantities[c], decision.beside(c), sign)


def told_apart(decision: Decision, k: int, other: int, j: int) -> list[str]:
    """The numbers of two designs by preference `j`, with the unit, and by how much they differ where three digits do
    not tell; "not to be had" in the place of a missing one."""
    pair, sign = decision.values.iloc[[k, other], j].to_numpy(float), decision.preferences[j].sign
    words = [preferred_value_in_words(decision, design, j) for design in (k, other)]
    if words[0] == words[1]:
        gap = value_in_words(abs(pair[0] - pair[1]), decision.quantities[len(decision.requirements) + j])
        words[0] += f" ({'more' if pair[0] > pair[1] else 'less'} by {gap})"
    lacking = [np.isnan(value) or value * sign == -np.inf for value in pair]
    return ["not to be had" if none else text for none, text in zip(lacking, words, strict=True)]


def requirement_in_words(decision: Decision, k: int, r: int) -> str:
    """Number of design `k` and bound of requirement `r`: `drive tension is 162 N, at most 150 N allowed (8 % off)`."""
    requirement, quantity, value = decision.requirements[r], decision.quantities[r], decision.bounded[k, r]
    beside = decision.beside(r)
    wish, bound = wish_in_words(requirement, quantity), bound_in_words(requirement, quantity, beside)
    distance = _distance(decision.margins[k, r], requirement, quantity, decision.beside(r))
    if np.isinf(value) and decision.margins[k, r] > 0:
        return f"{wish} is {UNBOUNDED}, {bound} required ({distance})"
    if not np.isfinite(value):
        missing = decision.missing.get((k, r))
        where = f" in {missing.count} of {count(missing.of, 'case')}" if missing else ""
        why = (missing and missing.reason) or quantity.if_empty or distance
        return f"{wish} has no value{where}, {bound} required ({why})"
    wanted = "allowed" if requirement.at_least is None else "required"
    return f"{wish} is {value_in_words(value, quantity, beside)}, {bound} {wanted} ({distance})"


def tightest_in_words(decision: Decision, k: int) -> str:
    """Number of design `k` and bound of the requirement with its smallest margin, as in `requirement_in_words`."""
    return requirement_in_words(decision, k, int(np.argmin(decision.margins[k])))


def _distance(margin: float, requirement: Requirement, quantity: Quantity, beside: Sequence[float]) -> str:
    """Distance from the bound, such as `12 % off` or `12 % inside`; in the unit of the bound where that is 0."""
    if not np.isfinite(margin):
        return "nothing to go by" if margin < 0 else "far inside"
    side = "off" if margin < 0 else "inside"
    if not requirement.limit:
        return f"{value_in_words(abs(margin), quantity, beside)} {side}"
    return f"{100 * abs(margin):{'.0f' if abs(margin) > 0.1 else '.2g'}} % {side}"


def _circumstance(name: str, value: Any) -> str:
    """A condition on cases in words: the factor with its value or values, or the broken cables."""
    if name == "broken_cables":
        return "all cables intact" if value == "" else f"cables {value} broken"
    values = value if isinstance(value, list) else [value]
    between = ": " if isinstance(values[0], str) else " "
    title = describe(SHORT_FOR.get(name, name)).title.lower()
    return f"{title}{between}{listed_names([plain_text(v) or 'none' for v in values])}"
