"""Where the parts of a long array stand, from their lengths."""

from collections.abc import Iterable
from itertools import accumulate, pairwise


def spans_of(lengths: Iterable[int], first: int = 0) -> tuple[slice, ...]:
    """Adjacent slices of the given lengths; the first of them begins at index `first`."""
    return tuple(slice(start, stop) for start, stop in pairwise(accumulate(lengths, initial=first)))
