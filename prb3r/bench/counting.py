"""Floating point operations of the kernels, counted by running their Python text on numbers that count.

Kernels are plain Python functions, which accept any kind of number: here one that holds its value and adds every
operation on it to a tally.  So the count is that of the kernel as it stands, and the mechanics is not stated twice.
Operations that a compiler removes are not counted: arithmetic among literals, sums with a literal 0, products with a
literal 0, 1 or -1; a quotient by a literal counts as a product.
"""

import math
import operator
import sys
from collections import Counter
from collections.abc import Callable
from types import FunctionType
from typing import Any
from unittest.mock import patch

import numpy as np

from prb3r.mechanics import equilibrium
from prb3r.mechanics.chain import Chain, Loads
from prb3r.mechanics.equilibrium import Equilibria, solve_chain

ADD, MULTIPLY, DIVIDE, ROOT, FUNCTION = "additions", "products", "quotients", "square_roots", "functions"
OPERATION_WEIGHTS = {ADD: 1, MULTIPLY: 1, DIVIDE: 4, ROOT: 4, FUNCTION: 8}
"""How many operations one of each kind counts for (McMahon, The Livermore Fortran kernels, UCRL-53745, 1986).
`functions` are calls of sines, exponentials and their like; where kernels evaluate one in line, that is counted term by
term."""
NO_OPERATIONS = (math.copysign, math.floor, math.isfinite, math.isnan)
"""Functions of `math` that do not count."""


class Counted:
    """A number that adds to `tally` every operation on it; comparisons, negation and magnitude do not count."""

    __slots__ = ("tally", "value")

    def __init__(self, value: float, tally: Counter[str]):
        self.value, self.tally = float(value), tally

    def __float__(self) -> float:
        return self.value

    def __int__(self) -> int:
        return int(self.value)

    def __bool__(self) -> bool:
        return self.value != 0.0

    def __neg__(self) -> "Counted":
        return Counted(-self.value, self.tally)

    def __abs__(self) -> "Counted":
        return Counted(abs(self.value), self.tally)


def _operation(work: Callable[[float, float], float], kind: Callable[[Any, Any], str | None]) -> Callable[..., Counted]:
    """A method of :class:`Counted` that does `work` on two numbers and counts it.

    `kind` of the two operands gives the name under which it counts, or None if it does not.
    """

    def done(a: Any, b: Any) -> Counted:
        tally, name = (a if isinstance(a, Counted) else b).tally, kind(a, b)
        if name is not None:
            tally[name] += 1
        return Counted(work(float(a), float(b)), tally)

    return done


def _divided(a: float, b: float) -> float:
    """`a / b` by IEEE rules, as in the kernels: infinite or NaN where Python would raise an error."""
    if b != 0.0:
        return a / b
    with np.errstate(all="ignore"):
        return float(np.float64(a) / np.float64(b))


def _raised(a: float, b: float) -> float:
    """`a` to the power `b` by IEEE rules: infinite or NaN where Python would raise an error."""
    with np.errstate(all="ignore"):
        return float(np.float64(a) ** np.float64(b))


def _of_text(number: Any, *values: float) -> bool:
    """Whether a number is a literal of the kernel, or another number that does not count, and one of `values`."""
    return not isinstance(number, Counted) and number in values


# Each of the next four functions gives the kind under which an operation on `a` and `b` counts, None if it does not.
def _of_sum(a: Any, b: Any) -> str | None:
    return None if _of_text(a, 0) or _of_text(b, 0) else ADD


def _of_product(a: Any, b: Any) -> str | None:
    return None if _of_text(a, 0, 1, -1) or _of_text(b, 0, 1, -1) else MULTIPLY


def _of_quotient(a: Any, b: Any) -> str | None:
    return DIVIDE if isinstance(b, Counted) else _of_product(a, b)


def _of_power(a: Any, b: Any) -> str:
    return MULTIPLY if _of_text(b, 2) else FUNCTION


def _teach() -> None:
    """Define the arithmetic and comparison operators of :class:`Counted`."""
    operations = {
        "add": (operator.add, _of_sum),
        "sub": (operator.sub, _of_sum),
        "mul": (operator.mul, _of_product),
        "truediv": (_divided, _of_quotient),
        "pow": (_raised, _of_power),
    }
    for name, of in operations.items():
        work = _operation(*of)
        setattr(Counted, f"__{name}__", work)
        setattr(Counted, f"__r{name}__", lambda a, b, work=work: work(b, a))
    for name in ("lt", "le", "gt", "ge", "eq", "ne"):
        compare = getattr(operator, name)
        setattr(Counted, f"__{name}__", lambda a, b, compare=compare: compare(float(a), float(b)))


_teach()


class CountedArray(np.ndarray):
    """An array of :class:`Counted` numbers; plain floats that are written to it become such numbers."""

    tally: Counter[str]

    def __array_finalize__(self, obj):
        tally = getattr(obj, "tally", None)  # `obj` is what this is a view of
        self.tally = Counter() if tally is None else tally

    def __setitem__(self, place, value):
        super().__setitem__(place, Counted(value, self.tally) if isinstance(value, float) else value)


