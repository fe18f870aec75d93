"""What is said of parameters that rigs share: whether they agree, what is each rig's own, and what stands for it."""

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from prb3r.diagnosis.result.common import Common
from prb3r.diagnosis.result.shared_parameter import EffectOfOneRig, SharedParameter, effects_that_make_up
from prb3r.diagnosis.result.statements import Estimate
from prb3r.diagnosis.search.agreement import ParameterEstimate, chance_of_one_value
from prb3r.diagnosis.search.together import Together
from prb3r.diagnosis.settings import Settings
from prb3r.present.diagnosis.together import shared_figure, shared_table


@pytest.mark.parametrize("reading", [0.02, 0.05, 0.1, 1.0])
def test_of_rigs_of_one_value_one_in_a_hundred_pairs_disagrees_at_a_hundredth(reading):
    """However much of either estimate is the prior that both have: values of readings shrink toward its centre by the
    share that it has of their information."""
    prior, rng = 0.05, np.random.default_rng(1)
    share = prior**2 / (prior**2 + reading**2)
    sd = reading * share**0.5
    found = share * (0.03 + reading * rng.standard_normal((4000, 2)))
    rare = [chance_of_one_value([ParameterEstimate(u, sd, prior) for u in pair]) < 0.01 for pair in found]
    assert np.mean(rare) == pytest.approx(0.01, abs=0.005)  # three standard deviations of 4000


@pytest.mark.parametrize(
    ("probability", "said"),
    [(1.0, "All joint models that are left"), (0.6, "Joint models with one value have 60 %"), (0.0, "")],
)
def test_one_value_in_spite_of_recordings_that_disagree_is_no_certainty(probability, said):
    alone = Estimate(2.0e11, 1.9e11, 2.1e11), Estimate(2.6e11, 2.5e11, 2.7e11)
    told = SharedParameter("", "youngs_modulus_pa", ("a", "b"), alone[0], alone, 1e-4, False, probability, ())
    assert "do not agree on Young's modulus: 200 (190 to 210) GPa on a against 260 (250 to 270) GPa on b." in (
        told.statement
    )
    assert "100" not in told.statement
    assert said in told.statement
    assert ("an effect of one rig can make up the difference" in told.statement) == bool(said)
    worn = EffectOfOneRig("worn_hole", "b", 0.9)
    named = replace(told, made_up_by=(worn,)).statement
    assert ("worn hole of b (90 % of them) can make up the difference" in named) == bool(said)


def test_what_could_make_up_a_difference_is_in_the_models_with_one_value_and_not_in_the_others():
    """Both kinds of models have gravity on the first rig; a worn hole on the second stands for its own friction."""

    def survivor(probability, *effects):
        kinds = {"gravity": 0, "worn_hole": 1, "own": 1}
        of = [
            SimpleNamespace(
                kind=kind,
                name=kind,
                first=kind != "own",
                rigs=(kinds[kind],),
                parted=1 if kind == "own" else None,
                parting=SimpleNamespace(name="log_friction") if kind == "own" else None,
            )
            for kind in effects
        ]
        return SimpleNamespace(probability=probability, effects=of)

    survivors = survivor(0.5, "gravity", "own"), survivor(0.3, "gravity", "worn_hole"), survivor(0.2, "gravity")
    whole = SimpleNamespace(
        survivors=survivors, shares=Together.shares, fitted=SimpleNamespace(model=SimpleNamespace(settings=Settings()))
    )
    compared = SimpleNamespace(effect="", name="log_friction")
    assert list(effects_that_make_up(compared, whole, ("a", "b"))) == [
        EffectOfOneRig("worn_hole", "b", pytest.approx(0.6))
    ]


def test_what_is_not_shared_is_said_in_words():
    estimate = Estimate(0.3, 0.2, 0.4)
    strain = SharedParameter(
        "", "friction_coefficient", ("a", "b"), estimate, (estimate, Estimate(0.5)), 1.0, True, 1.0, ()
    )
    common = Common(
        ("a", "b"),
        (strain,),
        {"a": ("hole_offset (cable 1)",), "b": ("edge_wrap", "gravity", "hole_offset (cable 1)")},
        {"edge_wrap": ("b",)},
        -5.0,
        ("x",),
    )
    assert list(common.sentences) == [
        "The recordings speak against the view that the rigs share the friction coefficient (the Bayes factor of that "
        "against each recording by itself has ln -5.0; 3 is strong).",
        "No two recordings tell the friction coefficient, so that none contradicts another: 0.3 (0.2 to 0.4) together, "
        "0.3 (0.2 to 0.4) on a, not told by b alone.",
        "The recordings do not share edge wrap: b has its own, a none.",
        "Of a and b, each with its own values: hole offset (cable 1).",
        "Of b alone: gravity.",
        "note: x",
    ]
    assert (
        '0.3 (0.2 to 0.4) on "a, left", not told by "b" alone' in replace(strain, recordings=("a, left", "b")).statement
    )


