import math
import subprocess
import sys

import pytest

from prb3r.model.effects import EFFECT_KINDS
from prb3r.quantities import (
    NOMENCLATURE,
    UNIT_OF_ENDING,
    Quantity,
    describe,
    label,
    scale,
    unit_ending,
)


def test_longest_unit_ending_wins_whatever_the_stem():
    for ending, unit in UNIT_OF_ENDING.items():
        assert describe(f"some_metric{ending}").unit == unit
    assert describe("retained_share").unit == "1"


def test_what_goes_per_something_has_a_unit_that_says_so():
    """A cell that is not linear is off by so much for every newton, not by newtons."""
    names = {name for kind in EFFECT_KINDS.values() for name in kind.model_fields}
    per = {name: describe(name).unit for name in names if "_per_" in name}
    assert per["quadratic_per_n"] == "1/N"
    assert [
        name for name, unit in per.items() if "/" not in unit or "per" in name.removesuffix(unit_ending(name))
    ] == []


def test_every_known_unit_agrees_with_its_name():
    for name, quantity in NOMENCLATURE.items():
        assert quantity.unit == UNIT_OF_ENDING.get(unit_ending(name), quantity.unit)
        assert quantity.unit in {"", "1"} or unit_ending(name)


def test_columns_with_names_in_them():
    assert describe("cable_outer_left_n").meaning.startswith("tension of cable outer_left: as applied, and at disks")
    assert describe("slip_3").unit == "1"
    assert describe("disk7_y_n").symbol == "F_7y"


def test_labels_and_scales_change_unit_together():
    assert (label("tip_x_m"), label("tip_x_m", "mm")) == ("Tip x (m)", "Tip x (mm)")
    assert label("angle_rad", "deg") == "Angle (°)"
    assert label(Quantity("area_ratio", "", "1", "ratio of areas")) == "Area ratio"
    assert scale("angle_rad", "deg") == pytest.approx(180 / math.pi)
    assert scale("area_m2", "cm^2") == pytest.approx(1e4)
    assert scale("tip_compliance_m_per_n", "mm/kN") == pytest.approx(1e6)
    with pytest.raises(ValueError, match="tip_x_m is in m and cannot be shown in deg"):
        label("tip_x_m", "deg")


def test_nomenclature_is_light_to_import():
    code = "import sys, prb3r.quantities; print({'numpy', 'pandas'} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "set()"
