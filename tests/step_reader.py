"""A STEP assembly read back by OCCT: names, colours and measures of its bodies."""

from __future__ import annotations

from dataclasses import dataclass

from OCP.IFSelect import IFSelect_ReturnStatus
from OCP.Quantity import Quantity_Color, Quantity_TypeOfColor
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_Label, TDF_LabelSequence
from OCP.TDocStd import TDocStd_Document
from OCP.XCAFDoc import XCAFDoc_ColorType, XCAFDoc_DocumentTool, XCAFDoc_ShapeTool

from benchmarks.accuracy.brep_measures import Measures, measure
from unitcad.kernels import occt


@dataclass(frozen=True)
class StepBody:
    """A body as read back: name, the colour of all its solids (or None), and its measures as assembled (mm, mm3)."""

    name: str
    colour: tuple[float, float, float] | None
    measures: Measures


def read(path):
    """Return the bodies of a STEP assembly in the order of the file."""
    document = TDocStd_Document(TCollection_ExtendedString("XmlXCAF"))
    reader = STEPCAFControl_Reader()
    reader.SetColorMode(True)
    reader.SetNameMode(True)
    assert reader.ReadFile(str(path)) == IFSelect_ReturnStatus.IFSelect_RetDone
    assert reader.Transfer(document)
    roots = TDF_LabelSequence()
    XCAFDoc_DocumentTool.ShapeTool_s(document.Main()).GetFreeShapes(roots)
    colours, bodies = XCAFDoc_DocumentTool.ColorTool_s(document.Main()), []
    for root in _labels(roots):
        parts = TDF_LabelSequence()
        XCAFDoc_ShapeTool.GetComponents_s(root, parts)
        bodies += [_body(part, colours) for part in (_labels(parts) or [root])]
    return bodies


def _labels(sequence):
    return [sequence.Value(i) for i in range(1, sequence.Length() + 1)]


def _body(label, colours):
    part = TDF_Label()
    if not XCAFDoc_ShapeTool.GetReferredShape_s(label, part):
        part = label
    whole = XCAFDoc_ShapeTool.GetShape_s(part)
    found = {_colour(solid, colours) for solid in (occt.solids_in(whole) or [whole])}
    colour = found.pop() if len(found) == 1 else None
    name = TDataStd_Name()
    text = name.Get().ToExtString() if label.FindAttribute(TDataStd_Name.GetID_s(), name) else ""
    return StepBody(text, colour, measure(XCAFDoc_ShapeTool.GetShape_s(label)))


def _colour(solid, colours):
    quantity = Quantity_Color()
    for kind in (XCAFDoc_ColorType.XCAFDoc_ColorSurf, XCAFDoc_ColorType.XCAFDoc_ColorGen):
        if colours.GetColor(solid, kind, quantity):
            red, green, blue = quantity.Values(Quantity_TypeOfColor.Quantity_TOC_sRGB)
            return (round(red, 6), round(green, 6), round(blue, 6))
    return None
