"""Linear equations of a few unknowns, in compiled code."""

from prb3r.mechanics.kernel import kernel


@kernel
def solve_block(block, n, columns):
    """Gauss elimination with partial pivoting of ``[A | B]`` in place: the columns `n` to `columns` become ``A^-1 B``.

    `A` is (n, n) and is overwritten.  Returns the sign of the determinant of `A`.
    """
    sign = 1.0
    for k in range(n):
        pivot = k
        for r in range(k + 1, n):
            if abs(block[r, k]) > abs(block[pivot, k]):
                pivot = r
        if pivot != k:
            for c in range(k, columns):
                block[k, c], block[pivot, c] = block[pivot, c], block[k, c]
            sign = -sign
        if block[k, k] < 0.0:
            sign = -sign
        inverse = 1.0 / block[k, k]
        for r in range(k + 1, n):
            factor = block[r, k] * inverse
            for c in range(k + 1, columns):
                block[r, c] -= factor * block[k, c]
    for k in range(n - 1, -1, -1):
        inverse = 1.0 / block[k, k]
        for c in range(n, columns):
            value = block[k, c]
            for r in range(k + 1, n):
                value -= block[k, r] * block[r, c]
            block[k, c] = value * inverse
    return sign
