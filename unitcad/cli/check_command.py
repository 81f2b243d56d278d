"""`unitcad check`: its command line. What it does is in `check_run`."""

from __future__ import annotations

from typing import Annotated

import typer

from unitcad.cli.check_run import Asked, run


def check(
    files: Annotated[list[str] | None, typer.Argument(help="Files, folders or globs.", show_default=False)] = None,
    output_format: Annotated[
        str, typer.Option(help="text, json, github, sarif, junit or markdown.")
    ] = Asked.output_format,
    as_json: Annotated[bool, typer.Option("--json", help="Short for --output-format json.")] = False,
    report: Annotated[
        list[str] | None,
        typer.Option(
            metavar="FORMAT=FILE", help="Also write the report in a format to a file, such as sarif=out.sarif."
        ),
    ] = None,
    select: Annotated[
        list[str] | None,
        typer.Option(help="Only codes with these prefixes (comma or repeated); errors that ended a file's check stay."),
    ] = None,
    ignore: Annotated[
        list[str] | None, typer.Option(help="Not codes with these prefixes; errors that ended a file's check stay.")
    ] = None,
    extend_select: Annotated[list[str] | None, typer.Option(help="Prefixes added to --select.")] = None,
    fail_on: Annotated[str | None, typer.Option(help="error (default) or warning: what makes the exit code 1.")] = None,
    printer: Annotated[str | None, typer.Option(help="Check fit and printability (S002, D) for this printer.")] = None,
    unit: Annotated[str | None, typer.Option(help="Unit of files that have none: mm, cm, m, in, ft and so on")] = None,
    shells: Annotated[int | None, typer.Option(min=0, help="Number of shells expected (G005).")] = None,
    strict_3mf: Annotated[
        bool | None,
        typer.Option(
            "--3mf-strict/--no-3mf-strict",
            help="Follow the 3MF specification strictly: vendors' attributes, lost thumbnails fail.",
        ),
    ] = None,
    strict: Annotated[
        bool | None,
        typer.Option("--strict/--no-strict", help="Crossings and folds too shallow for any printer are errors."),
    ] = None,
    exclude: Annotated[
        list[str] | None,
        typer.Option(help="Files of folders and globs to leave out: a pattern of a path, or of a name in it."),
    ] = None,
    manifest: Annotated[str | None, typer.Option(help="manifest.json of a build, or its folder (M rules).")] = None,
    jobs: Annotated[int, typer.Option("--jobs", "-j", min=1, help="Processes.")] = Asked.jobs,
    max_faces: Annotated[int | None, typer.Option(min=1, help="Faces a file may have (default 10000000).")] = None,
    timeout: Annotated[float | None, typer.Option(min=0.001, help="Seconds a file may take (default 600).")] = None,
    memory: Annotated[
        int | None, typer.Option(min=200, help="MB of address space a process may use (default 8000).")
    ] = None,
    all_locations: Annotated[bool, typer.Option(help="List every location of a finding, up to 10000.")] = False,
    baseline: Annotated[str | None, typer.Option(help="File of known findings; they do not fail.")] = None,
    write_baseline: Annotated[bool, typer.Option(help="Write the findings to the baseline.")] = False,
    show: Annotated[
        str | None,
        typer.Option(help="Folder for pictures: each finding near and on the whole part, and coloured 3MF files."),
    ] = None,
    diff: Annotated[
        tuple[str, str] | None,
        typer.Option(metavar="OLD NEW", help="Compare two versions of a file or a folder; only new findings fail."),
    ] = None,
    config: Annotated[
        str | None, typer.Option(help="Settings: a TOML file with a table [check]; else from the nearest such file.")
    ] = None,
    no_config: Annotated[bool, typer.Option("--no-config", help="Read no settings.")] = False,
    statistics: Annotated[
        bool, typer.Option(help="Count findings by rule: in place of the text, beside other formats on stderr.")
    ] = False,
    explain: Annotated[
        list[str] | None,
        typer.Option(help="Print what codes mean, why they matter and how to fix them (comma or repeated)."),
    ] = None,
    list_rules: Annotated[bool, typer.Option("--list-rules", help="List all rules.")] = False,
) -> None:
    """Check mesh files as they are, before any repair.

    Reads STL, 3MF, OBJ, PLY, OFF and GLB, and STEP where an extra with a B-rep kernel is installed.
    """
    raise typer.Exit(run(Asked(**locals())))
