"""Proposed experiments: which one is carried out, and whether it has told two explanations apart."""

from prb3r.proof.judging.methods import kind_of, name_of
from prb3r.proof.judging.opened import OpenedCase, confident
from prb3r.proof.judging.verdict import ExperimentClaim, Verdict
from prb3r.proof.settings import SETTINGS


def promising(verdict: Verdict) -> ExperimentClaim | None:
    """The first proposal that promises to tell two explanations apart, which is carried out; None if there is none."""
    return next((proposal for proposal in verdict.proposals if proposal.separation >= SETTINGS.sizes.apart), None)


def tested(case: OpenedCase) -> ExperimentClaim | None:
    """The proposal of an ambiguous verdict that is carried out, if just one of its two effects is of the true kind.

    None if not, or for recordings of classes without a single true effect.
    """
    proposal = promising(case.verdict)
    if case.label.cls not in ("single", "confusable", "hidden") or case.verdict.verdict != "ambiguous":
        return None
    true = [] if proposal is None else [kind_of(name) == case.label.kinds[0] for name in proposal.names]
    return proposal if sum(true) == 1 else None


def resolved(first: OpenedCase, second: Verdict) -> bool:
    """Whether the verdict after the proposed experiment names the true kind first, and lists no more the rival that the
    experiment was to refute."""
    proposal, named = tested(first), confident(second)
    if proposal is None or not named or named[0].kind != first.label.kinds[0]:
        return False
    (rival,) = [name for name in proposal.names if kind_of(name) != first.label.kinds[0]]
    return all(rival != name_of(kind, place) for claim in named for kind, place, *_ in claim.rivals)
