"""What a suite was measured on."""

from __future__ import annotations

import os
import platform
import subprocess
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path


def machine(*packages: str) -> dict[str, str | int]:
    """Return when and on what: date, processor, cores, commit of a clone, versions of Python and `packages`."""
    today = datetime.now(UTC).date().isoformat()
    facts: dict[str, str | int] = {"date": today, "processor": _processor(), "cores": os.cpu_count() or 1}
    if commit := _commit():
        facts["commit"] = commit
    facts["Python"] = platform.python_version()
    for name in ("unitcad", *packages):
        try:
            facts[name] = version(name)
        except PackageNotFoundError:
            facts[name] = "not installed"
    return facts


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def _commit() -> str:
    """Return the commit of the clone that runs, with a plus if its code differs; nothing outside a clone."""
    root = Path(__file__).parents[2]
    if not (root / ".git").exists():
        return ""

    def git(*words: str) -> str:
        return subprocess.run(["git", "-C", str(root), *words], capture_output=True, text=True, check=False).stdout

    try:
        commit = git("rev-parse", "--short=10", "HEAD").strip()
        return f"{commit}+" if commit and git("status", "--porcelain", "unitcad", "benchmarks").strip() else commit
    except OSError:
        return ""
