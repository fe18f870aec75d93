"""Recordings of sister rigs together: what they share is told better by both, and what they contradict is said."""

import html
import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from diagnosis.sisters import LAW, E, recorded_sister
from matplotlib.figure import Figure
from present.browser import stands

import prb3r
from prb3r.diagnosis import together as joined
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.result.common import common_of, write_common
from prb3r.diagnosis.run import joint_diagnosis_of
from prb3r.diagnosis.search.agreement import log_bayes_factor
from prb3r.diagnosis.search.joint_pool import fit_joint
from prb3r.diagnosis.settings import Settings
from prb3r.errors import SpecError
from prb3r.front.diagnoses import DiagnosisReport, JointReport
from prb3r.present.index import write_index
from prb3r.recording.recording import Sharing

TRUE_E, TRUE_MU = 1.05 * E, 0.27


SEARCHED = []
"""What was searched together, of every call of :func:`together` that was computed, with its result."""


@cache
def together(modulus=TRUE_E, friction=TRUE_MU):
    """The short rig and a thick one of some modulus and friction."""
    rigs = recorded_sister("short"), recorded_sister("thick", modulus, friction)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(joined, "common_of", lambda whole, names: SEARCHED.append(whole) or common_of(whole, names))
        return joined.diagnose_together([Task(recording) for recording in rigs])


def shared(found):
    return {(each.effect.split(" ")[0], each.parameter): each for each in found.common.shared}


def width(estimate):
    return estimate.high - estimate.low


@pytest.mark.long
def test_what_rigs_share_is_found_once_and_narrower_than_from_either_alone():
    found = together()
    assert [[effect.kind for effect in each.effects] for each in found.diagnoses] == [["nonlinear_plate"]] * 2
    assert found.common.log_bayes_factor > 3
    truth = {
        ("", "youngs_modulus_pa"): TRUE_E,
        ("", "friction_coefficient"): TRUE_MU,
        ("nonlinear_plate", "knee_strain"): LAW["knee_strain"],
        ("nonlinear_plate", "ratio"): LAW["ratio"],
    }
    told = shared(found)
    assert told.keys() == truth.keys()
    for key, value in truth.items():
        each = told[key]
        assert each.agrees
        assert each.probability > 0.5
        assert each.together.low - width(each.together) / 2 < value < each.together.high + width(each.together) / 2
        assert width(each.together) < 0.9 * min(map(width, each.alone))
    for diagnosis in found.diagnoses:  # the same law, each on its own geometry
        law = next(effect for effect in diagnosis.manipulators["explained"].effect if effect.kind == "nonlinear_plate")
        assert law.knee_strain == pytest.approx(told["nonlinear_plate", "knee_strain"].together.value)
        assert diagnosis.verdict == "explained"
        assert diagnosis.heldout.chi2_explained < 1.3 * diagnosis.heldout.readings


@pytest.mark.long
def test_evidence_of_sharing_is_no_evidence_of_noise():
    """The same joint models under half as much noise again, as where they leave something unexplained: what they share
    is told less well, so that its evidence is less, whatever more noise explains."""
    found = together()
    whole = next(each for each in SEARCHED if log_bayes_factor(each) == found.common.log_bayes_factor)

    def louder(single):
        fitted, doubts = single.choice.fitted, single.choice.doubts
        coarser = replace(doubts, level=doubts.level._replace(scale=1.5 * doubts.level.scale))
        return coarser.noise(fitted.model.predict, fitted.solved, fitted.model.settings)

    noises = [louder(single) for single in whole.joined]

    def under_more(survivor):
        model = survivor.fitted.model
        rigs = tuple(replace(rig, noise=noise) for rig, noise in zip(model.rigs, noises, strict=True))
        return replace(survivor, fitted=fit_joint((replace(model, rigs=rigs), survivor.fitted.p)))

    coarse = replace(whole, survivors=tuple(map(under_more, whole.survivors)))
    assert 0 < log_bayes_factor(coarse) < found.common.log_bayes_factor


def test_the_interval_beside_an_effect_is_that_of_all_recordings():
    found = together()
    strain = shared(found)["nonlinear_plate", "knee_strain"]
    for diagnosis in found.diagnoses:
        own = diagnosis.effects[0].parameters["knee_strain"]
        assert width(own) == pytest.approx(width(strain.together), rel=0.25)


@pytest.mark.long
def test_sheets_of_other_thickness_within_tolerance_are_no_other_modulus():
    """The thick rig is as stiff as of a modulus 4 % higher: the stiffness of either rig has 3 * 0.5 % of its own."""
    rigs = recorded_sister("short"), recorded_sister("thick", 1.04 * TRUE_E, TRUE_MU)
    rough = rigs[0].tolerance.model_copy(update={"thickness_relative": 0.005})
    found = joined.diagnose_together([Task(replace(recording, tolerance=rough)) for recording in rigs])
    stiffness = shared(found)["", "youngs_modulus_pa"]
    assert stiffness.agrees
    assert stiffness.probability > 0.5
    assert all(each.high / each.low > np.exp(2 * 1.96 * 0.015) for each in stiffness.alone)
    assert TRUE_E < stiffness.together.value < 1.04 * TRUE_E
    for diagnosis in found.diagnoses:
        assert diagnosis.verdict == "explained"
        assert diagnosis.posterior.tells_thickness


