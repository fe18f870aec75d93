"""How many threads the libraries of linear algebra use: read by them as they are loaded, or told to them later."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

LINEAR_ALGEBRA = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
"""Variables of the environment that say so."""


def one_thread_unless_asked() -> None:
    """Let linear algebra use one thread where the environment does not say otherwise.

    The systems here are small: more threads wait for each other, busily, and a diagnosis takes twice the CPU time.  Of
    no effect once numpy is loaded.
    """
    for name in LINEAR_ALGEBRA:
        os.environ.setdefault(name, "1")


@contextmanager
def one_thread() -> Iterator[None]:
    """The same for what is done within, where numpy is loaded already: in Python, beside other work of the caller.

    Two threads that wait for each other on two cores that others use too made 94 s of a diagnosis of 6 s.
    """
    if any(name in os.environ for name in LINEAR_ALGEBRA):
        yield
        return
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1):
        yield
