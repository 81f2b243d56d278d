"""STEP AP242: an assembly of named, coloured bodies, exact surfaces, the same bytes for the same bodies.

Written through OCCT's document (XCAF) directly, so that either B-rep extra will do. Output of OCCT that differs each
time is replaced in the text: the time stamp, a counter of the process and the last bits of coordinates. The styles are
written here, since OCCT orders them by address and rounds colours to single precision.
"""

from __future__ import annotations

import io
import itertools
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

from unitcad import files
from unitcad.errors import UnitcadError
from unitcad.kernels import occt
from unitcad.kernels.ocp import loading
from unitcad.shape.tree import Body, part_names

with loading("OCP"):
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Copy
    from OCP.IFSelect import IFSelect_ReturnStatus
    from OCP.Interface import Interface_Static
    from OCP.Message import Message, Message_Gravity
    from OCP.STEPCAFControl import STEPCAFControl_Controller, STEPCAFControl_Writer
    from OCP.STEPControl import STEPControl_StepModelType
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDataStd import TDataStd_Name
    from OCP.TDF import TDF_Label
    from OCP.TDocStd import TDocStd_Document
    from OCP.TopLoc import TopLoc_Location
    from OCP.TopoDS import TopoDS_Shape
    from OCP.XCAFDoc import XCAFDoc_DocumentTool

_SETTINGS = {"write.step.schema": 5, "write.surfacecurve.mode": 0}
"""AP242; and no curves in the parameters of surfaces: OCCT's differ by 1e-16 from run to run, and readers need none."""

_STYLE = (
    "FILL_AREA_STYLE_COLOUR('',{})",
    "FILL_AREA_STYLE('',({}))",
    "SURFACE_STYLE_FILL_AREA({})",
    "SURFACE_SIDE_STYLE('',({}))",
    "SURFACE_STYLE_USAGE(.BOTH.,{})",
    "PRESENTATION_STYLE_ASSIGNMENT(({}))",
)
"""The entities between a colour and the item that it styles, each about the one before."""


def write(path: Path, bodies: Sequence[Body], name: str) -> None:
    """Write `bodies` as an assembly called `name`, in their order, as assembled (mm)."""
    files.write(path, content(bodies, name))


def content(bodies: Sequence[Body], name: str) -> bytes:
    """Return the bytes of the file. Its time stamp is SOURCE_DATE_EPOCH, or 1980-01-01 without one.

    Raises UnitcadError if OCCT fails, or makes a body that differs from its mesh.
    """
    solids = occt.solids(body.shape for body in bodies)
    parts = _parts(bodies, solids)
    for part in parts:
        occt.confirm(bodies[part[0]].shape, solids[part[0]])
    document = _document(bodies, solids, parts, name)
    STEPCAFControl_Controller.Init_s()
    stream = io.BytesIO()
    with _quiet(), _settings(_SETTINGS):
        writer = STEPCAFControl_Writer()
        writer.SetColorMode(False)
        writer.SetNameMode(True)
        done = writer.Transfer(document, STEPControl_StepModelType.STEPControl_AsIs)
        if not done or writer.WriteStream(stream) != IFSelect_ReturnStatus.IFSelect_RetDone:
            raise UnitcadError(f"OCCT could not write {name} as STEP")
    text = _canonical(_with_header(stream.getvalue().decode("ascii"), name), [body.name for body in bodies])
    counts = [len(occt.solids_in(solids[part[0]])) for part in parts]
    return _with_styles(text, [bodies[part[0]].colour for part in parts], counts).encode("ascii")


def _parts(bodies: Sequence[Body], solids: Sequence[TopoDS_Shape]) -> list[list[int]]:
    """Return the places in the list of the bodies that are copies of one part: one solid, of one kind and colour."""
    parts: list[list[int]] = []
    for i, (body, solid) in enumerate(zip(bodies, solids, strict=True)):
        like = (body.kind, body.step, body.colour)
        for part in parts:
            first = bodies[part[0]]
            if (first.kind, first.step, first.colour) == like and solid.IsPartner(solids[part[0]]):
                part.append(i)
                break
        else:
            parts.append([i])
    return parts


def _document(
    bodies: Sequence[Body], solids: Sequence[TopoDS_Shape], parts: Sequence[Sequence[int]], name: str
) -> TDocStd_Document:
    document = TDocStd_Document(TCollection_ExtendedString("XmlXCAF"))
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    shapes.SetAutoNaming_s(False)
    assembly = shapes.NewShape()
    _name(assembly, name)
    earlier: list[TopoDS_Shape] = []
    labels: dict[int, TDF_Label] = {}
    for part, of_part in zip(parts, part_names(bodies, parts), strict=True):
        solid = solids[part[0]].Located(TopLoc_Location())
        if any(solid.IsPartner(other) for other in earlier):
            # Two parts of one shape, in two colours, would share a label, so also a name.
            solid = BRepBuilderAPI_Copy(solid).Shape()
        earlier.append(solid)
        label = shapes.AddShape(solid, False)
        _name(label, of_part)
        labels.update(dict.fromkeys(part, label))
    for i, solid in enumerate(solids):
        shapes.AddComponent(assembly, labels[i], solid.Location())
    shapes.UpdateAssemblies()
    return document


