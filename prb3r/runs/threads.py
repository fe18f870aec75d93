"""Number of threads of the linear algebra libraries: set in the environment before they load, or limited later."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

LINEAR_ALGEBRA = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
"""Environment variables from which these libraries read their number of threads as they are loaded."""


def one_thread_unless_asked() -> None:
    """Set linear algebra to one thread in the environment, unless the user has set a number of threads.

    The systems here are small: more threads wait for each other, busily, and a diagnosis takes twice the CPU time.
    This has no effect once numpy is loaded.
    """
    for name in LINEAR_ALGEBRA:
        os.environ.setdefault(name, "1")


@contextmanager
def one_thread() -> Iterator[None]:
    """Limit linear algebra to one thread within the context, unless the user has set a number of threads.

    This works where numpy is loaded already, as in a Python session of the user.  Two threads that wait for each other
    on two cores that others use too made 94 s of a diagnosis of 6 s.
    """
    if any(name in os.environ for name in LINEAR_ALGEBRA):
        yield
        return
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1):
        yield
