"""What a person may type against the public names, under pyright strict: read by CI's pyright call, run by a test."""

# pyright: strict
from pathlib import Path

import unitcad
from unitcad.meshcheck import FileReport, Options, check_file


def silicones() -> dict[str, float]:
    """Densities of the shipped silicones, g/cm3."""
    return {name: float(material.density_g_cm3) for name, material in unitcad.materials().items()}


def typed_spec() -> unitcad.Spec:
    """A unit of two layers, typed out, with a material of its own."""
    return unitcad.Spec(
        name="typed",
        design="encapsulating",
        diameter_mm=15,
        layers=[
            unitcad.Layer(material="soft", wall_mm=1.25, cap_mm=1.0),
            {"material": "dragon-skin-30", "wall_mm": 1.25, "cap_mm": 1.0},
        ],
        motor=unitcad.Motor(part="LCM0720A3463F", fill=True),
        fpcb=unitcad.Fpcb(tail="both"),
        moulds={"printer": "sla"},
        materials={"soft": unitcad.Material(like="ecoflex-00-10", density_g_cm3=1.05)},
    )


def use(out: Path) -> tuple[float, FileReport, float | None]:
    """Take a spec through every public function."""
    spec: unitcad.Spec = unitcad.load(typed_spec(), set={"layers.0.wall_mm": 1.3})
    variant: unitcad.Variant = unitcad.Variant(spec)
    volume: float = variant.mesh("layer1").volume()
    built: unitcad.BuildResult = unitcad.build(variant, out, formats=["stl"], only=["unit"], check=False)
    result: unitcad.CheckResult = unitcad.check(built.folder, printer="sla", select=["T"])
    first: FileReport = check_file(result.reports[0].path, Options())
    estimated: unitcad.EdgeEstimate = unitcad.estimate(spec, models=["rule"], frequency_hz=125)
    return volume, first, estimated.level
