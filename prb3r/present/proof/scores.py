"""The table of scores in Markdown."""

import math

from prb3r.markdown import markdown_table
from prb3r.proof.judging.goals import Goal
from prb3r.proof.judging.intervals import Score
from prb3r.proof.prove import MAIN, Proof
from prb3r.proof.settings import SETTINGS

NOT_SHARES = ("held-out chi-square", "real rigs,")
"""Scores whose names begin so are plain numbers; all others are shares, shown in percent."""


def scores_table(proof: Proof) -> list[str]:
    """Lines of a Markdown table: every score of the main method with its goal and interval, and those of the others.

    Other methods may have judged only a part of the recordings.
    """
    others = [name for name in proof.cases if name != MAIN]
    beside = {name: {goal.name: score for goal, score in proof.scores(name)} for name in others}
    rows = [
        [
            goal.name,
            goal_text(goal),
            score_text(goal, score.value),
            _interval(goal, score),
            str(score.count),
            _answer(goal.met(score)),
            _answer(goal.shown(score)),
            *(_beside(goal, beside[name][goal.name]) for name in others),
        ]
        for goal, score in proof.scores()
    ]
    confidence = f"{100 * SETTINGS.protocol.confidence:g} % interval"
    return markdown_table(["score", "goal", MAIN, confidence, "n", "met", "shown", *others], rows)


def goal_text(goal: Goal) -> str:
    """The bound on a score, such as `≥ 90 %`; empty if the score has no goal."""
    if not goal.relation:
        return ""
    if goal.name.startswith(NOT_SHARES):
        return f"{goal.relation} {goal.asked[0]:g}".replace("<=", "≤").replace(">=", "≥")
    asked = "-".join(f"{100 * share:g}" for share in goal.asked)
    return f"{goal.relation} {asked} %".replace("in ", "").replace("<=", "≤").replace(">=", "≥")


def score_text(goal: Goal, value: float) -> str:
    """A score, or an end of its interval, as text: in percent if it is a share, a dash if it is not finite."""
    if not math.isfinite(value):
        return "–"
    return f"{value:.3g}" if goal.name.startswith(NOT_SHARES) else f"{100 * value:.1f} %"


def _interval(goal: Goal, score: Score) -> str:
    return f"{score_text(goal, score.low)} to {score_text(goal, score.high)}" if score.count else "–"


def _beside(goal: Goal, score: Score) -> str:
    """The score of another method, with the number of recordings that it is over in brackets."""
    return f"{score_text(goal, score.value)} ({score.count})" if score.count else "–"


def _answer(answer: bool | None) -> str:
    return "" if answer is None else "yes" if answer else "**no**"
