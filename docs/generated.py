"""Pages of the reference that mkdocs makes from the package's own data: `pages()` returns their text by path.

`python docs/generated.py DIR` writes them into a folder, for a look without mkdocs.
"""

from __future__ import annotations

import inspect
import re
import sys
import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import typer
from mkdocs.structure.files import File, Files
from msgspec import Struct

from unitcad.arrays import layouts
from unitcad.checks import explain, mould_checks
from unitcad.cli.command_line import app
from unitcad.lab.record import RULES
from unitcad.meshcheck.rules.registry import FAMILIES, Rule, rules
from unitcad.rooms import commands, file_kinds, load
from unitcad.spec.fields import default_of, entry_in, fields_of, meaning, named_in, table_in, values_of
from unitcad.spec.raw import RawSpec

FILES = [kind for kind in file_kinds() if kind.model]


def on_files(files: Files, config: Any) -> Files:
    """Add the generated pages to those of the folder; mkdocs calls this."""
    for path, text in pages().items():
        if written := files.get_file_from_path(path):  # the page of a spec has its keys added
            files.remove(written)
        files.append(File.generated(config, path, content=text))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Return a page's text with plain fences: a second word, which tests read, would hide them from mkdocs."""
    return re.sub(r"(?m)^```(\w+) (?:notebook|brep)$", r"```\1", markdown)


def pages() -> dict[str, str]:
    """Return the generated pages by their path in docs/."""
    return {
        "reference/command-line.md": command_line(),
        "reference/mesh-rules.md": mesh_rules(),
        "reference/mould-checks.md": mould_check_page(),
        "reference/recording-findings.md": recording_findings(),
        "reference/spec.md": spec_page(),
        **{
            f"reference/{kind.name}-file.md": keys_of_file(kind.name, load(kind.model))
            for kind in FILES
            if kind.name != "spec"
        },
    }


def spec_page() -> str:
    """Return the page of the spec as written, with the keys of every table after it."""
    written = (Path(__file__).parent / "reference" / "spec.md").read_text("utf-8")
    keys = keys_of_file("spec", RawSpec).partition("\n## ")[2]
    return f"{written.rstrip()}\n\n## {keys}"


def mesh_rules() -> str:
    """Return a table of all rules of `unitcad check`, and a fold for each, family by family.

    A phone shows no table: there the folds are the list of the codes.
    """
    lines = [
        "# Mesh rules",
        "",
        "An error fails `unitcad check`. A warning fails it with `--fail-on warning`, an info never does.",
        "`unitcad check --explain CODE` prints the same text.",
        "[Check meshes in CI](../how-to/checks-in-ci.md) shows how to run the rules.",
        "",
        '<div class="wide" markdown>',
        "",
        "| code | finding | severity |",
        "| --- | --- | --- |",
        *(f"| [{rule.code}](#{rule.code.lower()}) | {rule.title} | {rule.severity} |" for rule in rules().values()),
        "",
        "</div>",
        "",
    ]
    for letter, family in FAMILIES.items():
        lines += [f"## {family}", ""]
        for rule in rules().values():
            if rule.code.startswith(letter):
                title, *text = _rule(rule, "###")
                lines += [
                    "<details markdown>",
                    '<summary markdown="block">',
                    "",
                    title,
                    "",
                    "</summary>",
                    *text,
                    "</details>",
                    "",
                ]
    return "\n".join(lines)


def _rule(rule: Rule, level: str) -> list[str]:
    title = f"{level} {rule.code} {rule.title} ({rule.severity}) {{#{rule.code.lower()}}}"
    return [title, "", rule.cause, "", f"**Example.** {rule.example}", "", f"**Fix.** {rule.fix}", ""]


def recording_findings() -> str:
    """Return a section for each finding of `unitcad measure`."""
    lines = ["# Findings on recordings", "", "A record with an error counts for no level.", ""]
    return "\n".join([*lines, *(line for rule in RULES.values() for line in _rule(rule, "##"))])


def mould_check_page() -> str:
    """Return a section for each check of `unitcad build`."""
    lines = ["# Mould checks", "", "`unitcad build` runs these checks and exits with 1 if one fails.", ""]
    lines += [f"## {explain(code)}\n" for code in mould_checks()]
    return "\n".join(lines)


