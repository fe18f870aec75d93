"""What the page of a diagnosis says of models, noise, tolerances, checks and other designs."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from prb3r import load_manipulator
from prb3r.diagnosis.checks.heldout import HeldOut
from prb3r.diagnosis.checks.residuals import ModelCheck
from prb3r.diagnosis.result.numbers import NoiseFound, SurvivingModel, ToleranceFound
from prb3r.diagnosis.result.statements import Estimate
from prb3r.model.effects.cables import HoleClearance, TensionOffset
from prb3r.model.effects.friction import PulleyFriction
from prb3r.model.effects.plates import ClampCompliance, WeakenedPlate
from prb3r.present.diagnosis import belief
from prb3r.present.diagnosis.sentences import confirmation, estimate_texts, percent, value_text

NOMINAL = load_manipulator("studies/manipulators/two-segment.toml")
PLATE, PULLEY = "weakened_plate (plate 4)", "pulley_friction"
WEAK, WORN = (SimpleNamespace(name=name, kind=name.split(" (")[0]) for name in (PLATE, PULLEY))


def told(**known):
    """A diagnosis of which no more is known than a sentence needs."""
    empty = {
        "verdict": "explained",
        "why": "",
        "nominal": NOMINAL,
        "alternatives": (),
        "effects": (),
        "models": (),
        "tolerances": (),
        "checks": (),
        "settings": {},
    }
    stand = [
        SimpleNamespace(
            probability=one.probability,
            effects=[SimpleNamespace(kind=name.split(" (")[0]) for name in one.effects],
        )
        for one in known.get("models", ())
    ]
    return SimpleNamespace(**(empty | {"posterior": SimpleNamespace(models=stand)} | known))


def model(probability, *effects, score=-0.5):
    return SurvivingModel(probability, effects, 1.01, score)


def test_sets_that_stand_are_listed_with_their_probabilities_most_probable_first():
    rows = belief.surviving_models(told(models=(model(0.9, PLATE), model(0.1, PLATE, PULLEY, score=None)))).rows
    assert rows[0] == ["weakened plate (plate 4)", "90 %", "1.01", "−0.5"]
    assert rows[1] == ["weakened plate (plate 4), pulley friction", "10 %", "1.01", "–"]
    assert belief.surviving_models(told(models=(model(1.0),))) is None
    assert belief.surviving_models(told(models=(model(0.6), model(0.4, PULLEY)))).rows[0][0] == "none"


@pytest.mark.parametrize(
    ("models", "said"),
    [
        ((model(0.9, PLATE), model(0.1, PLATE, PULLEY)), "What is named is in all of them; the others add"),
        ((model(1.0, PLATE),), "No other set of effects stands."),
        (
            (model(0.8, PLATE), model(0.2, "weakened_plate (plate 5)")),
            "Sets that have effects of the kinds that are named at other places have 20 % together",
        ),
        ((model(0.97, PLATE), model(0.03, PULLEY)), "Sets that lack something of what is named have 3 % together"),
    ],
)
def test_what_the_sets_have_in_common_is_said_and_agrees_with_their_table(models, said):
    assert belief.standing_sets(told(models=models, effects=(WEAK,))).startswith(said)


def test_sets_that_stand_but_are_not_listed_are_counted():
    models = (model(0.6, PLATE), model(0.2, PLATE, PULLEY), model(0.15, PULLEY), model(0.05))
    assert belief.unlisted_sets(told(models=models)) == (
        "Any other is less probable than the first by a factor of more than 150."
    )
    known = told(models=models)
    known.models = models[:2]
    assert belief.unlisted_sets(known).startswith("2 more sets (20 % in all) are not listed; any other is less")
    known.models = models[:3]
    assert belief.unlisted_sets(known).startswith("1 more set (5 % in all) is not listed")


def test_where_others_could_stand_in_its_place_nothing_is_said_to_be_in_all_sets():
    known = told(
        models=(model(0.6, PLATE), model(0.4, PULLEY)), effects=(WEAK,), alternatives=(("pulley_friction",), ())
    )
    assert belief.standing_sets(known) == ""
    assert belief.standing_sets(told(models=(model(1.0),))) == ""


@pytest.mark.parametrize(
    ("common", "reach", "said"),
    [
        (0.0, np.inf, ""),
        (0.2, np.inf, " Of the variance of the readings the whole photograph has 20 % in common."),
        (0.2, 3.2, " Of the variance of the readings disks less than about 3 apart have 20 % in common."),
    ],
)
def test_noise_is_told_with_its_interval_and_what_disks_share(common, reach, said):
    text = belief.noise_sentence(told(noise=NoiseFound(1.1, 1.0, 1.2, common, reach, 1.0, 1.0, 1.0, 0.0, 0.0, np.inf)))
    assert text == (
        f"The readings scatter 1.1 times as much as was stated (1 to 1.2); all judgements rest on that scatter.{said}"
    )


@pytest.mark.parametrize(
    ("ends", "said"),
    [((False, False), "3.9 times as much as was stated (3.4 to 4)"), ((False, True), "at least 3.4 times as much as")],
)
def test_a_scatter_of_tensions_at_the_end_of_what_is_considered_is_told_as_the_least(ends, said):
    noise = NoiseFound(1.0, 1.0, 1.0, 0.0, np.inf, 3.9, 3.4, 4.0, 0.0, 0.0, np.inf, ends)
    assert f"The tensions scatter {said}" in belief.noise_sentence(told(noise=noise))


def test_tolerances_stand_farthest_first_and_those_beyond_three_deviations_are_bold():
    sds = [0.5, 4.0, 1.0, 0.2, 0.1, 0.3, 2.0]
    found = [ToleranceFound(f"cable.{k}.offset_m", k_sd * 1e-4, 0.0, 6e-4, 1e-4) for k, k_sd in enumerate(sds)]
    rows = belief.tolerance_table(told(tolerances=found)).rows
    assert [row[0] for row in rows] == [f"cable {k} offset" for k in (1, 6, 2, 0, 5, 3)]
    assert [row[4] for row in rows] == ["**beyond tolerance**", *["within tolerance"] * 5]
    assert rows[0][1:4] == ["0.4 mm", "0 mm to 0.6 mm", "0.1 mm"]
    assert belief.tolerance_table(told()) is None


def test_rare_checks_are_bold_and_named_and_every_check_says_what_it_asks():
    names = [
        "chi-square", "scale of the noise", "largest score", "neighbours along disks", "neighbours along steps",
        "sequence out, set aside", "scatter of the tensions",
    ]  # fmt: skip
    chances = [1e-7, 0.5, 0.002, 0.4, 0.3, 0.9, 0.6]
    known = told(checks=[ModelCheck(name, p) for name, p in zip(names, chances, strict=True)])
    rows = belief.check_table(known).rows
    assert [row[2] for row in rows] == ["**below 0.0001**", "0.5", "**0.002**", "0.4", "0.3", "0.9", "0.6"]
    assert all(row[1] for row in rows)
    assert len({row[1] for row in rows}) == len(rows)
    assert belief.rare_checks(known).endswith("chi-square; largest score speak against the best model.")
    assert belief.rare_checks(told(checks=known.checks[1:2])).endswith(
        "none of these checks speaks against the best model."
    )


def test_what_is_of_the_material_carries_over_and_faults_stay():
    worn, everywhere = (
        WeakenedPlate(kind="weakened_plate", plate=4, factor=0.7),
        PulleyFriction(kind="pulley_friction", efficiency=0.9),
    )
    assert list(belief.carry_over(told(explained=SimpleNamespace(effects=[worn, everywhere])))) == [
        "Carries over to other designs of the same material and cables: E, μ, pulley friction.",
        "Stays with this rig: weakened plate, which is a fault of one part of this rig.",
    ]
    zero = TensionOffset(kind="tension_offset", offset_n=0.3)
    assert list(belief.carry_over(told(explained=SimpleNamespace(effects=[everywhere, zero]))))[1:] == [
        "To other designs on this bench, mounted alike, carries over too: tension offset (not with --other-bench)."
    ]
    clamps, play = ClampCompliance(compliance_rad_per_n_m=0.01), HoleClearance(clearance_m=1e-4)
    assert list(belief.carry_over(told(explained=SimpleNamespace(effects=[clamps, play])))) == [
        "Carries over to other designs of the same material, cables, clamps and disks: E, μ, clamp compliance, "
        "hole clearance."
    ]
    assert list(belief.carry_over(told(explained=SimpleNamespace(effects=[])))) == [
        "To other designs of the same material and cables E and μ carry over, no effect does."
    ]


def test_what_carries_over_but_is_not_certain_is_told_with_its_probability():
    clamps, play = ClampCompliance(compliance_rad_per_n_m=0.01), HoleClearance(clearance_m=1e-4)
    effects = [
        SimpleNamespace(kind="clamp_compliance", in_doubt=False, certain=False, partial=False, probability=0.36),
        SimpleNamespace(kind="hole_clearance", in_doubt=False, certain=True, partial=False, probability=1.0),
    ]
    known = told(explained=SimpleNamespace(effects=[clamps, play]), effects=effects, alternatives=(("gravity",),))
    carried, weighed = belief.carry_over(known)
    assert carried.endswith("E, μ, clamp compliance (36 %), hole clearance.")
    assert "weighs them by their probabilities" in weighed


def test_while_a_mismatch_remains_nothing_stands_or_carries_over():
    known = told(verdict="unexplained", why="a mismatch remains", models=(model(1.0, PULLEY),), effects=(WORN,))
    assert belief.surviving_models(known) is None
    assert [text.split(":")[0] for text in belief.carry_over(known)] == [
        "Nothing is sure to carry over while a mismatch remains"
    ]


def test_what_makes_a_model_without_effects_unexplained_speaks_against_it_and_no_chance_does_else():
    """A largest score with a chance of 0.77 %: more than names need, less than a model without any may leave."""
    check = SimpleNamespace(name="largest score", p=0.0077)
    for why, effects, speaks in (("a mismatch", (), True), ("", (), False), ("a mismatch", (PULLEY,), False)):
        said = belief.rare_checks(told(why=why, models=(model(1.0, *effects),), checks=(check,)))
        assert ("largest score speaks against the best model" in said) == speaks


def test_tolerances_have_units_whatever_they_are_called():
    names = {"marker 3 along its disk, m": "0.1 mm", "segment.2.length_m": "0.1 mm", "plate 4 stiffness": "1 %"}
    sizes = {"plate 4 stiffness": 0.01}
    found = [ToleranceFound(name, sizes.get(name, 1e-4), 0.0, 1.0, sizes.get(name, 1e-4)) for name in names]
    rows = belief.tolerance_table(told(tolerances=found)).rows
    assert [row[1] for row in rows] == list(names.values())
    assert [row[0] for row in rows] == ["marker 3 along its disk", "segment 2 length", "plate 4 stiffness"]


@pytest.mark.parametrize("share", [0.995, 0.9971, 0.9994, 1 - 1e-9])
def test_what_is_less_than_all_is_never_called_all(share):
    assert "100" not in percent(share)
    assert percent(1.0) == "100 %"


@pytest.mark.parametrize(
    ("name", "estimate", "texts"),
    [
        ("knee_per_m", Estimate(279.9, 232.3, 292.9), ("280 1/m", "232 to 293 1/m")),
        ("angle_rad", Estimate(0.2222, 0.217, 0.2674), ("12.7°", "12.4 to 15.3°")),
        ("offset_m", Estimate(-8e-4, -1.02e-3, 5e-6), ("−0.8 mm", "−1.02 to 0.005 mm")),
        ("sharpness", Estimate(18.71, 9.65, 20.0, (False, True)), ("18.7", "9.65 or more")),
        ("stiffness_n_m_per_rad", Estimate(0.08, 0.03, 8.03, (True, False)), ("0.08 N m/rad", "up to 8.03 N m/rad")),
        ("youngs_modulus_pa", Estimate(1.884e10), ("18.8 GPa", "–")),
    ],
)
def test_a_value_and_its_interval_have_one_unit_and_the_digits_of_its_sentence(name, estimate, texts):
    assert estimate_texts(name, estimate) == texts
    assert value_text(name, estimate.value) == texts[0]


@pytest.mark.parametrize(
    ("share", "text"), [(-0.0312, "−3.1 %"), (0.0158, "1.6 %"), (0.00957, "0.96 %"), (0.36, "36 %"), (-0.5, "−50 %")]
)
def test_small_shares_are_told_with_two_digits(share, text):
    assert percent(share) == text


def test_errors_that_are_left_are_told_of_positions_and_of_angles_each():
    held = HeldOut(("pull, again",), 3e-3, 3.3e-4, 3e-4, 0.04, 0.009, 0.005, 900.0, 100.0, 100)
    said = confirmation(told(heldout=held, effects=(WEAK,)))
    assert said.startswith('Sequence "pull, again" stayed out of every fit. There what is named leaves none of the')
    assert said.endswith("1.10 times the reading noise in positions and 1.80 times the reading noise in angles.")
    positions_alone = replace(held, rmse_explained_rad=None, noise_rad=None, chi2_explained=124.0)
    said = confirmation(told(heldout=positions_alone, effects=(WEAK,)))
    assert "removes 97 % of the squared error" in said
    assert "angles" not in said
