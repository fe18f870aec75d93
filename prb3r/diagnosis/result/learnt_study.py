"""A study that starts from a diagnosis: rigs that the recording leaves possible are the levels of a factor that nobody
chooses."""

import os
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from itertools import cycle
from pathlib import Path
from typing import Any, NamedTuple

from prb3r.diagnosis.result.design_prediction import UNEXPLAINED, read_posterior
from prb3r.diagnosis.result.learnt_design import LearntDesign, made_as, on_benches, said_of_benches, said_of_making
from prb3r.diagnosis.result.transfer import other_geometry
from prb3r.diagnosis.settings import Settings
from prb3r.errors import Problem, SpecError
from prb3r.markdown import listed
from prb3r.model.files.toml import toml_text
from prb3r.model.files.toml_lines import lines_of_keys
from prb3r.model.files.validation import validated
from prb3r.model.manipulator import Manipulator, load_manipulator
from prb3r.study.factors import Factor
from prb3r.study.resolve import base_settings
from prb3r.study.spec import Study, load_study

LEARNT = "learnt"
"""Name of the factor that is added."""
DESIGNED_PARTS = "segment", "cable", "disk"
"""Parts of a manipulator of which another value makes another rig."""


class LearntStudy(NamedTuple):
    """A study that starts from a diagnosis."""

    text: str
    """Of its file."""
    remarks: tuple[str, ...]
    """What is left behind, what is supposed, and what factors of the study do to what was learnt; comments in `text`
    too."""


def learnt_study(
    diagnosis: str | Path,
    study: str | Path,
    into: str | Path,
    count: int = Settings.learnt_rigs,
    seed: int = 0,
    same_bench: bool | None = None,
    another_copy: bool = False,
) -> LearntStudy:
    """A study file with the factor `learnt` added: `count` rigs that a diagnosis leaves possible.

    Each level sets the constants and effects of one draw: a model by its probability, then its parameters with their
    correlations.  The study then tells what the uncertainty of the diagnosis does to its metrics, as it does of
    tolerances. The factor stands before all others, which may change the design.

    Parameters
    ----------
    into : path of the file that the text is for; the path of the manipulator is written relative to its folder.
    same_bench : whether the designs stand on the bench of the recording, mounted alike; None: nobody knows, and half of
        the rigs do.
    another_copy : whether they are other rigs even where they have the geometry of the recorded one.

    Raises
    ------
    SpecError
        If a file is wrong, or if the study is a search or has a factor `learnt` already.
    """
    spec, path = load_study(study), Path(study)
    if spec.search is not None:
        reason = "a study that searches draws no rigs; take the design that it finds into a study with [sampling]"
        raise SpecError(Problem(f"{path} search", reason))
    if any(factor.name == LEARNT for factor in spec.factor):
        raise SpecError(Problem(f"{path} factor.{LEARNT}", "has what was learnt already; give the study without it"))
    design = _design(spec, path)
    posterior, verdict = read_posterior(diagnosis)
    benches = on_benches(LearntDesign(posterior, design, another_copy=another_copy, timed=False), same_bench)
    known, designs = benches[0], made_as(benches)
    carried = [where.of(draw) for draw, where in zip(known.posterior.draws(count, seed), cycle(designs))]
    drawn, left = [rig for rig, _ in carried], dict.fromkeys(reason for _, reasons in carried for reason in reasons)
    levels = [{"label": str(k), "set": dict(_changes(_plain(design), _plain(rig)))} for k, rig in enumerate(drawn, 1)]
    added = toml_text({"factor": [{"name": LEARNT, "chosen": False, "level": levels}]})
    if spec.sampling is None:
        added = toml_text({"sampling": {"method": "sobol", "count": count}}) + "\n" + added
    remarks = [*(f"left behind: {reason}" for reason in left), *known.remarks]
    remarks += [*said_of_benches(benches, half := "half of the rigs are"), *said_of_making(designs, half)]
    remarks += [*_goes_with_all(spec, known), *_in_place_of_learnt(spec, levels)]
    if verdict == "unexplained":
        remarks.append(f"{UNEXPLAINED}, and the draws leave that out")
    comment = f"# prb3r predict, of {count} draws (seed {seed}): what a diagnosis leaves possible\n"
    comment += "".join(f"# {remark}\n" for remark in remarks)
    text = path.read_text("utf-8-sig")
    there = Path(os.path.relpath((path.parent / spec.manipulator).resolve(), Path(into).parent.resolve())).as_posix()
    lines, at, whole = text.splitlines(keepends=True), lines_of_keys(text), tomllib.loads(text)
    named = at["manipulator",] - 1
    lines[named] = f'manipulator = "{there}"\n'
    tables = [line - 1 for (key, *rest), line in at.items() if not rest and _stands_alone(lines[line - 1])]
    place = min(tables, default=len(lines))
    text = f"{''.join(lines[:place]).rstrip()}\n\n{comment}{added}\n{''.join(lines[place:])}"
    more = tomllib.loads(added)
    expected = whole | {"manipulator": there} | {k: v for k, v in more.items() if k != "factor"}
    expected["factor"] = [*more["factor"], *whole.get("factor", [])]
    return LearntStudy(_checked(text, expected, path), tuple(remarks))


