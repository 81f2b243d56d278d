"""The command line of `unitcad check`; `check_run` does the work."""

from __future__ import annotations

from typing import Annotated

import typer

from unitcad.cli.check_run import CheckArguments, run


def check(
    files: Annotated[
        list[str] | None, typer.Argument(metavar="[FILE]...", help="Mesh files, folders or globs.", show_default=False)
    ] = None,
    output_format: Annotated[
        str, typer.Option(metavar="FORMAT", help="Report: text, json, github, sarif, junit or markdown.")
    ] = CheckArguments.output_format,
    as_json: Annotated[bool, typer.Option("--json", help="Short for --output-format json.")] = False,
    report: Annotated[
        list[str] | None,
        typer.Option(metavar="FORMAT=FILE", help="Also write a report to a file, such as sarif=out.sarif."),
    ] = None,
    select: Annotated[
        list[str] | None,
        typer.Option(metavar="CODES", help="Only rules whose code begins so, such as T,M001. Default: all rules."),
    ] = None,
    ignore: Annotated[
        list[str] | None,
        typer.Option(metavar="CODES", help="Rules to leave out. Errors that ended a file's check stay."),
    ] = None,
    extend_select: Annotated[
        list[str] | None, typer.Option(metavar="CODES", help="Rules in addition to --select.")
    ] = None,
    fail_on: Annotated[
        str | None,
        typer.Option(metavar="LEVEL", help="Findings that make the exit code 1: error or warning. Default: error."),
    ] = None,
    printer: Annotated[
        str | None,
        typer.Option(
            metavar="PRINTER", help="Check size and printability (S002, D) for a printer. Default: no printer's rules."
        ),
    ] = None,
    unit: Annotated[
        str | None,
        typer.Option(metavar="UNIT", help="Unit of files that name none: mm, cm, m, in, ft or micron. Default: mm."),
    ] = None,
    shells: Annotated[
        int | None, typer.Option(metavar="N", min=0, help="Expected number of shells (G005). Default: any.")
    ] = None,
    strict_3mf: Annotated[
        bool | None,
        typer.Option(
            "--3mf-strict/--no-3mf-strict",
            help="Follow the 3MF specification strictly: vendors' attributes and lost thumbnails fail. Default: off.",
        ),
    ] = None,
    strict: Annotated[
        bool | None,
        typer.Option(
            "--strict/--no-strict",
            help="Treat crossings and folds too shallow for any printer as errors. Default: warnings.",
        ),
    ] = None,
    exclude: Annotated[
        list[str] | None,
        typer.Option(metavar="PATTERN", help="Leave out files by a pattern of their path, or of a name in it."),
    ] = None,
    manifest: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="manifest.json of a build, or its folder (M rules). Default: none."),
    ] = None,
    jobs: Annotated[
        int, typer.Option("--jobs", "-j", metavar="N", min=1, help="Worker processes.")
    ] = CheckArguments.jobs,
    max_faces: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Most faces in a file. Default: 10,000,000.")
    ] = None,
    timeout: Annotated[
        float | None, typer.Option(metavar="SECONDS", min=0.001, help="Time limit for a file. Default: 600.")
    ] = None,
    memory: Annotated[
        int | None, typer.Option(metavar="MB", min=200, help="Most address space of a process. Default: 8000.")
    ] = None,
    all_locations: Annotated[
        bool, typer.Option("--all-locations", help="List every location of a finding, up to 10,000.")
    ] = False,
    baseline: Annotated[
        str | None, typer.Option(metavar="FILE", help="Known findings, which do not fail. Default: none.")
    ] = None,
    write_baseline: Annotated[
        bool, typer.Option("--write-baseline", help="Write the findings to the file of --baseline.")
    ] = False,
    show: Annotated[
        str | None,
        typer.Option(
            "--pictures", metavar="DIR", help="Folder for pictures of findings and coloured 3MF files. Default: none."
        ),
    ] = None,
    diff: Annotated[
        tuple[str, str] | None,
        typer.Option(
            metavar="OLD NEW",
            help="Compare two versions of a file or a folder. Only new findings fail. Default: no comparison.",
        ),
    ] = None,
    config: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="Settings: a TOML file with a [check] table. Default: the nearest one."),
    ] = None,
    no_config: Annotated[bool, typer.Option("--no-config", help="Read no settings.")] = False,
    statistics: Annotated[
        bool,
        typer.Option("--statistics", help="Count findings by rule; with other formats than text on standard error."),
    ] = False,
    explain: Annotated[
        list[str] | None,
        typer.Option(metavar="CODES", help="Explain rules: meaning, cause and fix. No file is checked."),
    ] = None,
    list_rules: Annotated[bool, typer.Option("--list-rules", help="List all rules.")] = False,
) -> None:
    """Check mesh files as they are, before any repair.

    Reads STL, 3MF, OBJ, PLY, OFF and GLB, and STEP if an extra with a B-rep kernel is installed.
    """
    raise typer.Exit(run(CheckArguments(**locals())))
