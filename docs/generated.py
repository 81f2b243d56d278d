"""Pages of the reference that mkdocs makes from the package's own data: `pages()` returns their text by path.

`python docs/generated.py DIR` writes them into a folder, for a look without mkdocs.
"""

from __future__ import annotations

import inspect
import sys
from pathlib import Path
from typing import Any

import typer
from mkdocs.structure.files import File, Files

from unitcad.checks import mould_checks
from unitcad.cli.command_line import app
from unitcad.meshcheck.rules.registry import FAMILIES, rules
from unitcad.rooms import commands


def on_files(files: Files, config: Any) -> Files:
    """Add the generated pages to those of the folder; mkdocs calls this."""
    for path, text in pages().items():
        files.append(File.generated(config, path, content=text))
    return files


def pages() -> dict[str, str]:
    """Return the generated pages by their path in docs/."""
    return {
        "reference/command-line.md": command_line(),
        "reference/mesh-rules.md": mesh_rules(),
        "reference/mould-checks.md": mould_check_page(),
    }


def mesh_rules() -> str:
    """Return a section for each rule of `unitcad check`, family by family."""
    lines = [
        "# Mesh rules",
        "",
        "An error fails `unitcad check`. A warning fails it with `--fail-on warning`, an info never does.",
        "`unitcad check --explain CODE` prints the same text.",
        "[Check meshes in CI](../how-to/checks-in-ci.md) shows how to run the rules.",
        "",
    ]
    for letter, family in FAMILIES.items():
        lines += [f"## {family}", ""]
        for rule in rules().values():
            if rule.code.startswith(letter):
                title = f"### {rule.code} {rule.title} ({rule.severity})"
                lines += [title, "", rule.cause, "", f"**Example.** {rule.example}", "", f"**Fix.** {rule.fix}", ""]
    return "\n".join(lines)


def mould_check_page() -> str:
    """Return a section for each check of `unitcad build`."""
    lines = ["# Mould checks", "", "`unitcad build` runs these checks and exits with 1 if one fails.", ""]
    for check in mould_checks().values():
        title, _, demand = check.demands.partition(": ")
        module = inspect.getmodule(check.findings)
        _, _, method = inspect.cleandoc(module.__doc__ or "").partition("\n\n") if module else ("", "", "")
        lines += [f"## {check.code} {title}", "", f"{_sentence(demand)}", "", method, ""]
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
