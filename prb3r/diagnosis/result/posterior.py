"""The posterior of a manipulator after a diagnosis: the surviving models, their parameters and covariances.

It is part of `diagnosis.json`, and parameters can be drawn from it without the recording.  The camera frame is left
out, as it belongs to the set-up; what remains is the marginal distribution of all other parameters.
"""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.fit.constants import Constants, friction_beside
from prb3r.diagnosis.fit.spans import spans_of
from prb3r.diagnosis.fit.tolerance import stiffness_of
from prb3r.diagnosis.library.hypothesis import Free, Hypothesis
from prb3r.diagnosis.result.as_made import PartsPosterior
from prb3r.diagnosis.result.discrepancy import Discrepancy
from prb3r.diagnosis.result.largest_bending import Bending
from prb3r.diagnosis.result.same_rig import same_geometry
from prb3r.model.effects import AnyEffect
from prb3r.model.effects.base import Effect
from prb3r.model.manipulator import Manipulator, Strict
from prb3r.recording.recording import Tolerance

FILE_NAMES = {"log_stiffness": "youngs_modulus_pa", "log_friction": "friction_coefficient"}
"""Names in files of the constants of the manipulator."""


class Drawn(NamedTuple):
    """Constants and effects of one rig that the recording leaves possible."""

    constants: Constants
    """Without the frame of the camera, which no other recording shares."""
    effects: tuple[Effect, ...]
    """Effects beside those of the nominal manipulator."""
    parts: Mapping[str, float] = {}
    """Deviations of the recorded rig's parts, by the name of the tolerance and in its unit."""


class FreeParameter(Strict):
    """A parameter of a model by its `u`, within low and high: value = null exp(u) if `log`, null / (1 - scale u) if
    `inverse`, else null + scale u."""

    name: str
    """A constant, or `effect.<number>.<parameter>`, numbers as in `effects`."""
    u: float
    null: float
    scale: float
    log: bool
    above: bool
    """Whether the value is what the friction coefficient is exceeded by."""
    low: float
    high: float
    inverse: bool = False

    @property
    def free(self) -> Free:
        """The parameter as a fit has it, with its scale and bounds, named without its effect."""
        name = self.name.rpartition(".")[2]
        plain = Free(name, self.null, self.low, self.high, self.scale, self.log, self.above)
        return plain._replace(inverse=self.inverse)


