"""Rigs that show what few do."""

from dataclasses import make_dataclass

import numpy as np
import pytest

from prb3r.proof.concealed import real
from prb3r.proof.concealed.candidates import candidates
from prb3r.proof.concealed.composition import flavours
from prb3r.proof.concealed.design import Flavour
from prb3r.proof.concealed.designs import design_of
from prb3r.proof.concealed.labels import Request
from prb3r.proof.concealed.real import FLAGS, OF_NITINOL, REAL_CLASSES, rare_among_others
from prb3r.proof.rig.effects import RECORDS
from prb3r.proof.settings import SETTINGS


def test_one_rare_effect_comes_before_others_that_the_rig_knows_beside_it():
    """All that are rare, but for the one of another material, the one that goes by times, which no program has, and the
    two that change dead loads, as nothing loads the tip of this design."""
    rng, design = np.random.default_rng(5), design_of(1, 0, Flavour.REAL)
    seen = {OF_NITINOL, "rate_dependent_friction", "base_tilt", "payload_scale"}
    for _ in range(80):
        rare, *others = (RECORDS[each.effect["kind"]] for each in rare_among_others(rng, design))
        seen.add(rare.kind)
        assert rare.rare
        assert not any(record.rare for record in others)
        assert rare.excludes.isdisjoint(record.kind for record in others)
    assert seen == {kind for kind, record in RECORDS.items() if record.rare}


@pytest.mark.long
def test_a_rig_of_nitinol_goes_beyond_the_plateau_of_its_material():
    rng, designs = np.random.default_rng(6), [design_of(2, k, Flavour.REAL_NITINOL) for k in range(8)]
    shown = [{group[0].kind for group in candidates(design, rare=True)} for design in designs]
    reaching = [design for design, there in zip(designs, shown, strict=True) if OF_NITINOL in there]
    assert len(reaching) > 4
    for design in designs:
        rare, *others = (each.effect for each in rare_among_others(rng, design))
        assert (rare["kind"] == OF_NITINOL) == (design in reaching)
        if rare["kind"] == OF_NITINOL:
            modulus, first = design.manipulator["youngs_modulus_pa"], design.manipulator["segment"][0]
            arc = first["length_m"] - 2 * first["clamp_m"]
            assert 4e8 <= rare["plateau_strain"] * modulus <= 5e8
            assert design.largest_bend / arc * first["thickness_m"] / 2 > 1.3 * rare["plateau_strain"]
            assert {each["kind"] for each in others}.isdisjoint({"nonlinear_plate", "hysteretic_plate", "disk_contact"})


def test_every_second_rig_of_nitinol_gives_back_less_than_it_took():
    """Of 60, 30 in the mean with a standard deviation of 4; steel gives back all."""
    rng, design = np.random.default_rng(8), design_of(2, 0, Flavour.REAL_NITINOL)
    flags = []
    for _ in range(60):
        kinds = [each.effect for each in rare_among_others(rng, design)]
        flags += [effect["reverse_ratio"] for effect in kinds if effect["kind"] == FLAGS]
    assert 20 < len(flags) < 40
    assert 0.3 < min(flags) < 0.4
    assert 0.6 < max(flags) < 0.7
    steel = design_of(1, 0, Flavour.REAL)
    others = [each.effect["kind"] for _ in range(30) for each in rare_among_others(rng, steel)]
    assert FLAGS not in others


def test_nitinol_under_loads_that_no_plateau_bears_has_another_rare_effect():
    rng, design = np.random.default_rng(8), design_of(2, 0, Flavour.REAL_NITINOL)
    rare = {rare_among_others(rng, design, plateau=False)[0].effect["kind"] for _ in range(30)}
    assert OF_NITINOL not in rare
    assert len(rare) > 3


def test_rigs_of_spring_steel_are_drawn_as_they_were():
    """One in ten of the recordings with a rare effect is of nitinol; the others are on the designs that they had."""
    kinds = flavours(40, ["rare"])
    assert [k for k, flavour in enumerate(kinds) if flavour == Flavour.REAL_NITINOL] == [9, 19, 29, 39]
    assert Flavour.REAL_NITINOL not in flavours(200, [cls for cls in REAL_CLASSES if cls != "rare"])


def test_another_kind_is_drawn_where_no_rig_with_the_one_that_is_asked_for_holds(monkeypatch):
    """The third rig of any kind holds; a kind that stands beside others stays asked for."""
    design, most = design_of(1, 0, Flavour.REAL), SETTINGS.real.tries_of_kind
    held = make_dataclass("Held", [("blunder", object, None)])()
    for cls, after in (("imperfect-single", ""), ("rare", "worn_hole")):
        asked = []
        monkeypatch.setattr(real, "_planted", lambda rng, request, *_, asked=asked, **__: asked.append(request.kind))
        monkeypatch.setattr(real, "_held", lambda *of: held if of[-1] == most + 2 else None)
        assert real.real_label(Request(0, 1, cls, 0, "worn_hole"), design) == held
        assert asked == ["worn_hole"] * most + [after] * 3
