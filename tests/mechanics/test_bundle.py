"""Bundles: compiled code reads what Python put into them, writes what Python reads, and keeps nothing."""

import weakref
from typing import NamedTuple

import numpy as np
import pytest

from prb3r.mechanics import kernel as compiling
from prb3r.mechanics.bundle import alike, bundle
from prb3r.mechanics.code_cache import cache_folder
from prb3r.mechanics.kernel import entrance, kernel


@bundle
class Inner(NamedTuple):
    number: np.ndarray
    table: np.ndarray


@bundle
class Outer(NamedTuple):
    before: np.ndarray
    inner: Inner
    after: np.ndarray


def bundled(rows=2):
    table = np.arange(3.0 * rows).reshape(rows, 3)
    return Outer(np.array([1, 2], np.int64), Inner(np.array([10.0]), table), np.zeros((rows, 3)))


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(compiling, "own_folder", lambda: str(cache_folder()))


@kernel
def transfer(inner, into):
    for i in range(inner.table.shape[0]):
        for k in range(inner.table.shape[1]):
            into[i, k] = inner.number[0] * inner.table[i, k]
    inner.number[0] += 1.0


def test_fields_are_read_and_written_where_python_has_them():
    @entrance
    def twice(outer):
        for _ in range(outer.before[1]):
            transfer(outer.inner, outer.after)
        return outer.before[0]

    for rows in (1, 4):  # sizes are no part of the kind
        outer = bundled(rows)
        assert twice(outer) == 1
        assert outer.inner.number[0] == 12.0
        assert (outer.after == 11.0 * outer.inner.table).all()
    assert len(twice.signatures) == 1


def test_a_bundle_that_is_alike_has_the_other_fields():
    @entrance
    def first_rows(outer):
        inner = outer.inner
        for i in range(inner.table.shape[0]):
            part = alike(inner, (inner.number, inner.table[i : i + 1]))
            transfer(part, outer.after[i : i + 1])

    outer = bundled(3)
    first_rows(outer)
    assert (outer.after == outer.inner.table * [[10.0], [11.0], [12.0]]).all()


def test_nothing_is_kept_of_a_bundle():
    @entrance
    def total(outer):
        return outer.inner.table[0, 0] + outer.before[0]

    outer = bundled()
    total(outer)
    table = weakref.ref(outer.inner.table)
    del outer
    assert table() is None


def test_what_is_no_field_is_told_by_name():
    @entrance
    def unknown(outer):
        return outer.inner.tables[0, 0]

    with pytest.raises(Exception, match="tables"):
        unknown(bundled())
