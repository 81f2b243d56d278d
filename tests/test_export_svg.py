from dataclasses import replace
from itertools import combinations, pairwise
from xml.etree import ElementTree

import manifold3d
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sample_bodies import base, cup, layers, tube

from unitcad.api.variant import Variant
from unitcad.export import svg
from unitcad.shape import box, moved
from unitcad.shape.tree import Body
from unitcad.validation import templates

SVG = "{http://www.w3.org/2000/svg}"


def area(region):
    """Area in mm2, by manifold3d's own even-odd filling."""
    return manifold3d.CrossSection(region.loops, manifold3d.FillRule.EvenOdd).area()


def texts(root):
    """Text by what it says, with the box that it takes (px)."""
    found = {}
    for index, node in enumerate(root.iter(f"{SVG}text")):
        width, x, y = svg.text_width(node.text or ""), float(node.get("x", "")), float(node.get("y", ""))
        left = x - {"start": 0.0, "middle": 0.5, "end": 1.0}[node.get("text-anchor", "start")] * width
        found[f"{node.text}#{index}"] = (left, y - 0.75 * svg.TEXT_PX, left + width, y + 0.25 * svg.TEXT_PX)
    return found


def drawn(template):
    variant = Variant.of(template)
    names = {f"layer{i + 1}": f"layer {i + 1}: {layer.material}" for i, layer in enumerate(variant.spec.layers)}
    bodies = [replace(body, name=names.get(body.name, body.name)) for body in variant.unit]
    return svg.unit_section(bodies, variant.dimensions, variant.segments)


@pytest.mark.parametrize("template", sorted(templates()))
def test_no_text_meets_another_or_leaves_the_page(template):
    root = ElementTree.fromstring(drawn(template))
    boxes = texts(root)
    for (one, a), (other, b) in combinations(boxes.items(), 2):
        apart = a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]
        assert apart, (one, other)
    for name, (left, top, right, bottom) in boxes.items():
        assert left >= 0, name
        assert top >= 0, name
        assert right <= float(root.get("width", "")), name
        assert bottom <= float(root.get("height", "")), name


@pytest.mark.parametrize("template", [t for t in sorted(templates()) if Variant.of(t).plan.concentric])
def test_main_dimensions_and_every_layer_are_there(template):
    variant = Variant.of(template)
    dims, spec = variant.dimensions, variant.spec
    said = {name.split("#")[0] for name in texts(ElementTree.fromstring(drawn(template)))}
    wanted = {f"Ø{spec.diameter_mm:g}", f"Ø{2 * dims.motor_radius:g}", f"R{dims.cavity_radius:g}", "motor", "skin"}
    wanted |= {f"{layer.wall_mm:g}" for layer in spec.layers}
    wanted |= {f"{layer.cap_mm:g}" for layer in spec.layers if layer.cap_mm}
    wanted |= {f"layer {i + 1}: {layer.material}" for i, layer in enumerate(spec.layers)}
    wanted |= {f"{dims.heights[-1]:g}"}
    wanted |= {"air"} if dims.air_ring > 0 else set()
    wanted |= {"fpcb"} if spec.fpcb else set()
    if dims.exit:
        wanted |= {f"slot {dims.exit.height:g} × {dims.exit.width:g}"}
    assert wanted <= said


def test_regions_are_the_profiles():
    """Layer 1 of the sample: twice its half profile, less the slot through one wall and into the cap above the core."""
    first, second = svg.cut(layers(), 96)
    assert area(first) == pytest.approx(2 * (5.75 * 3.36 - 4.5 * 2.11) - 1.25 * 0.5 - 0.6 * 0.39, abs=0.02)
    assert area(second) == pytest.approx(2 * (7 * 4.61 - 5.75 * 3.36) - 1.25 * 0.5, abs=0.02)


def shared_area(bodies, y):
    """Area that two bodies claim in the section at y, mm2."""
    one, other = (manifold3d.CrossSection(r.loops, manifold3d.FillRule.EvenOdd) for r in svg.cut(bodies, 96, y))
    return (one ^ other).area()


@pytest.mark.parametrize("y", [0.0, 1.6, 7.0, 13.0])
def test_bodies_in_one_section_do_not_overlap(y):
    """Also in planes that faces and vertices lie in; and a cup 0.5 mm too low is seen."""
    assert shared_area([base(), cup()], y) < 1e-3
    low = Body("cup2", "tool", "cup", moved(cup().shape, z=-0.5), (0, 0, 0))
    assert shared_area([base(), low], y) > 0.1


def test_a_block_is_cut_where_it_is_asked_for():
    block = Body("block", "tool", "coupon", box(0, 4, -1, 3, 1, 2), (0, 0, 0))
    assert area(svg.cut([block], 24, y=2.9)[0]) == pytest.approx(4, abs=1e-9)
    assert svg.cut([block], 24, y=3.1) == []
    assert area(svg.cut([block], 24, reach=2.5)[0]) == pytest.approx(2.5, abs=1e-9)


def test_leaders_end_in_what_they_name():
    regions = svg.cut([*layers(), tube()], 96)
    for region, (x, z) in zip(regions, svg._anchors(regions, [60, 60, 40]), strict=True):
        flat = manifold3d.CrossSection(region.loops, manifold3d.FillRule.EvenOdd)
        dot = manifold3d.CrossSection.square((0.1, 0.1), True).translate((x, z))
        assert (dot - flat).is_empty()


def test_same_text_again_and_names_are_escaped():
    assert drawn("encapsulating") == drawn("encapsulating")
    odd = svg.section(svg.cut([replace(tube(), name="<i>")], 48), title="a<b>&", ground="seat")
    said = {name.split("#")[0] for name in texts(ElementTree.fromstring(odd))}
    assert {"a<b>&", "<i>", "seat"} <= said


@given(st.lists(st.tuples(st.floats(-500, 500), st.floats(1, 90)), min_size=1, max_size=9))
def test_spread_keeps_order_and_distance(items):
    wanted, sizes = [w for w, _ in items], [s for _, s in items]
    found = svg.spread(wanted, sizes, 4)
    order = sorted(range(len(items)), key=lambda i: found[i])
    for left, right in pairwise(order):
        assert wanted[left] <= wanted[right]
        assert found[right] - found[left] >= (sizes[left] + sizes[right]) / 2 + 4 - 1e-6
