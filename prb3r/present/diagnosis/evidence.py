"""Where the mismatch sits and what was chosen: missing moments, ranking of hypotheses, profiles of parameters."""

import matplotlib
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from scipy.interpolate import PchipInterpolator
from scipy.stats import norm as norm_law

from prb3r.diagnosis.fit.profile import RISE, Profile
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.result.named import Named
from prb3r.present import style
from prb3r.present.diagnosis.sheet import NOISE, Evidence, StepAxis, sheet
from prb3r.present.study.sheet import pale
from prb3r.quantities import Quantity, describe

COLD_WARM = "PuOr_r"
FADED = 0.15
KNOWN = 0.5
"""Moments of which the readings tell less than this share are hatched."""
MOST_BARS = 24


def moment_map(evidence: Evidence) -> Figure:
    """Missing moment of every plate at every step; faded where noise could make it in so large a map.

    Hatched are cells of which the readings tell little.
    """
    rows = evidence.moments
    axis, plates = StepAxis.of(rows), int(rows["plate"].max())
    handles = [
        Patch(fc=pale("#7f3b08", 2 * FADED), ec="none", label="the paler, the likelier by noise alone"),
        Patch(fc="white", ec=style.QUIET, lw=0, hatch="//////", label="hardly told by these readings"),
    ]
    figure, grid = sheet(1, 1, float(np.clip(22 + 5.0 * plates, 50, 95)), handles)
    axes = grid[0, 0]
    sure = rows["moment_n_m"].abs()[rows["known"] > KNOWN]
    chance = float(norm_law.isf(0.025 / len(rows)))
    largest = float((sure if len(sure) else rows["moment_n_m"].abs()).quantile(0.995))
    largest = max(largest, chance * float(rows["sd_n_m"].median()))
    factor, unit = (1e3, "mN m") if largest < 0.1 else (1.0, "N m")
    norm = Normalize(-largest * factor, largest * factor)
    colours = matplotlib.colormaps[COLD_WARM](norm(factor * rows["moment_n_m"].to_numpy()))[:, :3]
    beyond = (rows["moment_n_m"].abs() / (chance * rows["sd_n_m"])).to_numpy()[:, None]
    colours = 1 - np.clip(beyond**1.5, FADED, 1.0) * (1 - colours)
    known = (rows["known"] > KNOWN).to_numpy()
    for at, plate, colour, told in zip(axis.at(rows), rows["plate"], colours, known, strict=True):
        look = {"fc": colour} if told else {"fc": "white", "ec": style.PALE, "hatch": "//////"}
        axes.add_patch(Rectangle((at - 0.5, plate - 0.5), 1, 1, lw=0, **look))
    axes.grid(False)
    axes.set_ylim(0.4, plates + 0.6)
    axis.name_sequences(axes, style.DOUBLE - 40)
    axes.set_ylabel("plate, 1 at the base")
    axes.set_yticks(range(1, plates + 1, -(-plates // 14)))
    best = evidence.diagnosis.choice.structured and evidence.diagnosis.named
    left = "what is left after the best explanation" if best else "what refitted constants leave"
    axes.set_title(f"Moment that the model misses: {left}", pad=3)
    bar = figure.colorbar(ScalarMappable(norm, COLD_WARM), ax=axes, pad=0.01, fraction=0.04)
    bar.set_label(f"missing moment ({unit})")
    bar.outline.set_linewidth(0.4)
    return figure


def ranking(evidence: Evidence) -> Figure:
    """The strongest place of each kind of effect, how far it is beyond chance, who won and who rivals the winner."""
    diagnosis = evidence.diagnosis
    scores = diagnosis.before
    best: dict[str, tuple[float, Hypothesis]] = {}
    for z, direction in zip(scores.z, scores.directions, strict=True):
        subject = direction.subject
        if isinstance(subject, Hypothesis) and direction.freedom and z > best.get(subject.kind, (-1.0,))[0]:
            best[subject.kind] = float(z), subject
    order = sorted(best.items(), key=lambda item: -item[1][0])[:MOST_BARS]
    named = {each.hypothesis.kind: k for k, each in enumerate(diagnosis.named, 1)}
    rivals = {rival.hypothesis.kind: k for k, each in enumerate(diagnosis.named, 1) for rival in each.rivals}
    handles = [Line2D([], [], color=style.INK, ls=(0, (4, 2)), lw=0.8, label="by chance once in a hundred recordings")]
    looks = {
        "named": {"fc": style.PALETTE[0], "ec": style.PALETTE[0]},
        "rival": {"fc": pale(style.PALETTE[0]), "ec": style.PALETTE[0], "hatch": "//////"},
        "other": {"fc": style.PALE, "ec": style.PALE},
    }
    handles += [Patch(**looks["named"], label="named by the diagnosis")] * bool(named)
    handles += [Patch(**looks["rival"], label="cannot be told from the named one")] * bool(set(rivals) - set(named))
    handles += [Patch(**looks["other"], label="others")]
    figure, grid = sheet(1, 1, 14 + 4.1 * len(order), handles, 1.4 * style.SINGLE)
    axes = grid[0, 0]
    for row, (kind, (z, subject)) in enumerate(order):
        role = "named" if kind in named else "rival" if kind in rivals else "other"
        axes.barh(row, z, height=0.72, lw=0.6, **looks[role])
        note = _place(subject)
        if kind in rivals and kind not in named:
            winner = diagnosis.named[rivals[kind] - 1].hypothesis
            note = f"{note}; or {words(winner.kind)}" if note else f"or {words(winner.kind)}"
        axes.annotate(note, (z, row), (3, 0), textcoords="offset points", va="center", fontsize=6.5, color=style.QUIET)
    axes.axvline(scores.threshold, color=style.INK, ls=(0, (4, 2)), lw=0.8)
    axes.set_yticks(range(len(order)), [words(kind) for kind, _ in order])
    axes.set_ylim(len(order) - 0.4, -0.6)
    axes.set_xlim(0, 1.22 * max([z for _, (z, _) in order] + [scores.threshold]))
    axes.tick_params(axis="y", length=0)
    axes.grid(False, axis="y")
    axes.set_xlabel("score |z| of the effect at its best place, before any effect is added")
    return figure


def words(kind: str) -> str:
    """`weakened_plate` as `weakened plate`."""
    return kind.replace("_", " ")


def _place(subject: Hypothesis) -> str:
    place = subject.name.removeprefix(subject.kind).strip(" ()").replace("cables ", "cable ").replace("law ", "")
    return place if "+" in place else place.replace("plates ", "plate ")


def parameter(name: str) -> Quantity:
    """A parameter of an effect as a quantity."""
    known = describe(name)
    return Quantity(name, known.symbol, known.unit, known.meaning)


def profiles(evidence: Evidence) -> Figure | None:
    """Rise of chi-square as each parameter leaves its best value, all others refitted; None without intervals."""
    found = [(named, name, curve) for named in evidence.diagnosis.named for name, curve in named.profiles.items()]
    if not found:
        return None
    columns = min(len(found), 3)
    rows = -(-len(found) // columns)
    handles = [
        Line2D([], [], color=style.ALARM, ls=(0, (4, 2)), lw=0.8, label="95 %: a rise of 3.84"),
        Patch(**NOISE, label="95 % interval"),
        Line2D([], [], color=style.PALETTE[0], marker="o", ms=3, label="chi-square, all else refitted"),
    ]
    width = style.SINGLE if columns == 1 else style.DOUBLE
    figure, grid = sheet(rows, columns, 50 * rows, handles, width, sharey=True)
    for axes in grid.ravel()[len(found) :]:
        axes.remove()
    model, p = evidence.diagnosis.explained.model, evidence.diagnosis.explained.p
    friction = model.friction(p)
    for axes, (named, name, curve) in zip(grid.ravel(), found, strict=False):
        _profile(axes, named, name, curve, friction)
    for row in grid:
        row[0].set_ylabel("rise of chi-square")
    return figure


def _profile(axes, named: Named, name: str, curve: Profile, friction: float) -> None:
    free = next(free for free in named.hypothesis.free if free.name == name)
    inside = curve.rise < 4 * RISE
    u, rise = curve.u[inside], np.maximum(curve.rise[inside], 0.0)
    unique = np.concatenate([[True], np.diff(u) > 1e-12 * max(1.0, np.abs(u).max())])
    u, rise = u[unique], rise[unique]
    estimate = named.parameters[name]
    shown = style.shown(parameter(name), [free.value(each, friction) for each in u])
    value = lambda at: shown.factor * np.array([free.value(each, friction) for each in np.atleast_1d(at)])  # noqa: E731
    if len(u) > 1:
        signed = np.sqrt(rise) * np.where(np.arange(len(u)) < np.argmin(rise), -1, 1)
        fine = np.linspace(u[0], u[-1], 101)
        axes.plot(value(fine), PchipInterpolator(u, signed)(fine) ** 2, color=style.PALETTE[0], lw=1.1)
    axes.plot(value(u), rise, "o", color=style.PALETTE[0], ms=3)
    if estimate.low is not None and estimate.high is not None:
        axes.axvspan(shown.factor * estimate.low, shown.factor * estimate.high, **NOISE, zorder=0.4)
    axes.axhline(RISE, color=style.ALARM, ls=(0, (4, 2)), lw=0.8)
    axes.axvline(shown.factor * estimate.value, color=style.QUIET, lw=0.7)
    axes.set_title(words(named.hypothesis.name), pad=3)
    axes.set_xlabel(shown.label[0].lower() + shown.label[1:])
    axes.set_ylim(0, 2.2 * RISE)
    axes.margins(x=0.12)
    axes.locator_params(axis="x", nbins=5)
