"""Labels under seal: their hash is known before any verdict, their contents only once all verdicts are in."""

import hashlib
import json
import zlib
from collections.abc import Collection, Sequence

from prb3r.errors import EngineError, Problem
from prb3r.proof.concealed.labels import Label


class Seal:
    """Labels as bytes; :meth:`opened` gives them back once there is a verdict for each."""

    def __init__(self, labels: Sequence[Label]) -> None:
        content = json.dumps([label.plain() for label in labels], sort_keys=True, default=float).encode()
        self.digest = hashlib.sha256(content).hexdigest()
        """SHA-256 of the labels, printed before the first diagnosis."""
        self._cases = frozenset(label.case for label in labels)
        self._content = zlib.compress(content)

    def opened(self, verdicts: Collection[int]) -> list[Label]:
        """The labels.

        Parameters
        ----------
        verdicts : cases for which there is a verdict, a failure counting as one.

        Raises
        ------
        EngineError
            If a verdict is missing, or if the content does not have the hash.
        """
        if missing := self._cases - set(verdicts):
            raise EngineError(Problem("seal", f"stays closed: {len(missing)} verdicts are missing"))
        content = zlib.decompress(self._content)
        if hashlib.sha256(content).hexdigest() != self.digest:
            raise EngineError(Problem("seal", "the labels are not those that were sealed"))
        return [Label(**{name: _tuples(value) for name, value in label.items()}) for label in json.loads(content)]


def _tuples(value):
    """A value read from JSON with tuples in place of lists."""
    return tuple(map(_tuples, value)) if isinstance(value, list) else value
