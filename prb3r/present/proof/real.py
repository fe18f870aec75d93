"""Tables of the benchmark on real rigs: how often effects of each kind and blunders of each kind are named."""

from collections import Counter
from collections.abc import Sequence

from prb3r.markdown import markdown_table
from prb3r.proof.judging.opened import OpenedCase
from prb3r.proof.judging.real_scores import HAS_SEVERAL, blunder_said, named_of
from prb3r.proof.prove import Proof
from prb3r.proof.settings import SETTINGS


def real_section(proof: Proof) -> list[str]:
    """Lines of Markdown: tables of recordings with several effects and of those with a blunder; empty without any."""
    several = [case for case in proof.main if HAS_SEVERAL(case)]
    blundered = [case for case in proof.main if case.label.blunder]
    lines: list[str] = []
    if several:
        lines += _by_kind(several)
    if blundered:
        lines += _by_blunder(blundered)
    return lines


def _by_kind(cases: Sequence[OpenedCase]) -> list[str]:
    """A row for each kind of effect: how many are named, how many were too small to count, what is named instead."""
    worth = SETTINGS.real.worth
    lines = [
        "## Several effects, by kind",
        "",
        f"Of those that other loads show by at least {worth:g} sd of a reading (root mean square, constants and frame "
        "refitted): how many are named. *In their place*: kinds that are not there, in recordings where one is missed.",
        "",
    ]
    rows = []
    for kind in sorted({kind for case in cases for kind in case.label.kinds}):
        hits, small, instead = list[bool](), 0, Counter[str]()
        for case in cases:
            effects = zip(case.label.kinds, named_of(case), case.label.worth, strict=True)
            for hit, value in ((hit, value) for true, hit, value in effects if true == kind):
                small += value < worth
                hits += [hit] if value >= worth else []
                if value >= worth and not hit:
                    instead.update({c.kind for c in case.verdict.named} - set(case.label.kinds) or {"nothing"})
        others = ", ".join(f"{name} {count}" for name, count in instead.most_common(3))
        rows.append([kind, f"{sum(hits)} of {len(hits)}", str(small), others])
    return [*lines, *markdown_table(("effect", "named", "smaller ones", "in their place"), rows), ""]


def _by_blunder(cases: Sequence[OpenedCase]) -> list[str]:
    """A row for each kind of blunder: how many are said, and what is said in place of the others."""
    rows = []
    for kind in sorted({case.label.blunder["kind"] for case in cases if case.label.blunder}):
        alike = [case for case in cases if case.label.blunder and case.label.blunder["kind"] == kind]
        wrong = [
            case.verdict.setup[0][0] if case.verdict.setup else case.verdict.verdict
            for case in alike
            if not blunder_said(case)
        ]
        rows.append([kind, f"{sum(map(blunder_said, alike))} of {len(alike)}", "; ".join(wrong[:3])])
    return ["## Blunders of the set-up", "", *markdown_table(("blunder", "said", "else"), rows)]
