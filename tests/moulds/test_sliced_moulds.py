"""Moulds as a slicer prints them: heights, walls, bores, ribs and rims by the beads of its own paths. Nightly.

Every template, in layers of three heights over first layers of three heights, by two nozzles.
"""

import math
import re
import zipfile

import prusa
import pytest
from faulty_sets import set_of
from slicer_beads import layers_of, section, shapely

from unitcad.casting.plates import mould_plates
from unitcad.casting.preparation import slicer_settings
from unitcad.moulds.cup import SLOPE, ribs
from unitcad.moulds.heights import unit_heights
from unitcad.pipeline.plan import threemf_content
from unitcad.spec import printer_of
from unitcad.validation import templates

pytestmark = [*prusa.MARKS, pytest.mark.long]

# A slicer refuses a layer higher than the nozzle is wide.
PRINTERS = [("fdm-0.4", first, layer) for first in (0.2, 0.3, 0.35) for layer in (0.1, 0.2, 0.25)]
PRINTERS += [("fdm-0.25", 0.2, layer) for layer in (0.1, 0.2)]
LINE_MM = 0.02
"""Accuracy of a line's edge: beads are rounded, and a slicer writes micrometres."""


class Sliced:
    """A set's plate in the slicer's paths; sections of its pieces stand where they are printed."""

    def __init__(self, moulds, folder):
        (plate,) = mould_plates(moulds).values()
        self.moulds, self.bodies = moulds, {body.name: body for body in plate}
        lengths, printer = moulds.spec.moulds, printer_of(moulds.spec)
        file, code = folder / "plate.3mf", folder / "plate.gcode"
        file.write_bytes(threemf_content(moulds, plate, slicer_settings(moulds)))
        heights = (
            "--first-layer-height",
            f"{lengths.first_layer_mm:g}",
            "--nozzle-diameter",
            f"{printer.nozzle_mm.value:g}",
        )
        x, y = lengths.bed_x_mm, lengths.bed_y_mm
        stay = "--dont-arrange", "--bed-shape", f"0x0,{x:g}x0,{x:g}x{y:g},0x{y:g}"
        labels = ("--gcode-label-objects", "--skirts", "0", "--layer-height", f"{lengths.layer_mm:g}")
        said = prusa.run("--export-gcode", *stay, *labels, *heights, "--output", code, file)
        assert code.exists(), said[-500:]
        self.layers = layers_of(code.read_text())
        model = prusa_model(file)
        names = dict(re.findall(r'<object id="(\d+)" type="model" name="([^"]+)"', model))
        self.at = {
            names[number]: (float(x), float(y))
            for number, x, y in re.findall(r'<item objectid="(\d+)" transform="1 0 0 0 1 0 0 0 1 (\S+) (\S+) ', model)[
                ::-1
            ]
        }

    def placed(self, name):
        """A piece as it lies on the bed."""
        mesh = self.moulds.mesh_of(self.bodies[name].shape)
        mesh = mesh.rotate((180, 0, 0)) if self.bodies[name].upside_down else mesh
        return mesh.translate((*self.at[name], -mesh.bounding_box()[2]))

    def point(self, name, x, y):
        """A point of the assembled set on the bed."""
        across = -y if self.bodies[name].upside_down else y
        return shapely.Point(self.at[name][0] + x, self.at[name][1] + across)

    def top(self, name, x, y):
        """The end of the last layer with a bead over a point of the assembled set, mm over the bed."""
        at = self.point(name, x, y)
        return max(layer.top for layer in self.layers[name] if layer.area.distance(at) < 0.05)


def prusa_model(file):
    return zipfile.ZipFile(file).read("3D/3dmodel.model").decode()


@pytest.fixture(scope="module")
def sliced(tmp_path_factory):
    made = {}

    def of(template, printer, first, layer):
        key = template, printer, first, layer
        if key not in made:
            made.clear()  # one at a time
            sets = f"moulds.printer={printer}", f"moulds.first_layer_mm={first}", f"moulds.layer_mm={layer}"
            made[key] = Sliced(set_of(template, *sets), tmp_path_factory.mktemp("plate"))
        return made[key]

    return of


CASES = [(template, *printer) for template in sorted(templates()) for printer in PRINTERS]
IDS = [f"{template} {printer} {first:g}+{layer:g}" for template, printer, first, layer in CASES]


@pytest.fixture(params=CASES, ids=IDS, scope="module")
def plate(request, sliced):
    return sliced(*request.param)


def test_no_piece_is_dropped(plate):
    for own, body in plate.bodies.items():
        name = "tongue" if body.kind == "tongue" else own  # those that are alike are copies of one object
        z = plate.moulds.mesh_of(body.shape).bounding_box()
        assert name in plate.layers, "the slicer prints nothing of it"
        tops = [layer.top for layer in plate.layers[name]]
        assert tops[0] == pytest.approx(plate.moulds.spec.moulds.first_layer_mm)
        assert tops[-1] == pytest.approx(z[5] - z[2], abs=plate.moulds.spec.moulds.layer_mm / 2 + 1e-3)


