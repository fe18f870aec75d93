"""Values of grids are decimal numbers of few digits, to the last bit as text would give them."""

import numpy as np
import pytest

from prb3r.study.rounding import short, significant

RNG = np.random.default_rng(5)
HALVES = (RNG.integers(0, 10**12, 20_000) + 0.5) / 10.0 ** RNG.integers(0, 20, 20_000)
VALUES = {
    "even steps": np.linspace(1, 100, 20_000),
    "of any size": RNG.choice([-1, 1], 20_000) * 10 ** RNG.uniform(-320, 308, 20_000),
    "amid two": HALVES,
    "beside the middle": np.nextafter(HALVES, RNG.choice([0, np.inf], len(HALVES))),
    "beside powers of ten": np.nextafter(10.0 ** np.arange(-30, 30), np.array([[0.0], [np.inf]])),
    "special": np.array([0.0, -0.0, np.inf, -np.inf, 5e-324, 1.7e308, 999_999_999_999.5, 0.1 + 0.2]),
    "none": np.zeros(0),
}


@pytest.mark.parametrize("digits", [1, 5, 12])
@pytest.mark.parametrize("kind", VALUES)
def test_rounding_is_that_of_text_to_the_last_bit(kind, digits):
    values = VALUES[kind]
    by_text = np.array([float(f"{value:.{digits}g}") for value in values.ravel()]).reshape(values.shape)
    assert significant(values, digits).tobytes() == by_text.tobytes()


def test_rounding_removes_rounding_errors():
    assert short(0.1 + 0.2) == 0.3
    assert significant(np.linspace(0, 1, 11)).tolist() == [0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1]