class ModelPosterior(Strict):
    """A surviving model and the normal distribution of its parameters."""

    probability: float
    named: bool
    """Whether it is the model whose effects the diagnosis names."""
    constants: dict[str, float]
    """Best values, in file units."""
    effects: list[AnyEffect]
    """With the best values."""
    free: list[FreeParameter]
    covariance: list[list[float]]
    """(f, f) of the `u` of `free`."""
    parts: PartsPosterior | None = None
    """How the parts of the rig came out."""
    discrepancy: Discrepancy | None = None
    """Between the model and the rig, where the recording is unexplained and something was read that moves."""
    moved: float | None = None
    """How far its effects move the recorded rig from where `Posterior.alone` has it, as a share of the way from the
    straight manipulator; absent where there is no such model beside it."""

    @cached_property
    def hypotheses(self) -> tuple[Hypothesis, ...]:
        """The effects as hypotheses, in their order: fitted parameters are free, all other fields are the place."""
        out = []
        for number, effect in enumerate(self.effects, 1):
            free = tuple(part.free for part in self.free if part.name.startswith(f"effect.{number}."))
            plain = effect.model_dump(exclude={"kind", *(part.name for part in free)}, exclude_none=True)
            place = tuple((key, tuple(value) if isinstance(value, list) else value) for key, value in plain.items())
            out.append(Hypothesis(effect.kind, place, free))
        return tuple(out)

    @property
    def best(self) -> np.ndarray:
        """(f,) the fitted `u` of each parameter in `free`."""
        return np.array([part.u for part in self.free])

    def within(self, u: np.ndarray, nominal: Manipulator) -> np.ndarray:
        """(f,) the drawn parameters `u`, brought within their bounds.

        Parameters beyond a bound are set to it, and the others are shifted to their conditional means given that, so
        that a draw at a bound keeps the correlations that the recording has determined.
        """
        friction, covariance = self._friction(self.best, nominal), np.array(self.covariance)
        low, high = np.array([part.free.bounds(friction) for part in self.free]).T
        drawn, clipped, held = u, np.clip(u, low, high), np.zeros(len(u), bool)
        while (beyond := ((u < low) | (u > high)) & ~held).any():
            held |= beyond
            known = np.linalg.pinv(covariance[np.ix_(held, held)], hermitian=True)
            u = drawn + covariance[:, held] @ known @ (clipped - drawn)[held]
            u[held] = clipped[held]
        return u

    def _friction(self, u: np.ndarray, nominal: Manipulator) -> float:
        """Friction coefficient of all holes that no effect singles out, for the parameters `u` (f,)."""
        constants = self._constants(u)
        return friction_beside(nominal, float(np.exp(constants.log_friction)), self._shares(u))

    def _constants(self, u: np.ndarray) -> Constants:
        """The constants of the manipulator, without a frame, for the parameters `u` (f,)."""
        names = {file_name: name for name, file_name in FILE_NAMES.items()}
        pairs = [(part, size) for part, size in zip(self.free, u, strict=True) if part.name in names]
        return Constants(**{names[part.name]: float(np.log(part.free.value(size) / part.null)) for part, size in pairs})

    def _shares(self, u: np.ndarray) -> list[tuple[Hypothesis, np.ndarray]]:
        """Every hypothesis with its part of the parameters `u` (f,), which stand behind those of the constants."""
        first = len(self.free) - sum(len(hypothesis.free) for hypothesis in self.hypotheses)
        spans = spans_of((len(hypothesis.free) for hypothesis in self.hypotheses), first)
        return [(hypothesis, u[span]) for hypothesis, span in zip(self.hypotheses, spans, strict=True)]

    def at(self, u: np.ndarray, nominal: Manipulator) -> Drawn:
        """Constants and effects for the parameters `u` (f,), each limited to its bounds, and the expected deviations of
        the recorded rig's parts given these."""
        friction = self._friction(u, nominal)
        effects = tuple(hypothesis.effect(share, friction) for hypothesis, share in self._shares(u))
        return Drawn(self._constants(u), effects, self.parts.at(u - self.best) if self.parts else {})

    def draw(self, rng: np.random.Generator, nominal: Manipulator, workshop: np.random.Generator) -> Drawn:
        """Random constants and effects from the posterior of this model, and random parts of the recorded rig.

        `rng` draws the parameters, `workshop` the parts, so that the parameters do not depend on whether parts are
        drawn.
        """
        u = self.best
        if self.free:
            u = self.within(rng.multivariate_normal(u, np.array(self.covariance), method="eigh"), nominal)
        drawn = self.at(u, nominal)
        if self.parts is None:
            return drawn
        return drawn._replace(parts=self.parts.at(u - self.best, workshop.standard_normal(len(self.parts.names))))


