"""What the scripts share: SCRIPT NUMBERS OUT stl|step|both [WARM]; WARM more runs are timed and printed."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

Make = Callable[[dict[str, Any]], dict[str, Any]]
Write = Callable[[dict[str, Any], Path, str], None]


def main(make: Make, write: Write) -> None:
    """Read the numbers, make the parts, write them; then again for the warm times."""
    numbers, out, formats = json.loads(Path(sys.argv[1]).read_text()), Path(sys.argv[2]), sys.argv[3]
    out.mkdir(parents=True, exist_ok=True)
    for i in range(1 + int(sys.argv[4] if len(sys.argv) > 4 else 0)):
        start = time.perf_counter()
        write(make(numbers), out, formats)
        if i:
            print(time.perf_counter() - start)
