"""Reports in any of the output formats, as text that UTF-8 can hold."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from functools import partial
from typing import Any

from unitcad.meshcheck.findings import FileReport

FORMATS = ("text", "json", "github", "sarif", "junit", "markdown")


def render(
    reports: Sequence[FileReport],
    format_: str,
    fail_on: str = "error",
    config: str | None = None,
    baseline: str | None = None,
) -> str:
    """Return all reports in one of FORMATS, ending in a newline.

    JSON names `config` and `baseline`, the files of settings and of known findings.
    """
    written = _written(reports, format_, fail_on, config, baseline)
    return _SURROGATE.sub(partial(_escaped, format_ in ("json", "sarif")), written)


def _written(
    reports: Sequence[FileReport], format_: str, fail_on: str, config: str | None, baseline: str | None
) -> str:
    """Return the reports in a format, whose module is loaded for it alone."""
    if format_ == "json":
        from unitcad.meshcheck.output.as_json import as_dict

        return _dump(as_dict(reports, config, baseline))
    if format_ == "github":
        from unitcad.meshcheck.output.as_github import github

        return github(reports, fail_on)
    if format_ == "sarif":
        from unitcad.meshcheck.output.as_sarif import sarif

        return _dump(sarif(reports))
    if format_ == "junit":
        from unitcad.meshcheck.output.as_junit import junit

        return junit(reports, fail_on)
    if format_ == "markdown":
        from unitcad.meshcheck.output.as_markdown import markdown

        return markdown(reports, fail_on)
    from unitcad.meshcheck.output.as_text import text

    return text(reports, fail_on)


_SURROGATE = re.compile("[\ud800-\udfff]")


def _escaped(quoted: bool, match: re.Match[str]) -> str:
    """Return what UTF-8 cannot hold, such as a byte of a file's name, as \\xe4; `quoted` for JSON's strings."""
    code = ord(match.group())
    text = f"\\x{code - 0xDC00:02x}" if 0xDC80 <= code <= 0xDCFF else f"\\u{code:04x}"
    return text.replace("\\", "\\\\") if quoted else text


def _dump(data: Any) -> str:
    return json.dumps(data, indent=2, allow_nan=False, ensure_ascii=False) + "\n"