class Posterior(Strict):
    """The posterior of a manipulator and its effects, given a recording."""

    manipulator: Manipulator
    """Nominal; mended, where the file of the recording had blunders."""
    as_filed: Manipulator | None = None
    """As the file of the recording has it, where the diagnosis mended it; else absent."""
    mended_loads: list[str] = []
    """Blunders in the steps of the recording that the diagnosis mended, in words that follow "as if"."""
    tolerance: Tolerance = Tolerance()
    """How exactly rigs of its making are made."""
    models: list[ModelPosterior]
    """The surviving models, most probable first; probabilities add up to one."""
    reported: ModelPosterior | None = None
    """The model that predicts best where the recording is unexplained: predictions rest on it alone then, as the
    probabilities of models that all leave something say little."""
    carried: ModelPosterior | None = None
    """As `reported`, for designs of another geometry on another bench, with what it misses where the effects that stay
    behind are not there."""
    on_bench: ModelPosterior | None = None
    """As `carried`, for designs on the bench of the recording; absent in what was written before: as `carried`."""
    alone: ModelPosterior | None = None
    """Constants alone, for designs of another geometry that `carried` or `on_bench` would move farther than they move
    the recorded rig."""
    bending: Bending | None = None
    """How far plates were bent; absent in what was written before this was noted."""
    pace_s: float | None = None
    """Median time from one step of the recording to the next; absent where no times are known."""

    def is_unmended(self, design: Manipulator) -> bool:
        """Whether a design is the recorded rig as its file has it, with blunders that the diagnosis mended."""
        if self.as_filed is None or same_geometry(self.manipulator, design):
            return False
        return same_geometry(self.as_filed, design)

    def resting(self, same_geometry: bool, same_bench: bool) -> "Posterior":
        """The posterior that predictions for a design rest on: where the recording is unexplained, a single model."""
        elsewhere = (same_bench and self.on_bench) or self.carried
        alone = self.reported if same_geometry else elsewhere
        rest = dict.fromkeys(("reported", "carried", "on_bench"))
        return self.model_copy(update={"models": [alone], **rest}) if alone else self

    def without_effects(self) -> "Posterior":
        """The posterior on which designs of another geometry are predicted with constants alone."""
        return self.model_copy(update={"carried": self.alone, "on_bench": self.alone, "alone": None})

    @property
    def tells_thickness(self) -> bool:
        """Whether the thickness of an only segment is one of the parts, told apart from the modulus by other rigs."""
        return any(model.parts is not None and stiffness_of(1) in model.parts.names for model in self.models)

    @property
    def rests_on_constants(self) -> bool:
        """Whether it is of a recording that is unexplained, or explained by what cannot be, and of a model without
        effects."""
        return self.discrepancy is not None and not self.models[0].effects

    @property
    def rests_on_the_file(self) -> bool:
        """Whether predictions rest on the constants of the recorded rig's file as they are, which no fit has moved."""
        best = self.models[0].best
        return self.rests_on_constants and len(best) > 0 and not best.any()

    @property
    def discrepancy(self) -> Discrepancy | None:
        """Between the most probable model and the rig, where the recording is unexplained."""
        return self.models[0].discrepancy

    @property
    def named(self) -> Drawn:
        """Best constants and effects of the model that the diagnosis names; of the most probable one if none is
        marked."""
        chosen = next((model for model in self.models if model.named), self.models[0])
        return chosen.at(chosen.best, self.manipulator)

    @property
    def centres(self) -> list[tuple[float, Drawn]]:
        """For every model its probability, and its best constants and effects."""
        return [(model.probability, model.at(model.best, self.manipulator)) for model in self.models]

    def draws(self, count: int, seed: int) -> list[Drawn]:
        """`count` random rigs: for each a model by its probability, then the parameters of that model."""
        rng, workshop = np.random.default_rng(seed), np.random.default_rng([seed, 2])
        shares = np.array([model.probability for model in self.models])
        chosen = rng.choice(len(self.models), count, p=shares / shares.sum())
        return [self.models[k].draw(rng, self.manipulator, workshop) for k in chosen]


def averaged(parts: Sequence[tuple[float, np.ndarray]]) -> np.ndarray:
    """The weighted mean of arrays, elementwise over those arrays that are not NaN there; NaN where all are.

    `parts` holds pairs of weight and array; all arrays have the same shape.
    """
    weights, values = np.array([weight for weight, _ in parts]), np.stack([value for _, value in parts])
    weight = weights.reshape(-1, *[1] * (values.ndim - 1)) * ~np.isnan(values)
    with np.errstate(invalid="ignore"):
        return np.nansum(weight * values, 0) / weight.sum(0)
