"""Every shipped study, run in small, asserts one of its numbers."""

import numpy as np
import pytest
from study.small import STUDIES, small

from prb3r.study.axes import count_cases
from prb3r.study.plan import plan_study


def test_model_accuracy_meets_the_published_error():
    frame = small("model-accuracy", cable_1_n=[50.0, 120.0, 200.0], model=["elastica", "PRB 3R (Chen)", "PRB 1R"])
    error = frame.groupby("model")["tip_error"].max()
    assert error["PRB 3R (Chen)"] == pytest.approx(0.00077, abs=5e-5)  # Table 2: 0.081 %
    assert 0.02 < error["PRB 1R"] < 0.05


def test_bending_curvature_friction_breaks_constant_curvature_well_before_90_degrees():
    frame = small("bending-curvature", cable_1_n=[0.0, 40.0, 60.0])
    error = frame.pivot_table(index="cable_1_n", columns="statics", values="curvature_error_y")
    angle = frame.pivot_table(index="cable_1_n", columns="statics", values="total_angle_rad")
    assert error["no friction"].max() < 1e-4
    assert error.loc[60.0, "friction 0.3"] > 0.02
    assert angle.loc[60.0, "friction 0.3"] < np.radians(90)


def test_friction_direction_reproduces_fig_12():
    frame = small("friction-direction", mu=[0.1, 0.3, 0.5]).query("order == 'cable 3 first'")
    assert (frame["disk7_order_shift_m"] * 1e3).tolist() == pytest.approx([5.6, 16.9, 29.0], abs=0.06)
    assert (frame["tip_order_shift_m"] * 1e3).tolist() == pytest.approx([26.2, 79.9, 137.7], abs=0.06)


def test_initial_configuration_has_its_changing_point_where_segment_1_is_straight():
    frame = small("initial-configuration", cable_2_n=[0.0, 40.0, 60.0, 70.0, 100.0, 120.0])
    assert frame["changing_point_n"].tolist() == pytest.approx([50 * 0.0255 / 0.021] * len(frame), abs=1e-6)
    rubbing = frame[frame["mu"] == 0.3].set_index("cable_2_n")["disk7_shift_m"] * 1e3
    assert rubbing.loc[[0, 40, 60]].tolist() == pytest.approx([59.5] * 3, abs=0.11)
    assert rubbing.loc[[70, 100, 120]].tolist() == pytest.approx([57.2, 47.0, 37.7], abs=0.06)
    assert np.ptp(frame[frame["mu"] == 0]["disk7_shift_m"]) < 1.2e-3


def test_stiffness_coupling_reproduces_fig_15():
    frame = small("stiffness-coupling", thickness_ratio=[1.0, 2.0])
    angle = np.degrees(frame.set_index(["thickness_ratio", "cable_1_n"])["disk7_angle_rad"])
    assert angle.loc[1.0].tolist() == pytest.approx([11.7, 22.8, 33.3], abs=0.06)
    assert angle.loc[2.0].tolist() == pytest.approx([1.5, 3.0, 4.4], abs=0.06)


def test_workspace_shrinks_with_stiffness_at_equal_tension_and_converges():
    frame = small("workspace", cloud=8192, thickness_ratio=[1.0, 2.0]).set_index(["limit", "thickness_ratio"])
    area = frame["workspace_area_m2"]
    assert area["equal tension", 1.0] > 3 * area["equal tension", 2.0]
    assert area["equal bend", 2.0] > 5 * area["equal tension", 2.0]
    many = small("workspace", cloud=32768, thickness_ratio=[2.0])
    assert many["workspace_half_share"].between(0.95, 1.0).all()
    assert (many["workspace_area_m2"].to_numpy() >= frame.query("thickness_ratio == 2")["workspace_area_m2"]).all()


def test_broken_cables_never_add_to_the_workspace():
    frame = small("broken-cables", cloud=8192, thickness_ratio=[1.0, 2.0], limit=["equal tension"])
    retained = frame.set_index(["thickness_ratio", "broken"])["area_retained"]
    assert retained.max() <= 1
    assert retained[:, "2 and 3"].max() < 0.02  # the tip keeps to a curve
    mirrored = frame.set_index(["thickness_ratio", "broken"])["workspace_area_m2"]
    assert mirrored[1.0, "1"] == pytest.approx(mirrored[1.0, "4"], rel=0.05)


