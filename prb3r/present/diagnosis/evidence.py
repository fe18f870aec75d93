"""Figures of the evidence behind a diagnosis: missing moments, ranking of hypotheses, profiles of parameters."""

from typing import Any

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from prb3r.diagnosis.chance import normal_critical
from prb3r.diagnosis.confidence import INTERVAL_RISE, TAIL
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.effects import NamedEffect, ProfileCurve
from prb3r.present import style
from prb3r.present.diagnosis.panels import NOISE, StepAxis, panel_grid
from prb3r.present.diagnosis.sentences import spaced
from prb3r.present.style import pale
from prb3r.quantities import Quantity, describe

COLD_WARM = "PuOr_r"
"""Colour map of signed moments."""
FADED = 0.15
"""Least share of its colour that a moment keeps which noise alone could make."""
TOLD = 0.5
"""Moments are hatched if the readings took away no more than this share of their prior variance."""
MOST_BARS = 24
"""Kinds of effects that the ranking shows at most."""


def moment_map(diagnosis: Diagnosis) -> Figure:
    """A map of the missing moment of every plate at every step.

    Colours fade where noise alone could make such a moment somewhere in so large a map (Bonferroni).  Cells of which
    the readings tell little (`TOLD`) are hatched.
    """
    rows = diagnosis.tables["mismatch"]
    axis, plates = StepAxis.of(rows), int(rows["plate"].max())
    handles = [
        Patch(fc=pale("#7f3b08", 2 * FADED), ec="none", label="the paler, the likelier by noise alone"),
        Patch(fc="white", ec=style.QUIET, lw=0, hatch="//////", label="hardly told by these readings"),
    ]
    figure, grid = panel_grid(1, 1, float(np.clip(22 + 5.0 * plates, 50, 95)), handles)
    axes = grid[0, 0]
    sure = rows["moment_n_m"].abs()[rows["known"] > TOLD]
    chance = float(normal_critical(TAIL / len(rows)))
    largest = float((sure if len(sure) else rows["moment_n_m"].abs()).quantile(0.995))
    largest = max(largest, chance * float(rows["sd_n_m"].median()))
    factor, unit = (1e3, "mN m") if largest < 0.1 else (1.0, "N m")
    norm = Normalize(-largest * factor, largest * factor)
    colours = matplotlib.colormaps[COLD_WARM](norm(factor * rows["moment_n_m"].to_numpy()))[:, :3]
    beyond = (rows["moment_n_m"].abs() / (chance * rows["sd_n_m"])).to_numpy()[:, None]
    colours = 1 - np.clip(beyond**1.5, FADED, 1.0) * (1 - colours)
    known = (rows["known"] > TOLD).to_numpy()
    for at, plate, colour, told in zip(axis.at(rows), rows["plate"], colours, known, strict=True):
        look = {"fc": colour} if told else {"fc": "white", "ec": style.PALE, "hatch": "//////"}
        axes.add_patch(Rectangle((at - 0.5, plate - 0.5), 1, 1, lw=0, **look))
    axes.grid(False)
    axes.set_ylim(0.4, plates + 0.6)
    axis.name_sequences(axes, style.DOUBLE - 40)
    axes.set_ylabel("plate, 1 at the base")
    axes.set_yticks(range(1, plates + 1, -(-plates // 14)))
    best = diagnosis.structured and diagnosis.effects
    left = "what is left after the best explanation" if best else "what refitted constants leave"
    axes.set_title(f"Moment that the model misses: {left}", pad=3)
    bar = figure.colorbar(ScalarMappable(norm, COLD_WARM), ax=axes, pad=0.01, fraction=0.04)
    bar.set_label(f"missing moment ({unit})")
    bar.outline.set_linewidth(0.4)
    return figure


def ranking(diagnosis: Diagnosis) -> Figure:
    """Bars of the score of each kind of effect at its best place, with the threshold of chance.

    Kinds that the diagnosis names, and rivals that it cannot tell from them, stand out and are never left out.  Beside
    one that is named at another place this place is told.
    """
    rows, threshold = diagnosis.tables["ranking"], diagnosis.score_calibrated.threshold
    rows = rows[(np.arange(len(rows)) < MOST_BARS) | (rows["role"] != "other")]
    roles, named = set(rows["role"]), dict[str, list[str]]()
    for effect in diagnosis.effects:
        named.setdefault(effect.kind, []).append(effect.name.removeprefix(effect.kind).strip(" ()"))
    handles: list[Artist] = [
        Line2D([], [], color=style.INK, ls=(0, (4, 2)), lw=0.8, label="by chance once in a hundred recordings")
    ]
    looks: dict[Any, dict[str, Any]] = {
        "named": {"fc": style.PALETTE[0], "ec": style.PALETTE[0]},
        "rival": {"fc": pale(style.PALETTE[0]), "ec": style.PALETTE[0], "hatch": "//////"},
        "other": {"fc": style.PALE, "ec": style.PALE},
    }
    handles += [Patch(**looks["named"], label="named by the diagnosis")] * ("named" in roles)
    handles += [Patch(**looks["rival"], label="cannot be told from the named one")] * ("rival" in roles)
    handles += [Patch(**looks["other"], label="others")]
    figure, grid = panel_grid(1, 1, 14 + 4.1 * len(rows), handles, 1.4 * style.SINGLE)
    axes = grid[0, 0]
    for row, bar in enumerate(rows.itertuples()):
        axes.barh(row, bar.z, height=0.72, lw=0.6, **looks[bar.role])
        winner = f"or {spaced(bar.winner)}" if bar.winner else ""
        places = [short_place(place) for place in named.get(bar.effect, [bar.place])]
        elsewhere = (
            "" if short_place(bar.place) in places else f"named: {', '.join(place or 'everywhere' for place in places)}"
        )
        note = "; ".join(filter(None, [short_place(bar.place), winner, elsewhere]))
        at = (max(bar.z, threshold), row)  # beside the bar, or beyond the line that would cross it
        axes.annotate(note, at, (3, 0), textcoords="offset points", va="center", fontsize=6.5, color=style.QUIET)
    axes.axvline(threshold, color=style.INK, ls=(0, (4, 2)), lw=0.8)
    axes.set_yticks(range(len(rows)), [spaced(kind) for kind in rows["effect"]])
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.set_xlim(0, 1.22 * max([*rows["z"], threshold]))
    axes.tick_params(axis="y", length=0)
    axes.grid(False, axis="y")
    axes.set_xlabel("score |z| of the effect at its best place, before any effect is added")
    return figure


def short_place(place: str) -> str:
    """A place in few words: `cables 1` as `cable 1`; several plates at once (`3+4`) stay plural."""
    place = place.replace("cables ", "cable ").replace("law ", "")
    return place if "+" in place else place.replace("plates ", "plate ")


def profiles(diagnosis: Diagnosis) -> Figure | None:
    """Profile likelihood of each parameter: rise of chi-square with all others refitted; None without intervals."""
    curves = [(effect, name, curve) for effect in diagnosis.effects for name, curve in effect.profiles.items()]
    if not curves:
        return None
    columns = min(len(curves), 3)
    rows = -(-len(curves) // columns)
    handles = [
        Line2D([], [], color=style.ALARM, ls=(0, (4, 2)), lw=0.8, label=f"95 %: a rise of {INTERVAL_RISE:.2f}"),
        Patch(**NOISE, label="95 % interval"),
        Line2D([], [], color=style.PALETTE[0], marker="o", ms=3, label="chi-square, all else refitted"),
    ]
    width = style.SINGLE if columns == 1 else style.DOUBLE
    figure, grid = panel_grid(rows, columns, 50 * rows, handles, width, sharey=True, count=len(curves))
    for axes, (effect, name, curve) in zip(grid.ravel(), curves, strict=False):
        _profile(axes, effect, name, curve)
    for row in grid:
        row[0].set_ylabel("rise of chi-square")
    return figure


def _profile(axes, effect: NamedEffect, name: str, curve: ProfileCurve) -> None:
    """Draw the profile of the parameter `name` of an effect, with its interval and best value."""
    known, estimate = describe(name), effect.parameters[name]
    shown = style.shown(Quantity(name, known.symbol, known.unit, known.meaning), curve.value)
    axes.plot(shown.factor * curve.fine_value, curve.fine_rise, color=style.PALETTE[0], lw=1.1)
    axes.plot(shown.factor * curve.value, curve.rise, "o", color=style.PALETTE[0], ms=3)
    if estimate.low is not None and estimate.high is not None:
        axes.axvspan(shown.factor * estimate.low, shown.factor * estimate.high, **NOISE, zorder=0.4)
    axes.axhline(INTERVAL_RISE, color=style.ALARM, ls=(0, (4, 2)), lw=0.8)
    axes.axvline(shown.factor * estimate.value, color=style.QUIET, lw=0.7)
    axes.set_title(spaced(effect.name), pad=3)
    axes.set_xlabel(shown.label[0].lower() + shown.label[1:])
    axes.set_ylim(0, 2.2 * INTERVAL_RISE)
    axes.margins(x=0.12)
    axes.locator_params(axis="x", nbins=5)