@pytest.mark.long
def test_contradicting_stiffnesses_are_said_and_each_rig_keeps_its_own():
    found = together(modulus=1.25 * E)
    stiffness = shared(found)["", "youngs_modulus_pa"]
    assert not stiffness.agrees
    assert stiffness.own == ("thick",)
    assert "do not agree on Young's modulus: 197" in stiffness.statement
    thick = found.diagnoses[1].constants["youngs_modulus_pa"]
    assert thick.low - (thick.high - thick.low) / 2 < 1.25 * E < thick.high + (thick.high - thick.low) / 2
    assert shared(found)["nonlinear_plate", "knee_strain"].agrees
    assert all([effect.kind for effect in each.effects] == ["nonlinear_plate"] for each in found.diagnoses)


def test_what_cannot_be_diagnosed_together_is_refused():
    short = recorded_sister("short")
    with pytest.raises(SpecError, match="two recordings are named 'short'"):
        joint_diagnosis_of([short, short])
    with pytest.raises(SpecError, match="'short' and 'copy' have the same readings, which would count twice"):
        joint_diagnosis_of([short, replace(short, name="copy")])
    with pytest.raises(SpecError, match="'short a' and 'short-a' would be written into one folder"):
        joint_diagnosis_of([replace(short, name="short a"), replace(short, name="short-a")])
    with pytest.raises(SpecError, match="two recordings or more, not 1"):
        prb3r.diagnose([short], together=True)
    with pytest.raises(SpecError, match="together=True"):
        prb3r.diagnose([short, short])


def test_the_record_is_plain_and_says_what_is_shared(tmp_path):
    found = together()
    path = write_common(found.common, tmp_path)
    record = json.loads(path.read_text())
    assert record["recordings"] == ["short", "thick"]
    strain = next(each for each in record["shared"] if each["parameter"] == "knee_strain")
    assert strain["together"]["low"] < LAW["knee_strain"] < strain["together"]["high"]
    assert strain["statement"].startswith("The recordings agree on the strain at the knee")
    assert record["own"] == {"short": [], "thick": []}


@pytest.mark.long
def test_recordings_that_share_nothing_are_told_so():
    own = Sharing(material=False, friction=False)
    found = joint_diagnosis_of([replace(recorded_sister(name), sharing=own) for name in ("short", "thick")])
    assert next(iter(found.common.sentences)).startswith("The rigs share nothing")
    assert (
        found.common.remarks[0] == "material is not shared by short and thick: under [sharing] stands material = false"
    )
    for single, other in zip(found.diagnoses, ("thick", "short"), strict=True):
        assert f"diagnosed together with {other}, with which it shares nothing that was found" in single.remarks


@pytest.mark.long
def test_what_rigs_share_is_drawn_told_and_written(tmp_path, tmp_path_factory):
    found = together()
    joint = JointReport(tuple(DiagnosisReport(**vars(each)) for each in found.diagnoses), found.common)
    table = joint.frame.set_index(["effect", "parameter", "recording"])
    whole = table.xs("together", level="recording")
    strain = whole.xs("knee_strain", level="parameter").iloc[0]
    assert strain["low"] < strain["value"] < strain["high"]
    axes = Figure().subplots(2, 2)
    assert joint.plot(axes=axes) is axes[0, 0].figure
    for each, panel in zip(found.common.shared, axes.ravel(), strict=True):
        assert [label.get_text() for label in panel.get_yticklabels()] == ["together", "short", "thick"]
        low, high = panel.lines[0].get_xdata()
        assert high / low == pytest.approx(each.together.high / each.together.low)
    with pytest.raises(ValueError, match="the kind is shared"):
        joint.plot("shapes")
    names = {path.relative_to(tmp_path).as_posix() for path in joint.report(tmp_path)}
    assert {"together.json", "report.html", "shared.svg", "short/report.html", "thick/diagnosis.json"} <= names
    stands(tmp_path / "report.html", tmp_path_factory.mktemp("browser"))
    page = (tmp_path / "report.html").read_text()
    assert all(f'href="{name}/report.html"' in page for name in ("short", "thick"))
    assert all(html.escape(text, quote=False) in html.unescape(page) for text in found.common.sentences)
    index, count = write_index(tmp_path)
    assert count == 3
    assert "Diagnosed together: short and thick" in index.read_text()
    assert "1 diagnosis of several recordings" in index.read_text()


@pytest.mark.long
def test_a_recording_that_tells_a_shared_parameter_nothing_says_so_in_plain_numbers(tmp_path):
    """As if each needed a standard deviation of nothing to tell one."""
    rigs, settings = (recorded_sister("short"), recorded_sister("thick")), Settings(untold_share=0.0)
    common = joined.diagnose_together([Task(recording, settings=settings) for recording in rigs]).common
    untold = [estimate for each in common.shared if each.effect for estimate in each.alone]
    assert untold
    assert all(np.isfinite(estimate.value) and estimate.low is None for estimate in untold)
    assert json.loads(write_common(common, tmp_path).read_text())["shared"]
