"""The reference as Markdown: Python names from their docstrings, commands from click, files from their JSON Schemas."""

import doctest
import inspect
import re
import textwrap
from typing import Any

import click
from pydantic import BaseModel

import prb3r
from prb3r.cli import main
from prb3r.model.files.docstrings import field_docstrings
from prb3r.schema import FILES, schema_of

SECTION = re.compile(r"^(\w+)\n-+\n", re.M)
"""A heading of a numpydoc docstring."""


def reference_texts() -> dict[str, str]:
    """Markdown of every page of the reference by its name."""
    pages = {"reference-python": python_text(), "reference-commands": commands_text()}
    return pages | {f"reference-{file}": schema_text(file) for file in FILES}


def python_text() -> str:
    """What `import prb3r` offers."""
    parts = ["# Reference: Python", "`import prb3r` offers these names; `help(prb3r.solve)` shows the same."]
    for name in prb3r.__all__:
        offered = getattr(prb3r, name)
        if not isinstance(offered, str):
            parts += _described(f"prb3r.{name}", name, offered, "##")
    return "\n\n".join(parts) + "\n"


def _described(path: str, name: str, offered: Any, level: str) -> list[str]:
    parts = [f"{level} `{path}`", *_signature(name, offered), docstring_text(inspect.getdoc(offered) or "")]
    if inspect.isclass(offered) and issubclass(offered, BaseModel):
        said = field_docstrings(offered)
        fields = offered.model_fields.items()
        parts += ["\n".join(f"- `{own}`: {_plain(field.description or said.get(own, ''))}" for own, field in fields)]
    if inspect.ismodule(offered):
        for own in offered.__all__:
            parts += _described(f"{path}.{own}", own, getattr(offered, own), f"{level}#")
    if inspect.isclass(offered) and not issubclass(offered, Exception):
        for own, member in vars(offered).items():
            if not own.startswith("_") and own != "model_config" and inspect.getdoc(member) and callable(member):
                parts += _described(f"{name}.{own}", own, member, f"{level}#")
    return parts


def _signature(name: str, offered: Any) -> list[str]:
    if inspect.isclass(offered) or inspect.ismodule(offered):
        return []
    text = f"{name}{inspect.signature(offered)}"
    lines = re.sub(r"<class '([^']+)'>", r"\1", text)
    return [f"```python\n{textwrap.fill(lines, 100, subsequent_indent='    ')}\n```"]


def docstring_text(docstring: str) -> str:
    """A numpydoc docstring as Markdown: parameters and errors as lists, examples as code."""
    before, *rest = SECTION.split(docstring)
    parts = [_plain(before)]
    for title, body in zip(rest[::2], rest[1::2], strict=True):
        parts += [f"**{title}**", _examples(body) if title == "Examples" else _items(body)]
    return "\n\n".join(part for part in parts if part)


def _plain(text: str) -> str:
    """With angle brackets as they are read; in code Markdown itself sees to that."""
    return re.sub(r"(`[^`]*`)|<", lambda found: found[1] or "&lt;", text.strip())


def _items(body: str) -> str:
    """`name : meaning` or `Error` with its meaning below, as a list."""
    lines: list[str] = []
    for line in body.strip().splitlines():
        name, colon, meaning = line.partition(" : ")
        if line.startswith(" "):
            lines[-1] += f" {line.strip()}"
        else:
            lines.append(f"- `{name}`{': ' + meaning if colon else ':'}")
    return "\n".join(_plain(line) for line in lines)


def _examples(body: str) -> str:
    examples = doctest.DocTestParser().get_examples(body)
    text = "".join(example.source + textwrap.indent(example.want, "# ") for example in examples)
    return f"```python\n{text.rstrip()}\n```"


def commands_text() -> str:
    """Every command with its arguments and options."""
    parts = [
        "# Reference: commands",
        "`prb3r COMMAND --help` shows the same; exit codes are under [Commands](commands.md).",
    ]
    for name, command in main.commands.items():
        context = click.Context(command, info_name=f"prb3r {name}")
        parts += [f"## `prb3r {name}`", _plain(inspect.cleandoc(command.help or "")).replace("*", "\\*")]
        parts += [f"```text\n{' '.join(command.get_usage(context).split())}\n```"]
        rows = [option.get_help_record(context) for option in command.params]
        table = [f"| `{option}` | {_cell(help)} |" for option, help in filter(None, rows)]
        parts += ["\n".join(["| option | meaning |", "|---|---|", *table])] if table else []
    return "\n\n".join(parts) + "\n"


def schema_text(file: str) -> str:
    """Every table and key of a file."""
    schema = schema_of(file)
    shipped = f"[schemas/{file}.json](../schemas/{file}.json)"
    lead = f"Every key of a {file} file, from its JSON Schema ({shipped}, `prb3r schema {file}`); \\* is needed."
    parts = [f"# Reference: {file} files", lead, *_table(file, schema)]
    for title, part in sorted(schema.get("$defs", {}).items()):
        parts += _table(title, part)
    return "\n\n".join(parts) + "\n"


def _table(title: str, part: dict[str, Any]) -> list[str]:
    if "properties" not in part:
        return []
    rows = [
        f"| {' | '.join([_named(name, part), *(_cell(text(field)) for text in (_kind, _default, _meaning))])} |"
        for name, field in part["properties"].items()
    ]
    about = _plain(part.get("description", "").split("\n\nExamples")[0])
    return [f"## {title}", about, "\n".join(["| key | takes | default | meaning |", "|---|---|---|---|", *rows])]


def _named(name: str, part: dict[str, Any]) -> str:
    return rf"`{name}` \*" if name in part.get("required", []) else f"`{name}`"


def _meaning(field: dict[str, Any]) -> str:
    return field["description"]


def _kind(field: dict[str, Any]) -> str:
    """What a field takes, in words."""
    if "$ref" in field:
        name = field["$ref"].rsplit("/", 1)[1]
        return f"[{name}](#{name.lower()})"
    if "const" in field:
        return f"`{field['const']}`"
    if "enum" in field:
        return ", ".join(f"`{value}`" for value in field["enum"])
    if options := field.get("anyOf") or field.get("oneOf"):
        return " or ".join(dict.fromkeys(_kind(option) for option in options if option.get("type") != "null"))
    if field.get("type") == "array":
        return f"list of {_kind(field.get('items', {}))}"
    if field.get("type") == "object":
        values = field.get("additionalProperties")
        return f"table of {_kind(values)}" if isinstance(values, dict) and values else "table"
    signs = {"exclusiveMinimum": ">", "minimum": "≥", "exclusiveMaximum": "<", "maximum": "≤"}
    bounds = [f"{sign} {field[key]:g}" for key, sign in signs.items() if key in field]
    return " ".join([str(field.get("type", "anything")), ", ".join(bounds)]).strip()


def _default(field: dict[str, Any]) -> str:
    value = field.get("default")
    return "" if value in (None, "") or isinstance(value, (list, dict)) else f"`{value}`"


def _cell(text: str) -> str:
    return " ".join(_plain(text).replace("|", "\\|").split())
