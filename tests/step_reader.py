"""A STEP assembly read back by OCCT: names, colours and measures of its bodies."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from OCP.IFSelect import IFSelect_ReturnStatus
from OCP.Quantity import Quantity_Color, Quantity_TypeOfColor
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_Label, TDF_LabelSequence
from OCP.TDocStd import TDocStd_Document
from OCP.XCAFDoc import XCAFDoc_ColorTool, XCAFDoc_ColorType, XCAFDoc_DocumentTool, XCAFDoc_ShapeTool

from unitcad.kernels import occt


@dataclass(frozen=True)
class StepBody:
    """A body as read back: name, colour (or None), and its measures as assembled (mm, mm3)."""

    name: str
    colour: tuple[float, float, float] | None
    measures: occt.Measures


def read(path: Path) -> list[StepBody]:
    """Return the bodies of a STEP assembly in the order of the file."""
    document = TDocStd_Document(TCollection_ExtendedString("XmlXCAF"))
    reader = STEPCAFControl_Reader()
    reader.SetColorMode(True)
    reader.SetNameMode(True)
    assert reader.ReadFile(str(path)) == IFSelect_ReturnStatus.IFSelect_RetDone
    assert reader.Transfer(document)
    roots = TDF_LabelSequence()
    XCAFDoc_DocumentTool.ShapeTool_s(document.Main()).GetFreeShapes(roots)
    bodies = []
    for root in _labels(roots):
        parts = TDF_LabelSequence()
        XCAFDoc_ShapeTool.GetComponents_s(root, parts)
        bodies += [_body(part) for part in (_labels(parts) or [root])]
    return bodies


def _labels(sequence: TDF_LabelSequence) -> list[TDF_Label]:
    return [sequence.Value(i) for i in range(1, sequence.Length() + 1)]


def _body(label: TDF_Label) -> StepBody:
    part = TDF_Label()
    if not XCAFDoc_ShapeTool.GetReferredShape_s(label, part):
        part = label
    quantity, colour = Quantity_Color(), None
    for kind in (XCAFDoc_ColorType.XCAFDoc_ColorSurf, XCAFDoc_ColorType.XCAFDoc_ColorGen):
        if XCAFDoc_ColorTool.GetColor_s(part, kind, quantity):
            red, green, blue = quantity.Values(Quantity_TypeOfColor.Quantity_TOC_sRGB)
            colour = (round(red, 6), round(green, 6), round(blue, 6))
            break
    name = TDataStd_Name()
    text = name.Get().ToExtString() if part.FindAttribute(TDataStd_Name.GetID_s(), name) else ""
    return StepBody(text, colour, occt.measure(XCAFDoc_ShapeTool.GetShape_s(label)))
