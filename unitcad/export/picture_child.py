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
    vtkLight,
    vtkPolyDataMapper,
    vtkRenderer,
    vtkRenderWindow,
    vtkTextActor,
    vtkWindowToImageFilter,
)

CREASE_DEG = 20.0
"""Edges sharper than this are drawn as lines and not shaded over."""
INK = (0.13, 0.15, 0.18)


def picture(size: tuple[int, int], towards_eye: tuple[float, float, float], parts: list[dict[str, Any]]) -> bytes:
    """Draw one PNG."""
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
    _fit(renderer, parts, size)
    names = [part for part in parts if part["label"]]
    for part in names:
        renderer.AddViewProp(_label(renderer, part, parts))
    window.Render()
    return _png(window)


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


def _fit(renderer: vtkRenderer, parts: list[dict[str, Any]], size: tuple[int, int]) -> None:
    """Move the camera along its view so that every vertex is in the picture, with a margin, and the lot is centred."""
    camera = renderer.GetActiveCamera()
    renderer.ResetCamera()
    points = np.vstack([part["vertices"] for part in parts])
    aspect = size[0] / size[1]
    # Names stand to the left: the drawing gets the right of the picture.
    left = -0.60 if any(part["label"] for part in parts) else -0.94
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


def _label(renderer: vtkRenderer, part: dict[str, Any], parts: list[dict[str, Any]]) -> vtkTextActor:
    """Write the part's name left of everything drawn, level with the part's middle."""
    x, _ = _on_screen(renderer, np.vstack([p["vertices"] for p in parts])).min(axis=0)
    spots = _on_screen(renderer, part["vertices"])
    text = vtkTextActor()
    text.SetInput(part["label"])
    look = text.GetTextProperty()
    look.SetFontSize(26)
    look.SetColor(*INK)
    look.SetVerticalJustificationToCentered()
    look.SetJustificationToRight()
    text.SetDisplayPosition(round(x) - 30, round((spots[:, 1].min() + spots[:, 1].max()) / 2))
    return text


def _on_screen(renderer: vtkRenderer, points: np.ndarray) -> np.ndarray:
    """Return where points (n, 3) fall in the picture, (n, 2) pixels from its lower left corner."""
    width, height = renderer.GetSize()
    seen = _projected(renderer, points, width / height)
    return (seen + 1) / 2 * (width, height)


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
