"""The model of several rigs at once: which parameters they share, its derivative, and what it says to one of them."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from diagnosis.sisters import recorded_sister, write_sister

import prb3r
from prb3r.diagnosis.fit.belief import Belief
from prb3r.diagnosis.fit.calibrate import nominal_noise
from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.fit.joint import JointModel
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Model
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.library import hypotheses
from prb3r.diagnosis.library.groups import groups_of
from prb3r.diagnosis.library.hypothesis import Free
from prb3r.diagnosis.library.joint import JointHypothesis, alone_on, in_common
from prb3r.diagnosis.library.scope import Scope
from prb3r.diagnosis.search.joint_pool import shared_constants
from prb3r.recording.recording import Prior, Sharing


@cache
def joint_model(parted=False, known=None):
    """Both rigs with the law that they share, gravity on the first and, if `parted`, an own stiffness of the second.

    `known`: how closely the second recording states Young's modulus; the first states none.
    """
    recordings = recorded_sister("short"), recorded_sister("thick")
    if known:
        priors = Prior(), Prior(youngs_modulus=known)
        recordings = tuple(replace(each, prior=prior) for each, prior in zip(recordings, priors, strict=True))
    rigs, libraries = [], []
    for recording in recordings:
        predict = predictor(recording)
        rigs.append(Model(predict, nominal_noise(predict)))
        libraries.append(hypotheses(Scope.of(recording, predict.chain, predict.equilibria(Constants()))))
    groups = groups_of(recordings)
    common = list(in_common(libraries, groups.of, groups.same_sections))
    law = next(each for each in common if each.name == "nonlinear_plate (law bilinear)")
    gravity = alone_on(0, next(own for own in libraries[0] if own.kind == "gravity"), 2)
    own = JointHypothesis("own log_stiffness", (None, None), (), Free("log_stiffness", 0.0, -1.0, 1.0, sd=0.4), 1)
    chosen = (law, gravity, own) if parted else (law, gravity)
    return JointModel(tuple(rigs), shared_constants(rigs, groups), chosen)


def test_the_joint_jacobian_is_the_derivative_of_the_joint_residuals():
    model = joint_model(parted=True)
    assert [(name, rigs) for name, rigs in model.varied if len(rigs) > 1] == [
        ("log_stiffness", (0, 1)),
        ("log_friction", (0, 1)),
    ]
    p = np.random.default_rng(3).normal(0, 0.01, model.count)
    jacobian = model.jacobian(p, model.solve(p))
    for k in range(model.count):
        moved = [p + sign * 1e-4 * (np.arange(model.count) == k) for sign in (-1, 1)]
        low, high = (model.residuals(each, model.solve(each)) for each in moved)
        scale = np.abs(jacobian[:, k]).max()
        assert jacobian[:, k] == pytest.approx((high - low) / 2e-4, rel=1e-4, abs=1e-4 * scale)


@pytest.mark.parametrize("known", [None, 0.003])
def test_a_recording_with_what_the_others_say_is_as_sure_as_all_together(known):
    """What the others say of shared parameters, all else of theirs free, is the marginal of a normal distribution; what
    one of them states of a shared constant is said too."""
    model = joint_model(known=known)
    fitted = fit(model, np.zeros(model.count), least_promise=model.settings.small_gain)
    assert fitted.converged
    for rig, whole in enumerate(fitted.model.maps):
        own = fitted.believed(rig)
        expected = whole @ fitted.covariance @ whole.T
        assert own.covariance == pytest.approx(expected, rel=1e-4, abs=1e-6 * np.abs(expected).max())
        assert np.abs(own.jacobian.T @ own.residual).max() < 1e-3 * np.linalg.norm(own.jacobian, axis=0).max()
        alone = fitted.part(rig)
        assert (np.diag(alone.covariance) >= np.diag(own.covariance) * (1 - 1e-6)).all()
        again = fit(own.model, own.p)
        assert again.p == pytest.approx(own.p, abs=0.02 * np.sqrt(np.diag(own.covariance)).max())


@pytest.mark.parametrize(("cables", "alone"), [((), False), (("a",), False), (("a", "b"), True)])
def test_a_rig_whose_cables_have_each_a_friction_of_their_own_shares_none(cables, alone):
    plain = joint_model()
    predict = plain.rigs[1].predict
    library = hypotheses(Scope.of(predict.recording, predict.chain, predict.equilibria(Constants())))
    own = [one for one in library if one.kind == "cable_friction" and dict(one.place)["cables"][0] in cables]
    assert len(own) == len(cables)
    model = replace(plain, hypotheses=tuple(alone_on(1, each, 2) for each in own))
    p = np.zeros(model.count)
    solved = model.solve(p)
    fitted = model.fitted(p, model.residuals(p, solved), model.jacobian(p, solved), solved, True)
    assert fitted.shares_in_name_alone == alone
    assert not replace(fitted, model=replace(model, shared={})).shares_in_name_alone
    loads = predict.recording.loads
    idle = replace(predict.recording, loads=loads._replace(tension=np.zeros_like(loads.tension)))  # hung weights alone
    rigs = model.rigs[0], replace(model.rigs[1], predict=replace(predict, recording=idle))
    assert not replace(fitted, model=replace(model, rigs=rigs)).shares_in_name_alone


def test_what_is_believed_of_some_parameters_leaves_the_others_open():
    covariance = np.array([[4.0, 1.0, 0.5], [1.0, 2.0, 0.3], [0.5, 0.3, 1.0]])
    mean = np.array([1.0, -2.0, 0.5])
    precision = np.linalg.inv(covariance)
    rows = Belief(("a", "b", "c"), precision, precision @ mean).rows(("c", "z", "a"))
    kept = [2, 0]
    normal = rows.root[:, [0, 2]].T @ rows.root[:, [0, 2]]
    assert np.linalg.inv(normal) == pytest.approx(covariance[np.ix_(kept, kept)])
    assert np.linalg.solve(normal, rows.root[:, [0, 2]].T @ rows.target) == pytest.approx(mean[kept])
    assert not rows.root[:, 1].any()


def test_files_decide_what_is_shared(tmp_path):
    """One nominal modulus and one nominal coefficient, unless a recording says otherwise."""

    def groups(**changes):
        first = recorded_sister("short")
        other = replace(recorded_sister("thick"), sharing=Sharing(**changes.pop("sharing", {})))
        return groups_of([first, replace(other, manipulator=other.manipulator.model_copy(update=changes))])

    assert groups().of == {"material": (0, 1), "friction": (0, 1)}
    assert groups().remarks == (
        "of bending laws those in strain are shared, and none in curvature, as sections differ",
    )
    assert groups(sharing={"material": False}).of == {"friction": (0, 1)}
    softer = groups(youngs_modulus_pa=1.7e11)
    assert softer.of == {"friction": (0, 1)}
    assert "170 and 187 GPa" in softer.remarks[0]
    smooth = recorded_sister("thick").manipulator.friction.model_copy(update={"coefficient": 0.1})
    assert groups(friction=smooth).of == {"material": (0, 1)}
    folder = write_sister(tmp_path / "thick", "thick", sharing={"friction": False})
    assert prb3r.load_recording(folder).sharing == Sharing(friction=False)
    text = (folder / "recording.toml").read_text().replace("friction = false", "rubbing = false")
    (folder / "recording.toml").write_text(text)
    with pytest.raises(prb3r.RecordingError, match=r"unknown.*'rubbing'|rubbing"):
        prb3r.load_recording(folder)