def _name(label: TDF_Label, name: str) -> None:
    TDataStd_Name.Set_s(label, TCollection_ExtendedString(name))


def _with_header(text: str, name: str) -> str:
    """Return the file with a header of ours: OCCT's has the time of writing."""
    when = datetime.fromtimestamp(int(os.environ.get("SOURCE_DATE_EPOCH", "315532800")), UTC)
    file = f"'{_escape(name)}.step','{when:%Y-%m-%dT%H:%M:%S}'"
    header = f"FILE_NAME({file},('unitcad'),(''),'Open CASCADE','unitcad','');"
    text, count = re.subn(r"FILE_NAME\(.*?\);", lambda _: header, text, count=1, flags=re.DOTALL)
    if count != 1:
        raise UnitcadError(f"OCCT wrote {name} without a header")
    return text


def _escape(name: str) -> str:
    return name.replace("\\", "\\\\").replace("'", "''").encode("ascii", "replace").decode()


def _canonical(text: str, names: Sequence[str]) -> str:
    """Return the file with one record a line, reals to 1e-11, and its assembly's occurrences counted and named.

    OCCT merges vertices in the order of their addresses, which leaves 1e-17 in some coordinates, and wraps lines by
    the length of these numbers. It continues the count of occurrences from the file before. It gives the name of a
    copy at the origin to the first copy, so the names are written here: occurrences have the order of the bodies.
    Raises UnitcadError if their number differs.
    """
    text = re.sub(r"\n +", "", text)
    text = re.sub(r"-0\.(?=[,)])|-?\d+\.\d*E-\d+|-?\d+\.\d{11,}", lambda real: _real(float(real[0])), text)
    parts = re.split(r"(?<=NEXT_ASSEMBLY_USAGE_OCCURRENCE\()'\d+','[^']*'", text)
    if len(parts) != len(names) + 1:
        raise UnitcadError(f"OCCT wrote {len(parts) - 1} of {len(names)} bodies as STEP")
    labels = [f"'{i}','{_escape(name)}'" for i, name in enumerate(names, 1)]
    return "".join(part + label for part, label in zip(parts, [*labels, ""], strict=True))


def _with_styles(text: str, colours: Sequence[tuple[float, float, float]], counts: Sequence[int]) -> str:
    """Return the file with a surface colour for every solid: `colours` by body, in the order of its representations.

    `counts`: the number of solids of each body; several are written as a plain representation, as the assembly is.
    Laid out after the recommended practices for model styling of the MBx Interoperability Forum (CAx-IF).
    Raises UnitcadError if a body or a solid of one is missing.
    """
    solids = set(re.findall(r"(#\d+) = (?:MANIFOLD_SOLID_BREP|BREP_WITH_VOIDS|FACETED_BREP)\(", text))
    representations = re.findall(
        r" = (?:ADVANCED_BREP_|FACETED_BREP_)?SHAPE_REPRESENTATION\('[^']*',\(([^)]*)\),\s*(#\d+)\s*\);", text
    )
    held = [([item for item in re.findall(r"#\d+", items) if item in solids], at) for items, at in representations]
    bodies = [(items, context) for items, context in held if items]
    if len(bodies) != len(colours):
        raise UnitcadError(f"OCCT wrote {len(bodies)} bodies of {len(colours)} as STEP")
    written = [len(items) for items, _ in bodies]
    if written != list(counts):
        raise UnitcadError(f"OCCT wrote {written} solids, by body, of {list(counts)} as STEP")
    highest = int(re.findall(r"^#(\d+) = ", text, flags=re.MULTILINE)[-1])
    number, lines = itertools.count(highest + 1), []

    def entity(content: str) -> str:
        lines.append(f"#{next(number)} = {content};")
        return lines[-1].split(" ", 1)[0]

    for (items, context), channels in zip(bodies, colours, strict=True):
        last = entity(f"COLOUR_RGB('',{','.join(_real(channel) for channel in channels)})")
        for wrapper in _STYLE:
            last = entity(wrapper.format(last))
        styled = [entity(f"STYLED_ITEM('color',({last}),{item})") for item in items]
        entity(f"MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION('',({','.join(styled)}),{context})")
    end = text.rindex("ENDSEC;")
    return text[:end] + "\n".join([*lines, ""]) + text[end:]


def _real(value: float) -> str:
    """Format a number as STEP requires: with a point, always."""
    return f"{round(value, 11) + 0.0:.11f}".rstrip("0")


@contextmanager
def _settings(wanted: Mapping[str, int]) -> Iterator[None]:
    """Set OCCT's settings for a block; they belong to the whole process, so put them back afterwards."""
    before = {key: Interface_Static.IVal_s(key) for key in wanted}
    try:
        for key, value in wanted.items():
            Interface_Static.SetIVal_s(key, value)
        yield
    finally:
        for key, value in before.items():
            Interface_Static.SetIVal_s(key, value)


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep OCCT's progress off standard output, which is for the answer."""
    printers = list(Message.DefaultMessenger_s().Printers())
    levels = [printer.GetTraceLevel() for printer in printers]
    for printer in printers:
        printer.SetTraceLevel(Message_Gravity.Message_Fail)
    try:
        yield
    finally:
        for printer, level in zip(printers, levels, strict=True):
            printer.SetTraceLevel(level)
