"""unitcad design."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from unitcad.cli.shared_options import AsJson


def design(
    target: Annotated[
        str, typer.Argument(metavar="TARGET", help="A TOML file of what is wished for, or a shipped one's name.")
    ],
    out: Annotated[Path, typer.Option("-o", "--out", help="Where the result's folder goes.")] = Path("out"),
    explain: Annotated[
        str | None,
        typer.Option(metavar="NAME|SPEC", help="Say why a unit is not among the proposals; nothing is written."),
    ] = None,
    no_check: Annotated[bool, typer.Option("--no-check", help="Draw no moulds: the best may not be castable.")] = False,
    as_json: AsJson = False,
) -> None:
    """From a wish to designs: try everything at hand and rank it.

    Each proposal has its probability of meeting the level at the edge, with a range, and what no measurement covers.
    The last line printed is the folder: ranking.csv, front.svg, design.md, design.html, and specs to build.
    """
    from unitcad.cli.output import console, print_json, progress
    from unitcad.files import seen_from
    from unitcad.search import design_files
    from unitcad.search.design_words import explanation_lines
    from unitcad.search.explanation import explain as explained
    from unitcad.search.proposals import invert
    from unitcad.search.target_file import load_target

    wish = load_target(target)
    if explain is None:
        design_files.check_out(out)
    with progress("design") as stage:
        made = invert(wish, check=not no_check, say=stage)
        if explain is None:
            folder = design_files.folder_of(wish.name, out)
            found = design_files.contents(made, seen_from(folder), stage)
            design_files.write(folder, found)
    if explain is not None:
        reasons = explained(made, explain)
        if as_json:
            print_json(reasons)
        else:
            for line in explanation_lines(reasons):
                console().print(line, soft_wrap=True)
        return
    data = design_files.with_files(made.data, seen_from(folder))
    if as_json:
        print_json({"folder": str(folder), **data})
        return
    _print(data)
    typer.echo(str(folder))


def _print(data: dict[str, Any]) -> None:
    from rich.text import Text

    from unitcad.cli.output import console
    from unitcad.search import design_words as words

    screen = console()
    screen.print(Text.assemble((data["name"], "bold"), f": {words.wish_line(data['wish'])}"), soft_wrap=True)
    screen.print(f"  {words.tried_line(data)}", soft_wrap=True)
    screen.print(f"  {words.models_line(data)}", soft_wrap=True)
    other = words.first_other(data["proposals"])
    for one in data["proposals"]:
        if one["rank"] == other:
            screen.print(f"{words.OTHERS}:", soft_wrap=True)
        screen.print(Text(f"{one['rank']}. {words.title(one)}", style="bold"), soft_wrap=True)
        screen.print(f"   {words.level_line(one)}", soft_wrap=True)
        for line in [words.size_line(one), *words.reasons(one)]:
            screen.print(f"   - {line}", soft_wrap=True)
    for line in [*words.left_out_lines(data), *words.not_castable_lines(data)]:
        screen.print(line, soft_wrap=True)
    if data["decides"]:
        screen.print(data["decides"], soft_wrap=True)