def test_fig_16_the_outline_does_not_depend_on_stiffness_where_the_force_grows_with_it():
    frame = small("workspace", cloud=32768, thickness_ratio=[1.0, 2.0], limit=["force grows with stiffness"])
    ratio = frame.set_index("thickness_ratio").loc[2.0]
    assert ratio["relative_hull"] == pytest.approx(1.0, abs=0.04)
    assert ratio["relative_width"] == pytest.approx(1.0, abs=0.03)
    assert ratio["relative_area"] > 1.1  # and the area is larger
    at_equal_force = small("workspace", cloud=4096, thickness_ratio=[1.0, 2.0], limit=["equal tension"])
    assert at_equal_force.set_index("thickness_ratio").loc[2.0, "relative_hull"] < 0.1


def test_fig_17_a_soft_segment_1_keeps_more_where_it_bent_no_more_before():
    """Independent march: hull and width 42 and 86 % of equal segments, 3.9 and 37 % of 8 EI.  Both keep a curve."""
    keep = {"limit": ["force grows with stiffness"], "broken": ["none", "2 and 3"], "thickness_ratio": [1.0, 2.0]}
    frame = small("broken-cables", cloud=32768, **keep).query("broken == '2 and 3'")
    columns = ["area_retained", "hull_retained", "width_retained"]
    soft, stiff = frame.set_index("thickness_ratio")[columns].to_numpy()
    assert soft == pytest.approx([0.0, 0.42, 0.86], abs=0.02)
    assert stiff == pytest.approx([0.0, 0.039, 0.37], abs=0.02)


def test_fig_10_loci_at_equal_x_part_by_2_percent_near_75_degrees():
    frame = small("bending-curvature", statics=["friction 0.3", "no friction"])
    rubbing = frame[frame["statics"] == "friction 0.3"]
    at = np.interp(0.02, rubbing["locus_error_y"][1:], np.degrees(rubbing["total_angle_rad"][1:]))
    assert 73 <= at <= 77
    assert frame.loc[frame["statics"] == "no friction", "locus_error_y"].max() < 1e-3


def test_follow_path_is_followed_with_all_cables_and_lost_without_those_of_segment_1():
    frame = small("follow-path", every=3, broken=["none", "2 and 3"]).set_index("broken")
    assert frame.loc["none", "reached_share"] == 1.0
    assert frame.loc["2 and 3", "reached_share"] < 0.2


def test_experiments_bend_as_far_as_the_statics_without_a_tip_load_say():
    frame = small("experiments").set_index("experiment")
    one = frame[frame["setup"] == "cable 1"]
    assert one["tip_y_m"].is_monotonic_increasing
    shift = frame.loc["2.5, then 10 kg", ["tip_x_m", "tip_y_m"]].to_numpy(float)
    first = frame.loc["10, then 2.5 kg", ["tip_x_m", "tip_y_m"]].to_numpy(float)
    assert np.hypot(*(shift - first)) == pytest.approx(0.0799, abs=6e-5)  # Fig. 11, at the disk's centre


@pytest.mark.long
def test_the_issue_asks_for_a_hundred_thousand_configurations_and_nine_studies():
    names = {path.stem for path in STUDIES.glob("*.toml")}
    plans = {name: plan_study(STUDIES / f"{name}.toml") for name in names}
    assert len(names) >= 9
    assert all(plan.study.name == name for name, plan in plans.items())
    assert all(count_cases(plan.study) == len(plan.cases) for plan in plans.values())
    for name in ("workspace", "broken-cables"):
        assert all(family.settings["cloud"]["count"] >= 100_000 for family in plans[name].cases.families)


def test_loading_order_history_moves_the_tip_less_than_full_reversal():
    frame = small("loading-order", mu=[0.1, 0.3, 0.6]).query("order == 'cable 3 first'")
    shift = frame.set_index(["mu", "direction"])["tip_order_shift_m"] * 1e3
    assert shift[0.3, "declared"] == pytest.approx(79.9, abs=0.06)
    assert shift[0.3, "history"] == pytest.approx(66.5, abs=0.5)  # independent simulation: 67 mm
    assert shift[0.1, "history"] == pytest.approx(shift[0.1, "declared"], rel=0.03)
    assert shift[0.6, "history"] < 0.6 * shift[0.6, "declared"]


