"""SARIF 2.1.0, as OASIS defines it and GitHub code scanning reads it."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Sequence
from pathlib import PurePath
from typing import Any
from urllib.parse import quote

from unitcad import __version__
from unitcad.meshcheck.findings import FileReport, Finding, first_line, with_places
from unitcad.meshcheck.rules.registry import rules
from unitcad.meshcheck.rules.rule import Rule
from unitcad.text import markdown

SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
_LEVELS = {"error": "error", "warning": "warning", "info": "note"}


def sarif(reports: Sequence[FileReport]) -> dict[str, Any]:
    """Return one run with every rule and a result a finding. Fingerprints depend on path and rule only.

    What the baseline lists is `unchanged`, and suppressed.
    """
    index = {code: i for i, code in enumerate(rules())}
    return {
        "$schema": SCHEMA,
        "version": "2.1.0",
        "runs": [
            {
                "tool": {
                    "driver": {
                        "name": "unitcad check",
                        "semanticVersion": __version__,
                        "rules": [_rule(rule) for rule in rules().values()],
                    }
                },
                "columnKind": "unicodeCodePoints",
                "results": [_result(report, finding, index) for report in reports for finding in report.findings],
            }
        ],
    }


def _rule(rule: Rule) -> dict[str, Any]:
    return {
        "id": rule.code,
        "name": "".join(word.capitalize() for word in re.findall(r"[A-Za-z0-9]+", rule.title.replace("'", ""))),
        "shortDescription": {"text": rule.title},
        "fullDescription": {"text": rule.cause},
        "help": {
            "text": f"{rule.cause} Fix: {rule.fix}",
            "markdown": f"{markdown(rule.cause)}\n\n**Fix:** {markdown(rule.fix)}",
        },
        "defaultConfiguration": {"level": _LEVELS[rule.severity]},
    }


def _result(report: FileReport, finding: Finding, index: dict[str, int]) -> dict[str, Any]:
    uri = _uri(report.path)
    physical: dict[str, Any] = {"artifactLocation": {"uri": uri}}
    line = first_line(finding)
    if line is not None:
        physical["region"] = {"startLine": max(line, 1)}
    objects = dict.fromkeys(place.object for place in finding.locations if place.object)
    logical = {"logicalLocations": [{"name": name, "kind": "object"} for name in objects]} if objects else {}
    fingerprint = hashlib.sha256(f"{_uri(_inside(report.path))}\n{finding.code}".encode()).hexdigest()
    known = {"baselineState": "unchanged", "suppressions": [{"kind": "external"}]} if finding.known else {}
    return {
        "ruleId": finding.code,
        "ruleIndex": index[finding.code],
        "level": _LEVELS[finding.severity],
        "message": {"text": f"{with_places(finding, 1)}. Fix: {rules()[finding.code].fix}"},
        "locations": [{"physicalLocation": physical, **logical}],
        "partialFingerprints": {"pathAndRule/v1": fingerprint},
        "properties": {"count": finding.count, "places": [place.as_dict() for place in finding.locations]},
        **known,
    }


def _inside(path: str) -> str:
    """Return the path from the working directory for what lies in it, however it is named; else the path itself."""
    whole, here = os.path.abspath(path), os.getcwd()
    return os.path.relpath(whole, here) if whole.startswith(os.path.join(here, "")) else path


def _uri(path: str) -> str:
    """Return a relative path as a URI reference; an absolute one as a file: URI."""
    pure = PurePath(path)
    if pure.is_absolute():
        return pure.as_uri()
    return quote(pure.as_posix().encode("utf-8", "surrogateescape"), safe="/")
