"""The process that draws: pickled scenes on standard input, pickled PNG files on standard output. See `picture`."""

from __future__ import annotations

import pickle
import sys
from typing import Any

import numpy as np
import vtkmodules.vtkRenderingFreeType
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401  registers the renderer
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkFiltersCore import vtkFeatureEdges, vtkPolyDataNormals
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkRenderingCore import (
    vtkActor,
    vtkActor2D,
    vtkLight,
    vtkPolyDataMapper,
    vtkPolyDataMapper2D,
    vtkRenderer,
    vtkRenderWindow,
    vtkTextActor,
    vtkWindowToImageFilter,
)

from unitcad.export.name_places import EDGE_PX, LEADER_PX, Label, place

CREASE_DEG = 20.0
"""Edges sharper than this are drawn as lines and not shaded over."""
FONT_PX = 26
MOST_CHARACTERS = 28
"""Of a name; the rest is left out."""
INK = (0.13, 0.15, 0.18)


def picture(size: tuple[int, int], towards_eye: tuple[float, float, float], parts: list[dict[str, Any]]) -> bytes:
    """Draw one PNG."""
    window, _ = staged(size, towards_eye, parts)
    window.Render()
    return _png(window)


def staged(
    size: tuple[int, int], towards_eye: tuple[float, float, float], parts: list[dict[str, Any]]
) -> tuple[vtkRenderWindow, dict[int, Label]]:
    """Set a picture up; return its window, not yet drawn, and where the parts' names stand."""
    renderer = vtkRenderer()
    renderer.SetBackground(1, 1, 1)
    for part in parts:
        mesh = _mesh(part["vertices"], part["faces"])
        renderer.AddActor(_surface(mesh, part["colour"]))
        renderer.AddActor(_edges(mesh))
    _light(renderer)
    camera = renderer.GetActiveCamera()
    camera.SetFocalPoint(0, 0, 0)
    camera.SetPosition(*towards_eye)
    camera.SetViewUp(0, 0, 1)
    camera.SetViewAngle(16)
    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(8)
    window.SetSize(*size)
    window.AddRenderer(renderer)
    texts = _texts(parts, size[1])
    widest = max((_size(renderer, text)[0] for text in texts.values()), default=0.0)
    _fit(renderer, parts, size, widest)
    labels = placed(renderer, parts, texts) if texts else {}
    for i, label in labels.items():
        for mark in (*_leader(label), texts[i]):
            renderer.AddViewProp(mark)
    return window, labels


def _mesh(vertices: np.ndarray, faces: np.ndarray) -> vtkPolyData:
    points = vtkPoints()
    points.SetData(numpy_to_vtk(np.ascontiguousarray(vertices, np.float64), deep=True))
    cells = vtkCellArray()
    table = np.column_stack([np.full(len(faces), 3), faces]).astype(np.int64)
    cells.ImportLegacyFormat(numpy_to_vtkIdTypeArray(table.ravel(), deep=True))
    mesh = vtkPolyData()
    mesh.SetPoints(points)
    mesh.SetPolys(cells)
    return mesh


def _surface(mesh: vtkPolyData, colour: tuple[float, float, float]) -> vtkActor:
    normals = vtkPolyDataNormals()
    normals.SetInputData(mesh)
    normals.SetFeatureAngle(CREASE_DEG)
    mapper = vtkPolyDataMapper()
    mapper.SetInputConnection(normals.GetOutputPort())
    mapper.SetResolveCoincidentTopologyToPolygonOffset()
    actor = vtkActor()
    actor.SetMapper(mapper)
    look = actor.GetProperty()
    look.SetColor(*colour)
    look.SetAmbient(0.25)
    look.SetDiffuse(0.75)
    look.SetSpecular(0.05)
    return actor


def _edges(mesh: vtkPolyData) -> vtkActor:
    edges = vtkFeatureEdges()
    edges.SetInputData(mesh)
    edges.SetFeatureAngle(CREASE_DEG)
    edges.ColoringOff()
    mapper = vtkPolyDataMapper()
    mapper.SetInputConnection(edges.GetOutputPort())
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(*INK)
    actor.GetProperty().SetLineWidth(1.6)
    actor.GetProperty().SetLighting(False)
    return actor


def _light(renderer: vtkRenderer) -> None:
    """Add lights at the eye, which makes a cut face the brightest, from the upper left and from the upper right."""
    renderer.SetAutomaticLightCreation(False)
    for x, y, z, strength in ((0.0, 0.0, 1.0, 0.70), (-0.7, 0.6, 0.6, 0.50), (0.9, 0.8, 0.2, 0.30)):
        light = vtkLight()
        light.SetLightTypeToCameraLight()
        light.SetPosition(x, y, z)
        light.SetIntensity(strength)
        renderer.AddLight(light)


