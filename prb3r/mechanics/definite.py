"""States whose tangent is positive definite, and which are stable for certain, without an eigenvalue.

No real part of an eigenvalue of a matrix is below the lowest eigenvalue of its symmetric part (Bendixson, Acta Math. 25
(1902) 359).  So a state is stable if the symmetric part of its tangent has a Cholesky factor, which takes a tenth of
the time of eigenvalues.
"""

from math import sqrt

from prb3r.mechanics.attempt import put_on
from prb3r.mechanics.kernel import entrance, kernel
from prb3r.mechanics.tangent import chain_tangent


@kernel
def has_cholesky_factor(matrix):
    """Whether the symmetric part of a `matrix` (n, n), followed by one more column, is positive definite.

    Overwrites the matrix.
    """
    n = matrix.shape[0]
    for r in range(n):
        for c in range(r):
            matrix[r, c] = (matrix[r, c] + matrix[c, r]) / 2
    for c in range(n):
        pivot = matrix[c, c]
        for k in range(c):
            pivot -= matrix[c, k] ** 2
        if not pivot > 0.0:  # NaN too
            return False
        matrix[c, c] = sqrt(pivot)
        for r in range(c + 1, n):
            value = matrix[r, c]
            for k in range(c):
                value -= matrix[r, k] * matrix[c, k]
            matrix[r, c] = value / matrix[c, c]
    return True


@entrance
def mark_definite(packed, way, begin, now, modes, q, definite, work):
    """Keep `definite` (s,) True where it is and the tangent of the step's state is positive definite.

    The way to step s leads from row ``begin[s]`` of the loads; `now` is working space, and `modes` are unit modes.
    `q` (s, n, nodes) are the node angles, rad; slip is declared.
    """
    for s in range(len(q)):
        if not definite[s]:
            continue
        way.ends[0], way.ends[1] = begin[s], s + 1
        put_on(packed, way, 1.0, now)
        for i in range(q.shape[1]):
            for k in range(q.shape[2]):
                packed.plate[i].q[k] = q[s, i, k]
        chain_tangent(packed, now.tension, now.slip, now.force, now.tip, modes, work)
        definite[s] = has_cholesky_factor(work.system)
