"""Plain data, as a file holds it: dictionaries, lists, numbers and text."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from pydantic import BaseModel


def plain(value: Any) -> Any:
    """`value` as plain data: models and mappings as dictionaries without keys that hold None, tuples as lists, NumPy
    values as Python's.  Objects of other types are returned unchanged."""
    if isinstance(value, BaseModel):
        return plain(value.model_dump(by_alias=True))
    if isinstance(value, Mapping):
        return {key: plain(inner) for key, inner in value.items() if inner is not None}
    if isinstance(value, list | tuple):
        return [plain(inner) for inner in value]
    return value.tolist() if isinstance(value, np.generic | np.ndarray) else value
