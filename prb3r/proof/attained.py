"""Tells whether the search missed concealed effects or the recordings do not show them.

`python -m prb3r.proof.attained SEED CASES [CLASS...]` fits, after each diagnosis, the concealed effects to the same
readings under the same noise, and leaves them out one by one as in any backward elimination.  Where a part of the truth
is more probable than the best model that was found, the search has missed it; else the readings speak for what was
found, and no search could name more.
"""

import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from prb3r.diagnosis.blunders import without_blunders
from prb3r.diagnosis.evidence.model_evidence import log_evidence
from prb3r.diagnosis.fit.least_squares import fit, polished
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.known import Searched, Task
from prb3r.diagnosis.library.hypothesis import FORMS, Hypothesis
from prb3r.diagnosis.search.apply import serially
from prb3r.errors import Prb3rError
from prb3r.proof.arguments import of_a_run
from prb3r.proof.concealed.composition import drawn_design, flavours, requests
from prb3r.proof.concealed.folder import recording_from_folder
from prb3r.proof.concealed.real import REAL_CLASSES, real_label
from prb3r.proof.judging.opened import places_agree
from prb3r.proof.rig.effects import RECORDS
from prb3r.proof.settings import SETTINGS


class Attained(NamedTuple):
    """Evidence of the model that a search has found, and of the best part of the truth."""

    chosen: float
    """ln evidence of the most probable model of the search."""
    possible: float
    """Largest ln evidence of the concealed effects together or of a part of them; -inf where they cannot be fitted."""
    effects: tuple[str, ...]
    """Names of the effects of that part."""

    @property
    def missed(self) -> bool:
        """Whether a part of the truth is clearly more probable than what the search has found."""
        return self.possible > self.chosen + SETTINGS.protocol.bare_mention


def attained(searched: Searched, concealed: Sequence[Mapping[str, Any]]) -> Attained:
    """The evidence of a search's best model beside that of the best part of the `concealed` effects (tables of a
    manipulator file)."""
    choice, search = searched.choice, searched.tested.doubted.search
    best = choice.survivors[0]
    parts = list(_parts(best.fitted, _whole(best.fitted, search.library, concealed)))
    worth = [log_evidence(part, search.log_odds) for part in parts]
    if not parts:
        return Attained(best.log_evidence, -np.inf, ())
    names = tuple(hypothesis.name for hypothesis in parts[int(np.argmax(worth))].model.hypotheses)
    return Attained(best.log_evidence, max(worth), names)


def _whole(best: Fit, library: Sequence[Hypothesis], concealed: Sequence[Mapping[str, Any]]) -> Fit | None:
    """The fit of all concealed effects that the library holds, from their true sizes on; None without equilibrium."""
    constants, friction = best.p[: len(best.model.varied)], best.model.friction(best.p)
    starts: dict[Hypothesis, np.ndarray] = {}
    for effect in concealed:
        alike = hypotheses_on(effect, library)
        if not any(hypothesis.excludes(other) for hypothesis in alike[:1] for other in starts):
            starts |= {hypothesis: _size(hypothesis, effect, friction) for hypothesis in alike[:1]}
    model = replace(best.model, hypotheses=tuple(starts))
    fitted = fit(model, np.concatenate([constants, *starts.values()]))
    return None if fitted is None else polished(fitted)


def hypotheses_on(effect: Mapping[str, Any], library: Sequence[Hypothesis]) -> list[Hypothesis]:
    """The hypotheses of a library that an effect (a table of a manipulator file) may be: of its kind, at its place, and
    of its law, side, sections and stages where it has them; plates slip in one stage where no number is told."""
    names = {*RECORDS[effect["kind"]].places, *(name for name in FORMS if name in effect)}
    found = []
    for hypothesis in library:
        place = {"elements": 1, **dict(hypothesis.place)}
        if hypothesis.kind == effect["kind"] and all(places_agree(place.get(name), effect.get(name)) for name in names):
            found.append(hypothesis)
    return found


def _size(hypothesis: Hypothesis, effect: Mapping[str, Any], friction: float) -> np.ndarray:
    """(k,) free parameters of a hypothesis at the true size; the start of a fit if the effect lacks one of them."""
    if any(free.name not in effect for free in hypothesis.free):
        return hypothesis.starts(friction)[0]
    return np.array([free.at(effect[free.name], friction) for free in hypothesis.free])


def _parts(best: Fit, whole: Fit | None) -> Iterator[Fit]:
    """The fit of all effects, then those with ever fewer of them, as the effect goes whose loss costs least chi-square;
    at last that of the constants alone.  Nothing if `whole` is None."""
    while whole is not None:
        yield whole
        model, p = whole.model, whole.p
        fewer = [fit(model.without(k), model.without_share(p, k)) for k in range(len(model.hypotheses))]
        whole = min((fitted for fitted in fewer if fitted), key=lambda fitted: fitted.chi2, default=None)


def attained_in_run(seed: int, cases: int, classes: Collection[str]) -> Iterator[tuple[int, Attained]]:
    """Number and outcome of every recording of a run of some classes, except those without equilibrium or verdict."""
    designs = [drawn_design((seed, k, flavour)) for k, flavour in enumerate(flavours(cases, classes))]
    for request in requests(seed, cases, designs, classes):
        try:
            label = real_label(request, designs[request.design])
            task = Task(recording_from_folder(designs[request.design], label), seed)
            searched = without_blunders(task, lambda stage: None, serially).searched
        except (ValueError, RuntimeError, Prb3rError):
            continue
        yield request.case, attained(searched, label.effects)


if __name__ == "__main__":
    asked = of_a_run(str(__doc__), REAL_CLASSES, default=("several",))
    for case, outcome in attained_in_run(asked.seed, asked.cases, asked.classes):
        lead, effects = outcome.possible - outcome.chosen, ", ".join(outcome.effects) or "nothing"
        said = "missed" if outcome.missed else "attained"
        sys.stdout.write(f"{case}: {said}; {effects} {lead:+.1f} in ln evidence against what was found\n")
        sys.stdout.flush()
