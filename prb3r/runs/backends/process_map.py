"""A parallel map over worker processes that live as long as a context, by joblib."""

import contextlib
from collections.abc import Callable, Iterator, Sequence
from typing import Any


@contextlib.contextmanager
def process_map(jobs: int) -> Iterator[Callable[[Callable[[Any], Any], Sequence[Any]], list[Any]]]:
    """A function that maps another over a sequence in `jobs` worker processes, which live as long as the context.

    With one job, and for sequences of one task, it runs in this process.
    """
    if jobs == 1:
        yield lambda function, tasks: [function(task) for task in tasks]
        return
    from joblib import Parallel, delayed, parallel_config

    with parallel_config(backend="loky", inner_max_num_threads=1), Parallel(n_jobs=jobs, batch_size=1) as parallel:

        def mapped(function: Callable[[Any], Any], tasks: Sequence[Any]) -> list[Any]:
            if len(tasks) < 2:
                return [function(task) for task in tasks]
            return parallel(delayed(function)(task) for task in tasks)

        yield mapped