def command_line() -> str:
    """Return a section for each command: its arguments and options."""
    group = typer.main.get_command(app)
    context = typer.Context(group, info_name="unitcad")
    lines = ["# Command line", "", "`unitcad COMMAND --help` prints the same text.", ""]
    for name, listed in commands().items():
        command = group.get_command(context, name)
        lines += [f"## unitcad {name}", "", listed.help, "", *_command(command, f"unitcad {name}")]
        for child in getattr(command, "commands", {}).values():
            lines += [f"### unitcad {name} {child.name}", "", *_command(child, f"unitcad {name} {child.name}")]
    return "\n".join(lines)


def _command(command: Any, words: str) -> list[str]:
    context = typer.Context(command, info_name=words)
    usage = " ".join([words, *command.collect_usage_pieces(context)])
    text = inspect.cleandoc(command.help or "")
    rows = [row for parameter in command.params if (row := parameter.get_help_record(context))]
    lines = ["```text", usage, "```", "", text, ""]
    if rows:
        cells = [f"| `{name}` | {' '.join(meaning.split())} |".replace("\\|", "|") for name, meaning in rows]
        lines += ["| argument or option | meaning |", "| --- | --- |", *cells, ""]
    return [*lines, *([inspect.cleandoc(command.epilog), ""] if command.epilog else [])]


def keys_of_file(name: str, model: type[Struct]) -> str:
    """Return the tables and keys of a kind of file."""
    lines = [
        f"# Keys of the {name.replace('-', ' ')} file",
        "",
        f"`unitcad schema {name}` prints the JSON Schema of the file for an editor. Lengths are in mm.",
        "Unknown keys, wrong types, NaN and infinity are refused.",
        "",
    ]
    for header, table in tables(model):
        if model is not RawSpec and table in set(dict(tables(RawSpec)).values()):
            lines += [f"## {header}", "", "The same keys as in a [spec file](spec.md).", ""]
            continue
        about = inspect.cleandoc(table.__doc__ or "").partition("\n\n")[0]
        lines += [f"## {header or 'The file'}", "", about, "", *_keys(table)]
    if name == "array":
        for kind in layouts.layouts().values():
            lines += [f'## [layout] with kind = "{kind.name}"', "", _sentence(kind.about), "", *_keys(kind.table)]
    return "\n".join(lines)


def tables(model: type[Struct], path: str = "") -> Iterator[tuple[str, type[Struct]]]:
    """Return the tables of a file with their headers as in TOML, the file's own keys first."""
    yield (f"[{path}]" if path else ""), model
    for key, field in fields_of(model).items():
        inner = f"{path}.{key}" if path else key
        if table := table_in(field.type):
            yield from tables(table, inner)
        elif table := table_in(entry_in(field.type)):
            yield f"[[{inner}]]", table
            yield from list(tables(table, inner))[1:]
        elif kind := named_in(field.type):
            deeper = named_in(kind)
            if table := table_in(deeper or kind):
                yield f"[{inner}.NAME{'.LAYER' if deeper else ''}]", table


def _keys(table: type[Struct]) -> list[str]:
    rows = ["| key | value | default | meaning |", "| --- | --- | --- | --- |"]
    for key, field in fields_of(table).items():
        default = "required" if field.required else f"`{default_of(field)}`" if default_of(field) else ""
        text = meaning(field.type)
        if not text and (inner := table_in(field.type) or table_in(entry_in(field.type)) or _named(field.type)):
            text = inspect.cleandoc(inner.__doc__ or "").partition("\n")[0].rstrip(".")
        if not text and typing.get_origin(field.type) is not typing.Literal:
            raise ValueError(f"{table.__name__}.{key} has no description")
        rows.append(f"| `{key}` | {_code(values_of(field.type))} | {default} | {text[:1].upper()}{text[1:]} |")
    return [*rows, ""]


def _named(kind: Any) -> type[Struct] | None:
    """Return the table of any name that a kind allows, such as an entry of [materials]."""
    return table_in(kind) or (_named(inner) if (inner := named_in(kind)) else None)


def _code(words: str) -> str:
    return re.sub(r'"[^"]*"|\b(?:true|false)\b', lambda word: f"`{word[0]}`", words)


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}."


def main() -> None:
    """Write the pages into the folder of the first argument."""
    for name, text in pages().items():
        target = Path(sys.argv[1]) / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(text, "utf-8")


if __name__ == "__main__":
    main()