def test_effects_gallery_every_effect_shows():
    change = small("effects-gallery").set_index("effect")["tip_change_m"]
    assert change["nominal"] == 0
    assert (change.drop("nominal") > 1e-4).all(), change


def test_tilt_sags_in_proportion_to_gravity_while_it_is_small():
    frame = small("tilt", sideways_m_s2=[-0.4, -0.2, 0.0], cable_1_n=[20.0, 100.0])
    sag = frame.set_index(["cable_1_n", "sideways_m_s2"])["tip_sag_m"]
    for pull in (20.0, 100.0):
        assert sag[pull, -0.4] == pytest.approx(2 * sag[pull, -0.2], rel=0.02)
    assert sag[100.0, -0.4] < sag[20.0, -0.4]


def test_three_segments_a_drive_bends_what_it_passes_but_nothing_beyond():
    frame = small("three-segments", mu=[0.0, 0.3]).set_index(["mu", "driven"])
    for mu in (0.0, 0.3):
        base = frame.loc[(mu, "base")]
        assert base["tip_angle_rad"] == pytest.approx(base["disk5_angle_rad"], abs=1e-9)
        assert frame.loc[(mu, "tip"), "disk5_angle_rad"] > base["disk5_angle_rad"]  # outer holes, longer lever
    assert frame.loc[(0.3, "tip"), "tip_angle_rad"] < frame.loc[(0.0, "tip"), "tip_angle_rad"]


def test_hysteresis_loops_need_friction_and_grow_with_it():
    frame = small("hysteresis", mu=[0.0, 0.2, 0.5], presliding_m=[3e-5, 5e-3])
    table = frame.set_index(["presliding_m", "mu"]).sort_index()
    for name in ("tip_loop_area_n_m", "disk7_loop_area_n_m", "tip_loop_opening_m", "disk7_loop_opening_m"):
        for presliding in (3e-5, 5e-3):
            none, some, much = table.loc[presliding, name]
            assert none < 1e-12 < some < much
        assert (table.loc[3e-5, name].iloc[1:] > table.loc[5e-3, name].iloc[1:]).all()
    assert (table["lowest_eigenvalue_n_m_per_rad"] > 0).all()  # every table has it, with history too
    dead = table["tip_dead_band_n"]
    assert dead[3e-5, 0.0] == pytest.approx(2.87, abs=0.01)
    assert dead[3e-5, 0.5] == pytest.approx(10.8, abs=0.1)


def test_coupling_history_full_reversal_holds_for_a_large_second_load_only():
    frame = small("coupling-history", cable_1_n=[10.0, 50.0], cable_3_kg=[2.5, 5.0, 7.5, 10.0])
    shift = 1e3 * frame.set_index(["cable_1_n", "direction", "cable_3_kg"])["disk7_shift_m"].sort_index()
    assert shift[50.0, "declared"].tolist() == pytest.approx([59.6, 59.6, 56.3, 47.9], abs=0.06)
    assert shift[50.0, "history"].tolist() == pytest.approx(shift[50.0, "declared"].tolist(), abs=0.01)
    error = 1e3 * frame.set_index(["cable_1_n", "direction", "cable_3_kg"])["tip_prescription_error_m"]
    assert error[10.0, "declared", 10.0] == pytest.approx(43.0, abs=0.5)  # rig: 43.0 mm
    assert shift[10.0, "history", 10.0] == pytest.approx(2.7, abs=0.1)  # rig: 2.7 mm


def test_after_diagnosis_the_lossy_pulley_shows_where_the_cable_is_let_out():
    """Drawn in, refitted constants stand in for the pulley; let out, its loss changes sides and they do not."""
    frame = small("after-diagnosis", thickness_1_m=[0.0008])
    error = frame.set_index(["physics", "way"])["tip_error_m"]
    refitted = error["constants refitted alone"]
    assert refitted["drawn in"] < 0.5 * error["nominal"]["drawn in"]
    assert refitted["let out"] > error["nominal"]["let out"] > 0.05
    assert (error["explained"] == 0).all()
