"""`unitcad.check` as a function, and its result."""

# pyright: strict
from __future__ import annotations

import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

from unitcad import text
from unitcad.arguments import check_number, path, texts
from unitcad.catalogue import Printer, choose, printers
from unitcad.errors import UnitcadError, WrongArgument
from unitcad.meshcheck.file_checks import check_files, expand
from unitcad.meshcheck.findings import FileReport, Finding
from unitcad.meshcheck.rules.f_file import Limits
from unitcad.meshcheck.rules.inspection import Options
from unitcad.meshcheck.rules.registry import check_prefixes
from unitcad.meshcheck.rules.s_scale import unit_named

StrPath = str | os.PathLike[str]

_MOST = 1e9
"""Upper bounds of the limits: faces, seconds, processes."""
_MOST_CODES = 5
"""Codes that a result's repr lists."""


@dataclass(frozen=True, repr=False)
class CheckResult:
    """The reports of some files.

    Attributes
    ----------
    reports : tuple of FileReport
        One report a file, in order.
    verdict : str
        The worst verdict: "error", "warning" or "pass".
    ok : bool
        Whether no file has an error; warnings do not count.
    findings : tuple of Finding
        The findings of all files.

    Examples
    --------
    >>> import unitcad
    >>> result = unitcad.check("missing.stl")
    >>> result.verdict, result.findings[0].code
    ('error', 'F012')
    """

    reports: tuple[FileReport, ...]

    @property
    def verdict(self) -> str:
        """The worst verdict of a file: "error", "warning" or "pass"."""
        verdicts = {report.verdict for report in self.reports}
        return next((severity for severity in ("error", "warning") if severity in verdicts), "pass")

    @property
    def ok(self) -> bool:
        """Whether no file has an error; warnings do not count."""
        return self.verdict != "error"

    @property
    def findings(self) -> tuple[Finding, ...]:
        """The findings of all files, in the order of the files."""
        return tuple(finding for report in self.reports for finding in report.findings)

    def __repr__(self) -> str:
        files, codes = len(self.reports), Counter(finding.code for finding in self.findings)
        listed = ", ".join(f"{code} x {count}" for code, count in sorted(codes.items())[:_MOST_CODES])
        more = f" and {len(codes) - _MOST_CODES} more codes" if len(codes) > _MOST_CODES else ""
        counted = f"; {listed}{more}" if codes else ""
        return f"CheckResult({files} {'file' if files == 1 else 'files'}: {self.verdict}{counted})"

    def _repr_html_(self) -> str:
        rows: list[tuple[object, ...]] = []
        for report in self.reports:
            if not report.findings:
                rows.append((report.path, report.verdict, "", ""))
            rows += [(report.path, finding.severity, finding.code, finding.message) for finding in report.findings]
        return text.table(("file", "verdict", "code", "finding"), rows)


def check(
    *files: StrPath,
    printer: str | Printer | None = None,
    unit: str | None = None,
    select: Sequence[str] = (),
    ignore: Sequence[str] = (),
    shells: int | None = None,
    strict: bool = False,
    strict_3mf: bool = False,
    max_faces: int | None = None,
    timeout: float | None = None,
    jobs: int = 1,
) -> CheckResult:
    """Check mesh files as they are, before any repair: STL, 3MF, OBJ, PLY, OFF, and STEP with an extra.

    Parameters
    ----------
    *files : path
        Files, folders or globs.
    printer : str or Printer, optional
        A printer of the catalogue or an entry. Adds the rules of fit and printability (S002, D).
    unit : str, optional
        Unit of formats that have none: "mm", "in" and so on. Default: mm.
    select, ignore : sequence of str, optional
        Prefixes of codes; the longest prefix that fits decides.
    shells : int, optional
        Number of shells expected (G005).
    strict : bool, default False
        Treat crossings and folds too shallow for any printer as errors.
    strict_3mf : bool, default False
        Follow the 3MF specification to the letter.
    max_faces : int, optional
        Most faces of a file. Default: 10,000,000.
    timeout : float, optional
        Most seconds a file. Default: 600.
    jobs : int, default 1
        Number of worker processes.

    Returns
    -------
    CheckResult
        One report a file. A missing or damaged file is a finding, not an exception. Lengths in mm.

    Raises
    ------
    Refusal, UnitcadError
        For an invalid argument.

    Examples
    --------
    >>> import pathlib, tempfile, unitcad
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder, "open.obj")
    ...     _ = file.write_text("v 0 0 0\\nv 9 0 0\\nv 0 9 0\\nv 0 0 9\\nf 1 3 2\\nf 1 2 4\\nf 2 3 4\\n")
    ...     result = unitcad.check(file)
    >>> result.ok, [finding.code for finding in result.findings]
    (False, ['T001'])
    """
    if printer is not None:
        if isinstance(printer, str):
            printer = choose("printer", printer, printers())
        elif not isinstance(printer, Printer):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise WrongArgument("printer", printer, "takes a printer's name or its entry")
    if not files:
        raise UnitcadError("check needs a file, a folder or a glob")
    names = [path("files", file) for file in files]
    for field, value, least in (("max_faces", max_faces, 1), ("jobs", jobs, 1), ("shells", shells, 0)):
        check_number(field, value, least, _MOST, whole=True)
    check_number("timeout", timeout, 0.001, _MOST)
    default = Limits()
    options = Options(
        select=check_prefixes("select", _split_codes("select", select)),
        ignore=check_prefixes("ignore", _split_codes("ignore", ignore)),
        unit=unit_named("unit", unit),
        printer=printer,
        shells=shells,
        strict=strict,
        strict_3mf=strict_3mf,
        limits=replace(
            default,
            max_faces=default.max_faces if max_faces is None else max_faces,
            seconds=default.seconds if timeout is None else timeout,
        ),
    )
    paths, missing = expand(names)
    work = [(path, options) for path in paths]
    return CheckResult((*missing, *check_files(work, jobs=jobs)))


def _split_codes(name: str, codes: Sequence[str]) -> list[str]:
    """Return prefixes given as a list or as one text with commas."""
    parts = codes.split(",") if isinstance(codes, str) else texts(name, codes)
    return [part for part in parts if part.strip()]
