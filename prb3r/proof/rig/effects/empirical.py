"""A fitted moment law without a mechanism, which a diagnosis writes for an unexplained recording; never concealed.

It acts on arc and hinges alike, as a couple from disk to disk beside the plate would; the rig has only the terms of
`constant`, `position` and `bend`.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from prb3r.proof.rig.draft import Draft
from prb3r.proof.rig.effects.record import EffectParameter, Record


def _act(draft: Draft, terms):
    numbers = np.array(draft.plates)
    for term in terms:
        acting = term["coefficient"] * np.isin(numbers, term.get("plates", numbers))
        if term["of"] == "bend":
            draft.moment_per_bend += acting
        elif term["of"] == "position":
            draft.moment += acting * (2 * (numbers - 1) / max(len(numbers) - 1, 1) - (len(numbers) > 1))
        else:
            draft.moment += acting


def _known(value: Any, _: Draft) -> str:
    """Check of a list of terms: each has a quantity that the rig has."""
    if not isinstance(value, Sequence) or isinstance(value, str) or not value:
        return f"must be a list of terms, not {value!r}"
    known = [isinstance(term, dict) and term.get("of") in ("constant", "position", "bend") for term in value]
    return "" if all(known) else "the rig has terms of constant, position and bend only"


EMPIRICAL_RECORDS = (Record("empirical_moment", _act, (EffectParameter("terms", _known),)),)
