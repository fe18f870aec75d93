import tomllib

import numpy as np
import pytest
from pydantic import BaseModel

from prb3r.model.files.toml import read
from prb3r.model.files.toml_text import toml_text


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


def test_tables_are_written_as_people_write_them(tmp_path):
    class Anything(BaseModel, extra="allow"):
        pass

    data = {"name": "x", "gone": None, "disk": {"mass_kg": 1e-5}, "segment": [{"plates": 1}, {"plates": 2}]}
    text = 'name = "x"\n\n[disk]\nmass_kg = 1e-05\n\n[[segment]]\nplates = 1\n\n[[segment]]\nplates = 2\n'
    assert toml_text(data) == text
    (tmp_path / "x.toml").write_text(text)
    assert read(tmp_path / "x.toml", Anything).name == "x"


def test_foreign_values_are_refused():
    with pytest.raises(TypeError, match="no place in a TOML file"):
        toml_text({"a": object()})