class Fields:
    """A record of a structured array with its fields as attributes; floats assigned to it count from then on."""

    tally: Counter[str]

    def __init__(self, tally: Counter[str], **fields: Any):
        self.__dict__ |= {"tally": tally} | fields

    def __setattr__(self, name: str, value: Any) -> None:
        self.__dict__[name] = Counted(value, self.tally) if isinstance(value, float) else value


class _Counting:
    """Conversion of kernel arguments to numbers that count, and back; arrays that share memory still do afterwards."""

    def __init__(self, tally: Counter[str]):
        self.tally = tally
        self.known: dict[int, tuple[Any, Any]] = {}
        """Arrays converted so far, by their `id`: the plain one and the one that counts."""

    def of(self, argument: Any) -> Any:
        """An argument (number, array, record or bundle of these) with all its floats as :class:`Counted` numbers."""
        if isinstance(argument, tuple):  # a bundle
            return type(argument)(*map(self.of, argument))
        if not isinstance(argument, np.ndarray):
            return Counted(argument, self.tally) if isinstance(argument, float) else argument
        if id(argument) not in self.known:
            self.known[id(argument)] = argument, self._array(argument)
        return self.known[id(argument)][1]

    def _array(self, array: np.ndarray) -> Any:
        """An array that counts; of a structured one an array of `Fields`, of a view a view of what counts for its base.

        Arrays of other types stay as they are.
        """
        if array.dtype.names:
            rows = [
                Fields(self.tally, **{name: self.of(self._plain(row[name])) for name in array.dtype.names})
                for row in array.ravel()
            ]
            return _objects(rows, array.shape)
        if array.dtype != float:
            return array
        if isinstance(array.base, np.ndarray) and array.base.dtype == float and array.base.flags.c_contiguous:
            base = self.of(array.base)
            start = (array.ctypes.data - array.base.ctypes.data) // array.itemsize
            return np.lib.stride_tricks.as_strided(base.ravel()[start:], array.shape, array.strides, subok=True)
        memory = _objects([Counted(value, self.tally) for value in array.ravel()], array.shape).view(CountedArray)
        memory.tally = self.tally
        return memory

    @staticmethod
    def _plain(field: Any) -> Any:
        """The content of a record's field: a copy of an array, or a Python number."""
        return field.copy() if isinstance(field, np.ndarray) else field.item()

    def give_back(self) -> None:
        """Copy the results from the arrays that count to the plain arrays that they were made from."""
        for array, memory in self.known.values():
            if isinstance(memory, CountedArray):
                array[...] = np.reshape([float(value) for value in memory.ravel()], array.shape)


def _objects(values: list[Any], shape: tuple[int, ...]) -> np.ndarray:
    """An array of Python objects."""
    out = np.empty(len(values), object)
    out[:] = values
    return out.reshape(shape)


def _counting(function: Callable[..., float]) -> Callable[..., Any]:
    """A function of `math` that also takes :class:`Counted` numbers, counts each call and returns such a number.

    Of plain numbers alone it returns a plain one.
    """
    kind = ROOT if function is math.sqrt else None if function in NO_OPERATIONS else FUNCTION

    def called(*numbers):
        value, tally = function(*map(float, numbers)), next((n.tally for n in numbers if isinstance(n, Counted)), None)
        if tally is None:
            return value
        if kind is not None:
            tally[kind] += 1
        return Counted(value, tally)

    return called


def _text(kernel: Any, modules: dict[str, dict[str, Any]]) -> FunctionType:
    """See :func:`text_of`; `modules` holds the names of each module whose kernels were replaced already."""
    function = kernel.py_func
    if function.__module__ not in modules:
        known = modules[function.__module__] = dict(vars(sys.modules[function.__module__]))
        for name, value in list(known.items()):
            if hasattr(value, "py_func"):
                known[name] = _text(value, modules)
            elif getattr(math, name, None) is value and callable(value):
                known[name] = _counting(value)
    return FunctionType(function.__code__, modules[function.__module__], function.__name__, function.__defaults__)


def text_of(kernel: Any) -> FunctionType:
    """The Python function of a compiled kernel, which takes numbers that count, as do all kernels that it calls."""
    return _text(kernel, {})


def count_solve(chain: Chain, loads: Loads) -> tuple[Equilibria, Counter[str]]:
    """Equilibria as `solve_chain` returns them without details, and the operations of each kind in the kernel."""
    tally: Counter[str] = Counter()
    text = text_of(equilibrium.follow)

    def follow(*arguments):
        counting = _Counting(tally)
        text(*map(counting.of, arguments))
        counting.give_back()

    with patch.object(equilibrium, "follow", follow):
        return solve_chain(chain, loads, detail=False), tally


def weighted(tally: Counter[str]) -> float:
    """Weighted number of operations of a tally; see `OPERATION_WEIGHTS`."""
    return float(sum(OPERATION_WEIGHTS[kind] * number for kind, number in tally.items()))
