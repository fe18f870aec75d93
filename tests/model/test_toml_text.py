import tomllib
from pathlib import Path

import numpy as np
import pytest

from prb3r.model.files.toml import toml_text
from prb3r.model.manipulator import load_manipulator

STUDIES = Path(__file__).parents[2] / "studies"


def random_value(rng, depth):
    kind = rng.integers(0, 7 if depth else 5)
    if kind == 5:
        return [random_value(rng, depth - 1) for _ in range(rng.integers(0, 4))]
    if kind == 6:
        return {random_text(rng): random_value(rng, depth - 1) for _ in range(rng.integers(0, 4))}
    return [
        True,
        -7,
        10 ** int(rng.integers(0, 18)),
        float(rng.normal() * 10.0 ** rng.integers(-30, 30)),
        random_text(rng),
    ][kind]


def random_text(rng):
    return "".join(rng.choice(list("aZ_-09. \"'\\\n\t\x01\x7fµ€😀[]=#"), rng.integers(0, 6)))


@pytest.mark.parametrize("seed", range(200))
def test_any_data_reads_back(seed):
    rng = np.random.default_rng(seed)
    data = {random_text(rng): random_value(rng, 4) for _ in range(5)}
    assert tomllib.loads(toml_text(data)) == data


def test_what_is_absent_is_left_out_at_every_depth():
    data = {
        "name": "x",
        "gone": None,
        "disk": {"mass_kg": 1e-5, "gone": None},
        "segment": [{"plates": 1, "gone": None}],
    }
    assert tomllib.loads(toml_text(data)) == {"name": "x", "disk": {"mass_kg": 1e-5}, "segment": [{"plates": 1}]}


def test_a_manipulator_reads_back_equal_and_easily(tmp_path):
    """A line for each segment and each cable, none longer than people read."""
    manipulator = load_manipulator(STUDIES / "manipulators/two-segment.toml")
    text = toml_text(manipulator.model_dump(exclude_none=True))
    (tmp_path / "x.toml").write_text(text)
    assert load_manipulator(tmp_path / "x.toml") == manipulator
    assert max(map(len, text.splitlines())) <= 100
    assert 'name = "1", offset_m = ' in text


def test_foreign_values_are_refused():
    with pytest.raises(TypeError, match="not TOML serializable"):
        toml_text({"a": object()})
