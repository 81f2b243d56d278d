"""The arguments of `unitcad check`, with their help: its command line, and that of the check alone, are made from them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated


class Option:
    """An option of the command line, or its files if it has no `names`.

    `metavar` and `help` are for its help, `least` is the smallest number it takes. `whole`: the part of unitcad that it
    needs, and that the check alone lacks.
    """

    def __init__(
        self, help: str, *names: str, metavar: str | None = None, least: float | None = None, whole: str = ""
    ) -> None:
        self.help, self.names, self.metavar, self.least, self.whole = help, names, metavar, least, whole


@dataclass(frozen=True)
class Arguments:
    """Arguments of a run; None for an option that is not given."""

    files: Annotated[list[str] | None, Option("Mesh files, folders or globs.", metavar="[FILE]...")] = None
    output_format: Annotated[
        str, Option("Report: text, json, github, sarif, junit or markdown.", "--output-format", metavar="FORMAT")
    ] = "text"
    as_json: Annotated[bool, Option("Short for --output-format json.", "--json")] = False
    report: Annotated[
        list[str] | None,
        Option("Also write a report to a file, such as sarif=out.sarif.", "--report", metavar="FORMAT=FILE"),
    ] = None
    select: Annotated[
        list[str] | None,
        Option("Only rules whose code begins so, such as T,M001. Default: all rules.", "--select", metavar="CODES"),
    ] = None
    ignore: Annotated[
        list[str] | None,
        Option("Rules to leave out. Errors that ended a file's check stay.", "--ignore", metavar="CODES"),
    ] = None
    fail_on: Annotated[
        str | None,
        Option("Findings that make the exit code 1: error or warning. Default: error.", "--fail-on", metavar="LEVEL"),
    ] = None
    printer: Annotated[
        str | None,
        Option(
            "Check size and printability (S002, D) for a printer. Default: no printer's rules.",
            "--printer",
            metavar="PRINTER",
            whole="the catalogue of printers",
        ),
    ] = None
    unit: Annotated[
        str | None,
        Option("Unit of files that name none: mm, cm, m, in, ft or micron. Default: mm.", "--unit", metavar="UNIT"),
    ] = None
    shells: Annotated[
        int | None, Option("Expected number of shells (G005). Default: any.", "--shells", metavar="N", least=0)
    ] = None
    strict_3mf: Annotated[
        bool | None,
        Option(
            "Follow the 3MF specification strictly: vendors' attributes and lost thumbnails fail. Default: off.",
            "--3mf-strict/--no-3mf-strict",
        ),
    ] = None
    strict: Annotated[
        bool | None,
        Option(
            "Treat crossings and folds too shallow for any printer as errors. Default: warnings.",
            "--strict/--no-strict",
        ),
    ] = None
    exclude: Annotated[
        list[str] | None,
        Option("Leave out files by a pattern of their path, or of a name in it.", "--exclude", metavar="PATTERN"),
    ] = None
    manifest: Annotated[
        str | None,
        Option("manifest.json of a build, or its folder (M rules). Default: none.", "--manifest", metavar="FILE"),
    ] = None
    jobs: Annotated[int, Option("Worker processes.", "--jobs", "-j", metavar="N", least=1)] = 1
    max_faces: Annotated[
        int | None, Option("Most faces in a file. Default: 10,000,000.", "--max-faces", metavar="N", least=1)
    ] = None
    timeout: Annotated[
        float | None, Option("Time limit for a file. Default: 600.", "--timeout", metavar="SECONDS", least=0.001)
    ] = None
    memory: Annotated[
        int | None, Option("Most address space of a process. Default: 8000.", "--memory", metavar="MB", least=200)
    ] = None
    pictures: Annotated[
        str | None,
        Option(
            "Folder for pictures of findings. Default: none.",
            "--pictures",
            metavar="DIR",
            whole="the drawing of pictures",
        ),
    ] = None
    diff: Annotated[
        tuple[str, str] | None,
        Option(
            "Compare two versions of a file or a folder; only new findings fail. Default: none.",
            "--diff",
            metavar="OLD NEW",
        ),
    ] = None
    baseline: Annotated[
        str | None,
        Option(
            "Known findings, which do not fail. Default: those of the settings, or none.", "--baseline", metavar="FILE"
        ),
    ] = None
    write_baseline: Annotated[
        str | None,
        Option("Write the findings of this run to a file as known. Default: none.", "--write-baseline", metavar="FILE"),
    ] = None
    repair: Annotated[
        str | None,
        Option(
            "Write a closed copy of FILE, its nearly meeting edges joined. Default: none.",
            "--repair",
            metavar="OUT.stl",
            whole="the library manifold3d",
        ),
    ] = None
    quiet: Annotated[bool, Option("Print the findings that fail, and one line of sums.", "--quiet", "-q")] = False
    config: Annotated[
        str | None,
        Option("Settings: a TOML file with a [check] table. Default: the nearest one.", "--config", metavar="FILE"),
    ] = None
    hook: Annotated[
        bool, Option("Take words from a hook runner: options, then existing files of any name.", "--hook")
    ] = False
    explain: Annotated[
        list[str] | None,
        Option("Explain mesh rules and mould checks (C...). No file is checked.", "--explain", metavar="CODES"),
    ] = None