def test_heights_are_those_that_the_sheet_says(plate):
    moulds = plate.moulds
    dims, said = moulds.plan.dimensions, {each.what: each for each in unit_heights(moulds)}
    angle = math.radians(112.5)  # clear of tails, keys and pry slots

    def around(radius):
        return radius * math.cos(angle), radius * math.sin(angle)

    seat_at = around(dims.outer_radius + moulds.spec.moulds.land_mm / 2)
    seat = plate.top("base", *seat_at)
    core = plate.top("base", *around(min(dims.cavity_radius, dims.outer_radius) * 0.6)) - seat
    if "cavity" in said:
        assert core == pytest.approx(said["cavity"].printed_mm, abs=1e-3)
    below = core if "cavity" in said else 0.0
    for i, step in enumerate(moulds.plan.steps):
        # Upside down, a cup's land stands on the bed, and its seat is where the land ends.
        name = next(body.name for body in plate.bodies.values() if body.kind == "cup" and body.step == step.index)
        rim = plate.top(name, *around(dims.radii[i] + moulds.spec.moulds.land_mm / 2))
        cap, height = said.get(f"layer {i + 1}'s cap"), said.get(f"layer {i + 1}'s height")
        if cap:
            assert rim - below == pytest.approx(cap.printed_mm, abs=1e-3)
            below = rim
        if height:
            assert rim == pytest.approx(height.printed_mm, abs=1e-3)
    if "tongue" in plate.layers:
        assert plate.layers["tongue"][-1].top == pytest.approx(said["tongue's thickness"].printed_mm, abs=1e-3)


def test_walls_are_closed(plate):
    """Of the skin of each piece, two lines deep, no bead leaves a gap through which silicone runs."""
    nozzle = plate.moulds.spec.moulds
    wide = 1.5 * float(printer_of(plate.moulds.spec).nozzle_mm)
    for name in plate.bodies:
        if plate.bodies[name].kind not in ("cup", "base"):
            continue
        mesh, low = plate.placed(name), 0.0
        for i, layer in enumerate(plate.layers[name]):
            solid = section(mesh, (low + layer.top) / 2)
            low = layer.top
            if i == 0:  # drawn in against the elephant's foot
                continue
            skin = solid.difference(solid.buffer(-wide))
            gaps = skin.difference(layer.area).buffer(-2 * LINE_MM)
            assert gaps.area < 0.15 * nozzle.layer_mm + 0.1, f"{name} at {layer.top} mm"


def bore_radius(layer, at):
    """The radius of the circle that no bead enters."""
    return layer.area.distance(at)


def test_bores_are_as_drawn_and_rims_open(plate):
    moulds, dims = plate.moulds, plate.moulds.plan.dimensions
    if moulds.spec.moulds.draft_deg:
        pytest.skip("a tapered bore")
    for i, step in enumerate(moulds.plan.steps):
        name = next(body.name for body in plate.bodies.values() if body.kind == "cup" and body.step == step.index)
        at, layers = plate.point(name, 0.0, 0.0), plate.layers[name]
        radii = [bore_radius(layer, at) for layer in layers if layer.top < dims.heights[i] / 2]
        assert min(radii[1:]) == pytest.approx(dims.radii[i], abs=0.03)
        # The rim, on the bed, is drawn in against the elephant's foot. The wide lines of a high first layer leave the
        # land no room for it: such a rim is as drawn, less the rounding of its lines.
        drawn_in = 0.05 if moulds.spec.moulds.first_layer_mm <= 0.2 else -0.05
        assert radii[0] >= dims.radii[i] + drawn_in
        ring = shapely.Point(at).buffer(dims.radii[i] + moulds.spec.moulds.land_mm * 0.8, quad_segs=64)
        land = layers[0].area.intersection(ring.difference(at.buffer(dims.radii[i])))
        assert max((len(part.interiors) for part in getattr(land, "geoms", [land])), default=0) >= 1, "a broken rim"


def test_every_rib_is_printed(plate):
    """At the middle of the crests, as many beads reach into the plinth as there are ribs."""
    moulds = plate.moulds
    standing = ribs(moulds.frame)
    if not standing:
        pytest.skip("no ribs")
    middle = (standing[0].bottom + standing[0].top) / 2
    depth = moulds.spec.moulds.rib_interference_mm
    for step in moulds.plan.steps:
        name = next(body.name for body in plate.bodies.values() if body.kind == "cup" and body.step == step.index)
        rim = moulds.plan.dimensions.heights[step.index - 1]
        layer = next(each for each in plate.layers[name] if each.top >= rim - middle)
        face = (rim - layer.top + layer.height / 2) * SLOPE  # of the plinth there, out of its upper edge
        for rib in standing:
            reach = [
                layer.area.distance(
                    plate.point(name, *(at + n * (face + d) for at, n in zip((rib.x, rib.y), rib.inwards, strict=True)))
                )
                for d in (depth - 2 * LINE_MM, depth + 0.1)
            ]
            assert reach[0] < LINE_MM < reach[1], f"{name}: the rib at {rib.x:g}, {rib.y:g}"
