"""unitcad: haptic units, their casting moulds and an attenuation estimate, from a short TOML spec.

    import unitcad

    spec = unitcad.load("unit.toml", set={"diameter_mm": 15})
    variant = unitcad.Variant(spec)
    built = unitcad.build(spec, "out")
    result = unitcad.check(built.folder)
    estimated = unitcad.estimate(spec)

Everything listed in `__all__` is loaded when it is first used: importing this package reads no file and loads neither
numpy nor a CAD library.
"""

# pyright: strict

# Nothing is imported here: with `python -m unitcad` Python still looks in the working directory first.
TYPE_CHECKING = False

if TYPE_CHECKING:
    from unitcad import attenuation as attenuation
    from unitcad import catalogue as catalogue
    from unitcad import shape as shape
    from unitcad.api.build_call import BuildResult as BuildResult
    from unitcad.api.build_call import build as build
    from unitcad.api.check_call import CheckResult as CheckResult
    from unitcad.api.check_call import check as check
    from unitcad.api.estimate_call import EdgeEstimate as EdgeEstimate
    from unitcad.api.estimate_call import estimate as estimate
    from unitcad.api.variant import Variant as Variant
    from unitcad.catalogue import MaterialEntry as Material
    from unitcad.catalogue import materials as materials
    from unitcad.catalogue import motors as motors
    from unitcad.catalogue import printers as printers
    from unitcad.catalogue import tissue as tissue
    from unitcad.errors import Refusal as Refusal
    from unitcad.errors import UnitcadError as UnitcadError
    from unitcad.pipeline.mass import MassProperties as MassProperties
    from unitcad.spec import Spec as Spec
    from unitcad.spec.raw import BodyTable as Body
    from unitcad.spec.raw import CastingTable as Casting
    from unitcad.spec.raw import EstimateTable as Estimate
    from unitcad.spec.raw import FpcbTable as Fpcb
    from unitcad.spec.raw import LayerTable as Layer
    from unitcad.spec.raw import MotorTable as Motor
    from unitcad.spec.raw import MouldsTable as Moulds
    from unitcad.spec.raw import OutputTable as Output
    from unitcad.spec.raw import WiresTable as Wires
    from unitcad.validation import load as load
    from unitcad.validation import templates as templates

__version__ = "0.1.0"

__all__ = [
    "Body",
    "BuildResult",
    "Casting",
    "CheckResult",
    "EdgeEstimate",
    "Estimate",
    "Fpcb",
    "Layer",
    "MassProperties",
    "Material",
    "Motor",
    "Moulds",
    "Output",
    "Refusal",
    "Spec",
    "UnitcadError",
    "Variant",
    "Wires",
    "attenuation",
    "build",
    "catalogue",
    "check",
    "estimate",
    "load",
    "materials",
    "motors",
    "printers",
    "shape",
    "templates",
    "tissue",
]

_PLACES = {
    "Body": "spec.raw:BodyTable",
    "BuildResult": "api.build_call:BuildResult",
    "Casting": "spec.raw:CastingTable",
    "CheckResult": "api.check_call:CheckResult",
    "EdgeEstimate": "api.estimate_call:EdgeEstimate",
    "Estimate": "spec.raw:EstimateTable",
    "Fpcb": "spec.raw:FpcbTable",
    "Layer": "spec.raw:LayerTable",
    "MassProperties": "pipeline.mass:MassProperties",
    "Material": "catalogue:MaterialEntry",
    "Motor": "spec.raw:MotorTable",
    "Moulds": "spec.raw:MouldsTable",
    "Output": "spec.raw:OutputTable",
    "Refusal": "errors:Refusal",
    "Spec": "spec:Spec",
    "UnitcadError": "errors:UnitcadError",
    "Variant": "api.variant:Variant",
    "Wires": "spec.raw:WiresTable",
    "attenuation": "attenuation",
    "build": "api.build_call:build",
    "catalogue": "catalogue",
    "check": "api.check_call:check",
    "estimate": "api.estimate_call:estimate",
    "load": "validation:load",
    "materials": "catalogue:materials",
    "motors": "catalogue:motors",
    "printers": "catalogue:printers",
    "shape": "shape",
    "templates": "validation:templates",
    "tissue": "catalogue:tissue",
}
"""Place of each name: a room, or a module and the name in it."""


def __getattr__(name: str) -> object:
    """Load a public name when it is first used. Raises AttributeError for any other."""
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    module, _, attribute = _PLACES[name].partition(":")
    loaded = import_module(f"{__name__}.{module}")
    value = getattr(loaded, attribute) if attribute else loaded
    if attribute.endswith(("Table", "Entry")):
        value.__doc__ = import_module(f"{__name__}.spec.fields").document(value)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({name for name in globals() if name.startswith("__")} | set(__all__))