def test_what_a_rig_has_its_own_value_of_is_not_said_to_be_shared():
    estimate = Estimate(0.3, 0.2, 0.4)
    rubs = SharedParameter("", "friction_coefficient", ("a", "b"), estimate, (estimate,) * 2, 1e-9, False, 0.0, ("b",))
    bends = replace(rubs, parameter="youngs_modulus_pa", agrees=True, p=0.5, own=())
    first, *_ = Common(("a", "b"), (bends, rubs), {}, {}, 5.0, ()).sentences
    assert first.startswith("The recordings bear out that the rigs share Young's modulus (the Bayes factor")
    first, second = Common(("a", "b"), (rubs,), {}, {}, 5.0, ()).sentences
    assert first.startswith("The rigs share nothing of what was found")
    assert "do not agree on the friction coefficient" in second


def test_of_sizes_that_several_rigs_have_each_for_itself_it_is_said_whether_they_agree():
    own = {"a": ("pulley_friction",), "b": ("pulley_friction",)}
    for other, said in ((0.93, ", which agree"), (0.95, ", which do not agree")):
        sizes = {"a": Estimate(0.932, 0.929, 0.935), "b": Estimate(other, other - 0.003, other + 0.003)}
        *_, last = Common(("a", "b"), (), own, {}, 0.0, (), own_sizes={"pulley_friction": sizes}).sentences
        told = f"pulley friction (0.932 (0.929 to 0.935) on a, {sizes['b']} on b{said})."
        assert last == f"Of a and b, each with its own values: {told}"


def test_what_an_unexplained_recording_tells_of_sharing_is_not_believed():
    alone = Estimate(2.0e11, 1.9e11, 2.1e11), Estimate(2.1e11, 2.0e11, 2.2e11)
    told = SharedParameter("", "youngs_modulus_pa", ("a", "b"), alone[0], alone, 0.4, True, 0.9, ())
    first, second = Common(("a", "b"), (told,), {}, {}, -10.0, (), ("b",)).sentences
    assert first.startswith("Whether the rigs share Young's modulus is not known: b is not explained")
    assert second.startswith("The recordings agree on Young's modulus")


def test_an_effect_that_is_named_after_what_it_is_measured_by_is_not_named_twice():
    estimate = Estimate(0.005, 0.004, 0.006)
    soft = SharedParameter(
        "clamp_compliance", "compliance_rad_per_n_m", ("a", "b"), estimate, (estimate,) * 2, 1, True, 1, ()
    )
    assert soft.quantity == "the clamp compliance"
    assert replace(soft, effect="notch_closing", parameter="factor").quantity == "the factor of notch closing"
    assert replace(soft, effect="gravity", parameter="y_m_s2").quantity == "the y of gravity"


def test_recordings_agree_where_two_of_them_tell_the_same():
    estimate = Estimate(0.3, 0.2, 0.4)
    told = SharedParameter("", "friction_coefficient", ("a", "b"), estimate, (estimate,) * 2, 1.0, True, 1.0, ())
    assert told.statement.startswith("The recordings agree on the friction coefficient: 0.3 (0.2 to 0.4) together, 0.3")
    neither = replace(told, alone=(Estimate(0.3), Estimate(0.3)))
    assert "agree" not in neither.statement
    rows = shared_table(Common(("a", "b"), (told, neither), {}, {}, 5.0, ())).rows
    assert [row[-1] for row in rows] == ["yes", "–"]


def test_where_nothing_is_shared_no_evidence_of_sharing_is_told():
    common = Common(("a", "b"), (), {"a": ("gravity",), "b": ()}, {}, -0.04, ("friction is not shared by a: x",))
    assert list(common.sentences) == [
        "The rigs share nothing of what was found: each recording tells its values alone.",
        "Of a alone: gravity.",
        "note: friction is not shared by a: x",
    ]


def test_what_is_not_told_is_not_drawn_and_nothing_shared_is_no_figure():
    estimate = Estimate(0.3, 0.2, 0.4)
    rubs = SharedParameter(
        "", "friction_coefficient", ("a", "c"), estimate, (estimate, Estimate(0.5)), 1.0, True, 1.0, ()
    )
    common = Common(("a", "b", "c"), (rubs,), {}, {}, 5.0, ())
    (axes,) = shared_figure(common).axes
    places = {float(row) for line in axes.lines for row in line.get_ydata()}
    assert places == {0.0, 1.0}
    assert [text.get_text() for text in axes.texts] == ["not told"]
    assert shared_figure(replace(common, shared=())) is None


def test_long_names_of_recordings_leave_room_for_what_is_drawn():
    estimate = Estimate(0.3, 0.2, 0.4)
    names = tuple(
        f"notched nitinol wrist, {k} notches of 1 mm, weaker toward the tip, pulled by one wire" for k in "45"
    )
    rubs = SharedParameter("", "friction_coefficient", names, estimate, (estimate, estimate), 1.0, True, 1.0, ())
    figure = shared_figure(Common(names, (rubs,), {}, {}, 5.0, ()))
    figure.draw_without_rendering()
    (axes,) = figure.axes
    assert axes.get_position().width > 0.4
    bottoms = [label.get_window_extent() for label in axes.get_yticklabels()]
    assert all(above.y0 > below.y1 for above, below in pairwise(bottoms))
