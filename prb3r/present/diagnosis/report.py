"""The figures and the HTML page of a diagnosis."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from prb3r import __version__
from prb3r.diagnosis.result.answer import by_sureness, exchanges, sureness, what_to_do
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.proposals import proposed
from prb3r.diagnosis.settings import Settings
from prb3r.model.files.cells import count
from prb3r.present import rc, style
from prb3r.present.diagnosis import belief
from prb3r.present.diagnosis import sentences as say
from prb3r.present.diagnosis.evidence import moment_map, profiles, ranking, short_place
from prb3r.present.diagnosis.fits import held_out_errors, residual_sizes
from prb3r.present.diagnosis.misfits import misfits
from prb3r.present.figure_files import save_figure
from prb3r.present.page import Table, picture, templates
from prb3r.quantities import describe
from prb3r.runs.files import write_whole

FIGURES: dict[str, tuple[Callable[[Diagnosis], Figure | None], str]] = {
    "shapes": (
        misfits,
        "The steps that refitted constants miss most: measured and modelled above, the difference below.",
    ),
    "missing-moment": (
        moment_map,
        "Moment that would have to act on each plate, in addition, for the model to meet the readings. Rows and "
        "columns of one colour are physics, scattered pale cells are noise.",
    ),
    "ranking": (
        ranking,
        "Every kind of effect at the place where it helps most, tested alone on what refitted constants leave; one "
        "with a short bar may be needed once others are there.",
    ),
    "profiles": (
        profiles,
        "How surely the recordings hold each parameter if what is named is all there is: all else is refitted at every "
        "point. The interval is wider where other sets of effects that stand say otherwise.",
    ),
    "residuals": (
        residual_sizes,
        "Residuals in units of the noise, made independent of each other (values beyond 6 are in the outermost bars); "
        "a right model has a root mean square of 1 everywhere. Readings down-weighted as gross outliers are left out.",
    ),
    "held-out": (held_out_errors, "The sequences that were set aside before anything was fitted."),
}
MOST_OUTLIERS = 20
"""Outliers that are listed at most."""


def publish_diagnosis(diagnosis: Diagnosis, folder: Path) -> list[Path]:
    """Draw the figures of a diagnosis and write `report.html`; the files written.

    Figures of an earlier diagnosis that this one does not have are removed.

    Raises
    ------
    EngineError
        If the files cannot be written.
    """
    files, pictures = [], {}
    for name, (_, caption) in FIGURES.items():
        figure = figure_of(diagnosis, name)
        if figure is None:  # one of an earlier diagnosis may be there
            for suffix in ("png", "svg"):
                (folder / f"{name}.{suffix}").unlink(missing_ok=True)
            continue
        files += save_figure(figure, folder, name)
        pictures[name] = picture(folder, name, caption)
    page = templates().get_template("diagnosis.html.j2").render(content(diagnosis), pictures=pictures)
    return [*files, write_whole(folder / "report.html", page.encode())]


def figure_of(diagnosis: Diagnosis, kind: str) -> Figure | None:
    """The figure of the name `kind` in `FIGURES`; None if the diagnosis has nothing to show in it."""
    drawing, _ = FIGURES[kind]
    with rc.in_use():
        return drawing(diagnosis)


def brief(diagnosis: Diagnosis) -> str:
    """The diagnosis as a piece of HTML without pictures, for notebooks."""
    return templates().get_template("diagnosis_brief.html.j2").render(content(diagnosis))


def content(diagnosis: Diagnosis) -> dict[str, object]:
    """The texts and tables of the page, by their names in its template."""
    settings = Settings(**diagnosis.settings)
    return {
        "name": diagnosis.name,
        "verdict": say.verdict_sentences(diagnosis),
        "quality": say.fit_quality(diagnosis),
        "where": diagnosis.mismatch.statement,
        "effects": [
            (f"{say.spaced(effect.name)} ({sureness(effect)})", effect.statement) for effect in by_sureness(diagnosis)
        ],
        "or_else": [f"{other.text} ({say.percent(other.probability)})" for other in exchanges(diagnosis)],
        "next": what_to_do(diagnosis),
        "partial": bool(diagnosis.why),
        "certain": say.percent(settings.certain),
        "found": say.percent(1 - settings.missed_rate),
        "far": f"{settings.listed_sd:g}",
        "nothing_named": say.nothing_named(diagnosis),
        "poor": diagnosis.structured,
        "closure": say.law_sentence(diagnosis),
        "parameters": _parameters(diagnosis),
        "errors": _errors(diagnosis),
        "held_out": say.confirmation(diagnosis),
        "alternatives": list(say.other_explanations(diagnosis)),
        "models": belief.surviving_models(diagnosis),
        "unlisted": belief.unlisted_sets(diagnosis),
        "noise": belief.noise_sentence(diagnosis),
        "tolerances": belief.tolerance_table(diagnosis),
        "checks": belief.check_table(diagnosis),
        "rare": belief.rare_checks(diagnosis),
        "standing": belief.standing_sets(diagnosis),
        "other_designs": list(belief.carry_over(diagnosis)),
        "nothing_else": say.nothing_else(diagnosis),
        "nothing_to_measure": say.nothing_to_measure(diagnosis),
        "proposals": [
            (program.statement, _steps(program.experiment.steps) if program.resolves else None)
            for program in proposed(diagnosis.experiments)
        ],
        "constants": _constants(diagnosis),
        "hidden": list(say.bias_of_calibration(diagnosis)),
        "constants_told": say.constants_in_brief(diagnosis),
        "clues": _clues(diagnosis),
        "detectable": _detectable(diagnosis),
        "outliers": _outliers(diagnosis),
        "remarks": diagnosis.remarks,
        "made": list(_made(diagnosis)),
        "mended": bool(diagnosis.setup),
    }


def _parameters(diagnosis: Diagnosis) -> Table | None:
    """A row for each parameter of the named effects; None without any.

    Probabilities are left out where no set of effects explains the recording.
    """
    partial, rows = bool(diagnosis.why), []
    for effect in by_sureness(diagnosis):
        gain = "–" if effect.heldout_gain is None else say.gain_text(effect.heldout_gain)
        for key, estimate in effect.parameters.items() or [("", None)]:
            value, interval = say.estimate_texts(key, estimate) if estimate else ("–", "–")
            title = say.parameter_title(key) if key else "–"
            presence = [] if partial else [say.percent(effect.probability) + (", certain" if effect.certain else "")]
            about = [say.spaced(effect.name), title, value, interval, *presence]
            rows.append([*about, say.rounded(effect.delta_bic), gain])
    head = ["Effect", "Parameter", "Value", "95 % interval", *([] if partial else ["Probability"])]
    return Table([*head, "Change of BIC", "Held-out gain"], rows, (0, 1)) if rows else None


def _errors(diagnosis: Diagnosis) -> Table:
    """Errors of the nominal, calibrated and explained model: chi-square of fitted, RMS of held-out sequences."""
    held, named, chi2 = diagnosis.heldout, bool(diagnosis.effects), diagnosis.chi2
    ratios = (chi2.nominal, chi2.calibrated, chi2.explained if named else None, 1.0)
    rows = [["Squared error per degree of freedom, fitted sequences", *map(say.rounded, ratios)]]
    if held is not None:
        for read, unit in (("positions", "m"), ("angles", "rad")):
            before, after, noise = (
                getattr(held, f"{key}_{unit}") for key in ("rmse_calibrated", "rmse_explained", "noise")
            )
            if before is not None:
                errors = (before, after if named else None, noise)
                values = [say.value_text(f"error_{unit}", error) for error in errors]
                rows.append([f"Root mean square error of {read}, held out", "–", *values])
    return Table(
        ["", "Nominal", f"{say.constants_in_brief(diagnosis)} refitted", "With what is named", "Noise alone"], rows
    )


def _constants(diagnosis: Diagnosis) -> Table:
    models = {"nominal": "Nominal", "calibrated": "Refitted alone", "explained": "With what is named"}
    if not diagnosis.effects:
        del models["explained"]
    rows = []
    for name, constant in diagnosis.constants.items():
        if constant.nominal:
            interval = say.estimate_texts(name, constant.estimate)[1] if np.isfinite(constant.low) else "–"
            values = [say.value_text(name, getattr(constant, key)) for key in models]
            rows.append([say.CONSTANTS[name], *values, interval])
    return Table(["", *models.values(), "95 % interval"], rows)


def _clues(diagnosis: Diagnosis) -> Table | None:
    """Factors on the refitted constants that each part of the recording alone would have, with their distance from 1;
    None without."""

    def factor(value: float | None, sd: float | None) -> str:
        return "–" if value is None or sd is None else f"{value:.3f} ± {sd:.3f}"

    def away(value: float | None, sd: float | None) -> float:
        return 0.0 if value is None or not sd else abs(value - 1) / sd

    rows, factors = [], [f"{symbol}, factor" for symbol in say.constants_in_brief(diagnosis).split(" and ")]
    for clue in diagnosis.clues:
        far = max(away(clue.stiffness, clue.stiffness_sd), away(clue.friction, clue.friction_sd))
        values = factor(clue.stiffness, clue.stiffness_sd), factor(clue.friction, clue.friction_sd)
        part = re.sub(r"^disks (\d+) to \1$", r"disk \1", clue.part)
        rows.append([clue.by, part, *values[: len(factors)], f"{far:.1f} sd"])
    head = ["By", "Part", *factors, "Farthest from 1"]
    return Table(head, rows, (0, 1), sortable=True) if rows else None


def _detectable(diagnosis: Diagnosis) -> Table | None:
    """The smallest change of each kind of effect that the recording would have shown; None without any."""
    rows, named = [], {effect.kind for effect in diagnosis.effects}
    for row in diagnosis.tables["detectable"].to_dict("records"):
        if np.isfinite(row["size"]):
            size = (
                f"{say.parameter_title(row['parameter'])} by {say.value_text(row['parameter'], row['size'], digits=2)}"
            )
        else:
            more = "more than is named " if row["effect"] in named else ""
            size = f"{more}would have shown" if row["shown"] else f"{more}would not have shown at any likely size"
        rows.append([say.spaced(row["effect"]), short_place(row["place"]) or "–", size])
    head = ["Effect", "Seen best at", "Smallest change that would have shown"]
    return Table(head, rows, (0, 1, 2), sortable=True) if rows else None


def _outliers(diagnosis: Diagnosis) -> Table | None:
    """Readings that are far off or down-weighted, up to `MOST_OUTLIERS`; None without any."""
    outliers = diagnosis.tables["outliers"]
    texts = []
    for row in outliers.head(MOST_OUTLIERS).to_dict("records"):
        values = [say.value_text(row["kind"], row[key], digits=4) for key in ("measured", "explained")]
        symbol = describe(row["kind"]).symbol or row["kind"]
        done = "down-weighted" if row["weighed_down"] else ""
        texts.append([str(row["sequence"]), str(row["step"]), str(row["disk"]), symbol, *values, done])
    if len(outliers) > MOST_OUTLIERS:
        texts.append(["and more", f"{len(outliers) - MOST_OUTLIERS}", *[""] * 5])
    head = ["Sequence", "Step", "Disk", "Reading", "Measured", "Predicted", ""]
    return Table(head, texts, (0, 3, 6), sortable=len(outliers) <= MOST_OUTLIERS) if texts else None


def _steps(steps: pd.DataFrame) -> Table | None:
    """The steps of a load program, without loads that are zero and slips that are -1 at every step; None if none is
    left."""
    loads = [name for name in steps if name not in ("sequence", "step") and not str(name).startswith("slip_")]
    used = ["step", *(name for name in loads if (steps[name] != 0).any())]
    used += [name for name in steps if str(name).startswith("slip_") and (steps[name] != -1).any()]
    if used == ["step"]:
        return None
    rows = [[style.digits(float(row[name])) for name in used] for row in steps.to_dict("records")]
    return Table([style.shown(describe(str(name))).label for name in used], rows, ())


def _made(diagnosis: Diagnosis) -> Iterator[tuple[str, str]]:
    """Name and value of each line on how the diagnosis was made."""
    readings, loads = diagnosis.tables["residuals"], diagnosis.tables["loads"]
    yield "Recording", diagnosis.name
    yield "Manipulator", diagnosis.nominal.name
    yield (
        "Readings",
        f"{len(readings):,} in {count(len(loads), 'step')} of {count(loads['sequence'].nunique(), 'sequence')}",
    )
    yield "Seed", str(diagnosis.seed)
    yield "Written by", f"prb3r {__version__}"