def _fit(renderer: vtkRenderer, parts: list[dict[str, Any]], size: tuple[int, int], widest: float) -> None:
    """Move the camera along its view so that every vertex is in the picture, with a margin, and the lot is centred."""
    camera = renderer.GetActiveCamera()
    renderer.ResetCamera()
    points = np.vstack([part["vertices"] for part in parts])
    aspect = size[0] / size[1]
    # Names stand to the left, the widest of `widest` px: the drawing gets the right of the picture.
    left = 2 * (widest + EDGE_PX + LEADER_PX) / size[0] - 1 if widest else -0.94
    for _ in range(4):
        seen = _projected(renderer, points, aspect)
        low, high = seen.min(axis=0), seen.max(axis=0)
        view = np.array([[camera.GetViewTransformMatrix().GetElement(i, j) for j in range(3)] for i in range(3)])
        half = camera.GetDistance() * np.tan(np.radians(camera.GetViewAngle() / 2))
        zoom = max((high - low) / (0.94 - left, 1.88))
        middle = (low + high) / 2 - (zoom * (0.94 + left) / 2, 0)
        shift = view[0] * middle[0] * half * aspect + view[1] * middle[1] * half
        focus = np.array(camera.GetFocalPoint()) + shift
        back = np.array(camera.GetPosition()) - np.array(camera.GetFocalPoint())
        camera.SetFocalPoint(*focus)
        camera.SetPosition(*(focus + back * zoom))
    renderer.ResetCameraClippingRange()


def _texts(parts: list[dict[str, Any]], height: int) -> dict[int, vtkTextActor]:
    """Return the names of the parts that have one, not yet in their places."""
    named = [i for i, part in enumerate(parts) if part["label"]]
    size = min(FONT_PX, int(height / 1.5 / max(len(named), 1)))
    texts = {}
    for i in named:
        label = parts[i]["label"]
        text = texts[i] = vtkTextActor()
        text.SetInput(label if len(label) <= MOST_CHARACTERS else label[: MOST_CHARACTERS - 1] + "…")
        look = text.GetTextProperty()
        look.SetFontSize(size)
        look.SetColor(*INK)
        look.SetVerticalJustificationToCentered()
        look.SetJustificationToCentered()
    return texts


def _size(renderer: vtkRenderer, text: vtkTextActor) -> tuple[float, float]:
    """Return width and height (px) of a name. Letters without a tail get the room for one: names stand on one grid."""
    box = [0.0] * 4
    text.GetBoundingBox(renderer, box)
    return box[1] - box[0] + 1, max(box[3] - box[2] + 1, 1.2 * text.GetTextProperty().GetFontSize())


def placed(renderer: vtkRenderer, parts: list[dict[str, Any]], texts: dict[int, vtkTextActor]) -> dict[int, Label]:
    """Put the names where they cover nothing; return where that is."""
    found = place(owners(renderer, parts), {i: _size(renderer, text) for i, text in texts.items()})
    for i, label in found.items():
        left, right, bottom, top = label.box
        texts[i].SetDisplayPosition(round((left + right) / 2), round((bottom + top) / 2))
    return found


def owners(renderer: vtkRenderer, parts: list[dict[str, Any]]) -> np.ndarray:
    """Return which part each pixel (height, width) shows, -1 for none; row 0 is the lowest."""
    flat = vtkRenderer()
    flat.SetBackground(1, 1, 1)
    for i, part in enumerate(parts):
        actor = _surface(_mesh(part["vertices"], part["faces"]), (i % 200 / 255, i // 200 / 255, 0.0))
        actor.GetProperty().LightingOff()
        flat.AddActor(actor)
    flat.SetActiveCamera(renderer.GetActiveCamera())
    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)  # a mixed colour would be another part's number
    width, height = renderer.GetSize()
    window.SetSize(width, height)
    window.AddRenderer(flat)
    window.Render()
    grab = vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    grab.Update()
    colours = vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars()).reshape(height, width, 3).astype(int)
    return np.where(colours[:, :, 2] > 0, -1, colours[:, :, 0] + 200 * colours[:, :, 1])


def _leader(label: Label) -> list[vtkActor2D]:
    """Return the line from a name to its part, and the dot there."""
    if label.end is None:
        return []
    points = vtkPoints()
    points.InsertNextPoint(*label.start, 0)
    points.InsertNextPoint(*label.end, 0)
    actors = []
    for cells, set_cells in (((0, 1), vtkPolyData.SetLines), ((1,), vtkPolyData.SetVerts)):
        table = vtkCellArray()
        table.InsertNextCell(len(cells))
        for cell in cells:
            table.InsertCellPoint(cell)
        line = vtkPolyData()
        line.SetPoints(points)
        set_cells(line, table)
        mapper = vtkPolyDataMapper2D()
        mapper.SetInputData(line)
        actor = vtkActor2D()
        actor.SetMapper(mapper)
        look = actor.GetProperty()
        look.SetColor(*INK)
        look.SetLineWidth(1.4)
        look.SetPointSize(7)
        actors.append(actor)
    return actors


def _projected(renderer: vtkRenderer, points: np.ndarray, aspect: float) -> np.ndarray:
    """Return the same from -1 to 1."""
    matrix = renderer.GetActiveCamera().GetCompositeProjectionTransformMatrix(aspect, -1, 1)
    projection = np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)])
    seen = np.column_stack([points, np.ones(len(points))]) @ projection.T
    return seen[:, :2] / seen[:, 3:]


def _png(window: vtkRenderWindow) -> bytes:
    grab = vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    writer = vtkPNGWriter()
    writer.SetInputConnection(grab.GetOutputPort())
    writer.SetCompressionLevel(9)
    writer.WriteToMemoryOn()
    writer.Write()
    return vtk_to_numpy(writer.GetResult()).tobytes()


if __name__ == "__main__":
    answer = [picture(*scene) for scene in pickle.load(sys.stdin.buffer)]
    sys.stdout.buffer.write(pickle.dumps(answer))
