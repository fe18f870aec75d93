"""What a TOML file holds, told from its keys: for messages on a file that stands in the place of another one."""

from collections.abc import Collection, Mapping

FILE_KINDS: Mapping[str, frozenset[str]] = {
    "recording": frozenset({"measurement", "prior", "image_centre_m", "tolerance", "sharing"}),
    "manipulator": frozenset({"segment", "cable", "disk", "youngs_modulus_pa"}),
    "study": frozenset(
        {"manipulator", "title", "factor", "step", "initial", "sweep", "cloud", "reach", "metric", "plot"}
    ),
}
"""For each kind of file the keys that tell it; a file is of the first kind of which it has any."""
WISHES = frozenset({"requirement", "preference", "designs"})
"""All keys of a file of requirements, which stand in studies too."""


def kind_of_keys(keys: Collection[str]) -> str:
    """The kind of a file with these keys at its top: a name of `FILE_KINDS`, `requirements`, or empty."""
    if keys and WISHES.issuperset(keys):
        return "requirements"
    return next((kind for kind, telling in FILE_KINDS.items() if not telling.isdisjoint(keys)), "")


def with_article(kind: str) -> str:
    """The kind in a sentence: `a study`, `a file of requirements`."""
    return "a file of requirements" if kind == "requirements" else f"a {kind}"


def wrong_kind(data: Mapping[str, object], kind: str) -> str:
    """What is said of a file with the contents `data` that stands in the place of a file of a `kind`; empty if it is of
    this kind, or of none."""
    kinds = {**FILE_KINDS, "requirements": WISHES}
    own = kinds.get(kind, data.keys()) - {"manipulator"}  # which studies and recordings name, so that it tells neither
    found = kind_of_keys(data.keys() - {"manipulator"} if kind == "recording" else data.keys())
    if found in ("", kind) or not own.isdisjoint(data.keys()):
        return ""
    named = data.get("manipulator")
    names = f"; the manipulator that it names is {named!r}" if kind == "manipulator" and isinstance(named, str) else ""
    return f"is {with_article(found)}, not {with_article(kind)}{names}"
