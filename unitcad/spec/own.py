"""A design of one's own: `design = "path/to/file.py:function"`. Its text becomes part of the effective spec.

So a result's spec.toml stands alone, the result's hash covers the code, and a worker elsewhere needs no file.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from unitcad.errors import Refusal, UnitcadError

_FORM = re.compile(r"(?P<file>.+\.py):(?P<function>[A-Za-z_][A-Za-z0-9_]*)", re.DOTALL)
LARGEST = 1_000_000


def is_own(design: object) -> bool:
    """Whether a spec's `design` means a function in a file."""
    return isinstance(design, str) and _FORM.fullmatch(design) is not None


def function_of(design: str) -> str:
    """The function's name in "file.py:function"."""
    return design.rpartition(":")[2]


def with_source(data: dict[str, Any], folder: Path) -> dict[str, Any]:
    """A spec's data with its own design's text in `design_source`, where it has one; a relative path starts at
    `folder`. Raises UnitcadError for a file that can't be read.
    """
    design = data.get("design")
    if not is_own(design) or data.get("design_source") is not None:
        return data
    file, _, function = str(design).rpartition(":")
    path = folder / file
    try:
        source = path.read_bytes()[: LARGEST + 1].decode("utf-8")
    except UnicodeDecodeError as error:
        raise Refusal("design", str(design), f"{path} is not UTF-8 (byte {error.start})") from None
    except OSError as error:
        raise Refusal("design", str(design), f"{path}: {(error.strerror or 'unreadable').lower()}") from None
    if len(source) > LARGEST:
        raise UnitcadError(f"design = {design!r}: {path} is larger than a megabyte")
    return {**data, "design": f"{path.name}:{function}", "design_source": source}
