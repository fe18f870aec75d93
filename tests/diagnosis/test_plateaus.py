"""Superelastic plates as suspects: where they are, what is said of them, and the smooth law that they are a case of."""

from types import SimpleNamespace

import numpy as np
import pytest
from diagnosis.simulated import NITINOL, Case, diagnosed
from diagnosis.suspected import bare_sections, scope, sections

from prb3r.diagnosis.library import SUSPECTS, hypotheses
from prb3r.diagnosis.result.remarks import never_unloaded
from prb3r.model.effects.sections import SuperelasticPlate
from prb3r.model.manipulator import Manipulator

KIND, TWIN = "superelastic_plate", "nonlinear_plate"
PLATEAU = {"kind": KIND, "plateau_strain": 0.0085, "compression_ratio": 1.35, "plateau_slope": 0.06}
SMOOTH = {"kind": TWIN, "law": "smooth", "knee_strain": 0.0126, "ratio": 0.09, "sharpness": 4.5}


def kinds(there):
    return {hypothesis.kind for hypothesis in hypotheses(there)}


def test_they_are_suspected_where_section_modulus_and_strain_allow(nitinol, rubbing):
    modulus, thickness = NITINOL
    assert KIND in kinds(nitinol)
    assert rubbing.strain > 0.005
    assert KIND not in kinds(rubbing), "steel yields at such strains"
    assert KIND not in kinds(nitinol._replace(bend=nitinol.bend / 5)), "strains are elastic"
    stiff = bare_sections(bending_stiffness_n_m2=0.125, outer_fibre_m=thickness / 2)
    assert KIND not in kinds(scope(youngs_modulus_pa=modulus, segment=stiff)), "a notched tube has no such section"


def test_they_and_a_bending_law_exclude_each_other(nitinol):
    plateau = next(each for each in hypotheses(nitinol) if each.kind == KIND)
    laws = [each for each in hypotheses(nitinol) if each.kind == TWIN]
    assert all(plateau.excludes(law) and law.excludes(plateau) for law in laws)
    loops = next(each for each in hypotheses(nitinol) if each.kind == "hysteretic_plate")
    assert not plateau.excludes(loops)
    modulus, thickness = NITINOL
    of_nitinol = {"youngs_modulus_pa": modulus, "segment": sections(thickness_m=thickness)}
    for known in (PLATEAU, SMOOTH):
        assert kinds(scope(effect=[known], **of_nitinol)).isdisjoint({KIND, TWIN})


def test_a_material_carries_over_to_any_section_that_is_known(nitinol):
    known = SuperelasticPlate(**PLATEAU)
    here, transfer = nitinol.manipulator, SUSPECTS[KIND].transfer
    plain = here.model_dump(exclude_none=True)
    thicker = Manipulator.model_validate(plain | {"segment": sections(thickness_m=0.0015)})
    assert transfer(known, here, thicker) == known
    unknown = Manipulator.model_validate(plain | {"segment": bare_sections()})
    assert "needs outer_fibre_m" in transfer(known, here, unknown)


def test_where_nothing_unloads_plateaus_and_loops_are_said_to_be_alike():
    found = SimpleNamespace(fitted=SimpleNamespace(effects=(SuperelasticPlate(**PLATEAU),)))
    (remark,) = never_unloaded(found, [])
    assert KIND in remark
    assert "unload" in remark


@pytest.mark.long
def test_they_are_named_by_their_numbers_and_the_smooth_law_is_told_beside_them():
    found = diagnosed(Case(hidden=(tuple(PLATEAU.items()),), plates=NITINOL))
    assert found.verdict in ("explained", "ambiguous")
    (effect,) = found.effects
    assert effect.kind == KIND
    told = effect.parameters["plateau_strain"]
    assert told.low < PLATEAU["plateau_strain"] < told.high
    assert np.log(told.high / told.low) < 0.5
    assert TWIN in {rival.kind for rival in effect.rivals}


@pytest.mark.long
@pytest.mark.parametrize(("ratio", "seed"), [(0.5, 2), (2.0, 0)])
def test_a_knee_that_is_no_plateau_keeps_its_name(ratio, seed):
    """Plates of the same material and section, half as stiff or twice as stiff beyond a knee low in what they bend.

    Twice as stiff they bend as plates whose disks touch: the knee may stand beside them as a rival.
    """
    knee = {"kind": TWIN, "law": "bilinear", "knee_strain": 0.0035, "ratio": ratio}
    found = diagnosed(Case(hidden=(tuple(knee.items()),), plates=NITINOL, seed=seed))
    assert KIND not in {effect.kind for effect in found.effects}
    (effect,) = found.effects
    assert TWIN in {effect.kind, *(rival.kind for rival in effect.rivals)}
    assert effect.kind == TWIN or (ratio > 1 and found.verdict == "ambiguous")
