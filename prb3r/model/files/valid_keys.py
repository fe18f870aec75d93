"""The keys that a table of a file may have, from the pydantic model that describes the file."""

import types
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, RootModel

from prb3r.model.files.toml_lines import Keys


def valid_keys(model: type[BaseModel], keys: Keys, data: Any, any_kind: bool = False) -> list[str]:
    """Keys that the table at `keys` of a file with the contents `data` may have.

    With `any_kind`, those of all the kinds that a table there may be, whatever its own `kind` says.
    """
    kinds = [model]
    for key in keys:
        kinds, data = [branch for kind in _fitting(kinds, data) for branch in _inside(kind, key)], data[key]
    fields = [kind.model_fields for kind in (kinds if any_kind else _fitting(kinds, data)) if _is_model(kind)]
    return [field.alias or name for branch in fields for name, field in branch.items()]


def _is_model(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)


def _inside(kind: Any, key: str | int) -> list[Any]:
    """Types that the element or field `key` of the type `kind` may have, with the members of unions one by one."""
    if _is_model(kind):
        named = [field.annotation for name, field in kind.model_fields.items() if key in (name, field.alias)]
        return [branch for annotation in named for branch in _branches(annotation)]
    arguments = get_args(kind)[1:] if isinstance(key, str) else get_args(kind)
    return [branch for argument in arguments for branch in _branches(argument)]


def _branches(kind: Any) -> list[Any]:
    """The types of which an annotated type, a union or a root model consists; else the type itself."""
    if get_origin(kind) is Annotated:
        return _branches(get_args(kind)[0])
    if get_origin(kind) in (Union, types.UnionType):
        return [branch for argument in get_args(kind) for branch in _branches(argument)]
    if _is_model(kind) and issubclass(kind, RootModel):
        return _branches(kind.model_fields["root"].annotation)
    return [kind]


def _fitting(kinds: list[Any], data: Any) -> list[Any]:
    """Those of the models `kinds` whose literal fields (such as `kind`) agree with the table `data`; all if none do."""

    def agrees(kind: Any) -> bool:
        fields = kind.model_fields.items() if _is_model(kind) and isinstance(data, dict) else ()
        literals = {name: get_args(f.annotation) for name, f in fields if get_origin(f.annotation) is Literal}
        return all(data[name] in options for name, options in literals.items() if name in data)

    return [kind for kind in kinds if agrees(kind)] or kinds
