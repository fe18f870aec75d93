"""How many threads the libraries of linear algebra use: read by them as they are loaded."""

import os

LINEAR_ALGEBRA = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
"""Variables of the environment that say so."""


def one_thread_unless_asked() -> None:
    """Let linear algebra use one thread where the environment does not say otherwise.

    The systems here are small: more threads wait for each other, busily, and a diagnosis takes twice the CPU time.  Of
    no effect once numpy is loaded.
    """
    for name in LINEAR_ALGEBRA:
        os.environ.setdefault(name, "1")