def _goes_with_all(study: Study, known: LearntDesign) -> Iterator[str]:
    """A sentence on what was found of the recorded rig alone, where factors of the study make other designs of it."""
    chosen = {factor.name: _paths(factor) for factor in study.factor if not factor.is_error}
    changing = [name for name, paths in chosen.items() if any(path.split(".")[0] in DESIGNED_PARTS for path in paths)]
    if known.recorded and changing:
        here = known.posterior.manipulator
        _, left = other_geometry(known.posterior.named.effects, here, here)
        for reason in left:
            yield f"with every design of {listed(changing)} goes {reason}: take it out where another rig would be built"


def _in_place_of_learnt(study: Study, levels: Iterable[Mapping[str, Any]]) -> Iterator[str]:
    """A sentence for each factor of the study that sets what the `levels` of what was learnt set to values of its
    own."""
    learnt = {path for level in levels for path in level["set"]}
    for factor in study.factor:
        again = [] if factor.added_to or factor.times else sorted(learnt.intersection(_paths(factor)))
        if again:
            yield f"factor {factor.name} sets {listed(again)}, in the place of what was learnt"


def _paths(factor: Factor) -> set[str]:
    """Paths in the manipulator that a factor sets or changes, those of its levels included."""
    levels = [path for level in factor.level or () for path in (*level.set, *(["model"] if level.model else []))]
    return {path.removeprefix("manipulator.") for path in (*factor.changed, *levels)}


def _design(study: Study, path: Path) -> Manipulator:
    """The manipulator that the cases of the study file `path` begin with: that of its file, with `model` and `set`."""
    manipulator = load_manipulator(path.parent / study.manipulator)
    try:
        return validated(base_settings(study, manipulator)["manipulator"], Manipulator)
    except KeyError as error:
        raise SpecError(Problem(f"{path} set", str(error.args[0]))) from None
    except SpecError as error:
        raise SpecError(*(Problem(f"{path} set", str(problem)) for problem in error.problems)) from None


def _stands_alone(line: str) -> bool:
    """Whether a line begins a table of its own, such as `[[factor]]`."""
    return line.lstrip().startswith("[")


def _checked(text: str, expected: dict[str, Any], path: Path) -> str:
    """The text, if it says what is `expected` after the addition, as to some ways of writing nothing can be added.

    Raises
    ------
    SpecError
        If it does not; `path` names the study.
    """
    try:
        good = tomllib.loads(text) == expected
    except tomllib.TOMLDecodeError:
        good = False
    if not good:
        reason = (
            "cannot be added to as it is written; give manipulator on a line of its own, its factors as [[factor]] and "
            "[sampling] as tables of their own"
        )
        raise SpecError(Problem(str(path), reason)) from None
    return text


def _plain(manipulator: Manipulator) -> dict[str, Any]:
    return manipulator.model_dump(exclude_none=True)


def _changes(before: Any, after: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Paths, as factors of a study have them, at which two plain manipulators with the same parts differ, each with the
    value `after`."""
    if before == after:
        return
    if isinstance(after, dict) and isinstance(before, dict) and before.keys() == after.keys():
        for key in after:
            yield from _changes(before[key], after[key], f"{path}.{key}".lstrip("."))
    elif path == "segment":
        for number, (old, new) in enumerate(zip(before, after, strict=True), 1):
            yield from _changes(old, new, f"{path}.{number}")
    else:
        yield path, after
