"""The encapsulating set by unitcad's own shapes, parameters to files, geometry only: no laws, no checks, no drawing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from run_script import main

from unitcad.api.variant import Variant
from unitcad.pipeline import plan as body_files


def make(n: dict[str, Any]) -> dict[str, Any]:
    """The variant and its bodies. The numbers are ignored: unitcad works them out of its spec."""
    body_files.forget()
    variant = Variant.of("encapsulating")
    return {"variant": variant, "bodies": (variant.unit, variant.plan.tools)}


def write(made: dict[str, Any], out: Path, formats: str) -> None:
    variant = made["variant"]
    for name, bodies in zip(("unit", "moulds"), made["bodies"], strict=True):
        if formats in ("stl", "both"):
            for body in bodies:
                (out / f"{body.name}.stl").write_bytes(body_files.stl_content(variant, body))
        if formats in ("step", "both"):
            (out / f"{name}.step").write_bytes(body_files.step_content(bodies, name))


if __name__ == "__main__":
    main(make, write)
