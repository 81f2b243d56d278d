"""Make the README's pictures, and with --look every screenshot of the pages for a person to look at.

    python docs/pictures/make.py              unit, moulds and three pages, into this folder
    python docs/pictures/make.py --look DIR   the pages in light, dark and 390 pixels wide, into DIR
    python docs/pictures/make.py --moving     only the moving picture of the live page, into this folder

Needs the extras `serve` and `test`, and Chromium.
"""

from __future__ import annotations

import argparse
import io
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1] / "tests" / room) for room in ("report", "serve")]

import chromium  # noqa: E402
import numpy as np  # noqa: E402
from live import WALL, Live  # noqa: E402
from PIL import Image  # noqa: E402
from running import serving  # noqa: E402

from unitcad import Variant  # noqa: E402
from unitcad.arrays.array_file import load_array  # noqa: E402
from unitcad.arrays.array_map import array_map  # noqa: E402
from unitcad.arrays.array_page import pictures as patch_pictures  # noqa: E402
from unitcad.arrays.crosstalk import crosstalk_files  # noqa: E402
from unitcad.arrays.patch import patch_moulds  # noqa: E402
from unitcad.cache import MemoryStore  # noqa: E402
from unitcad.export.field import field_picture  # noqa: E402
from unitcad.export.raster import Surface, draw  # noqa: E402
from unitcad.kernels import mesh  # noqa: E402
from unitcad.lab.phantom import SEGMENTS, PhantomSet, load_phantom, phantom_set  # noqa: E402
from unitcad.pipeline.scenes import exploded_view, step_in_section, unit_cut_open  # noqa: E402
from unitcad.pipeline.write import build  # noqa: E402
from unitcad.report import write_report  # noqa: E402
from unitcad.shape.tree import Body  # noqa: E402
from unitcad.skin_map import field_of  # noqa: E402
from unitcad.validation import compound_kind, load  # noqa: E402

ARRAY_PICTURES = {"skin-side": "patch-skin-side", "tools": "tools"}
MOST_BYTES = 250_000
MOST_MOVING = 1_000_000
MOVING_PX = (960, 656)
APART_MM = 14.0
"""Between two pieces of a box taken apart."""
LOOKS = (("light", 1280, 900, False), ("dark", 1280, 900, True), ("narrow", 390, 844, False))


def main() -> None:
    """Make what was asked for; prints each file with its size."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--look", type=Path, metavar="DIR", help="screenshots of the pages into DIR")
    parser.add_argument("--moving", action="store_true", help="only the moving picture of the live page")
    given = parser.parse_args()
    look = given.look
    with tempfile.TemporaryDirectory() as scratch:
        made = (
            screenshots(look, Path(scratch))
            if look
            else moving(Path(scratch))
            if given.moving
            else {**pictures(), **gallery(), **arrays(), **pages(Path(scratch)), **moving(Path(scratch))}
        )
    for name, content in sorted(made.items()):
        target = (look or HERE) / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content)
        print(f"{target}  {len(content) / 1000:.0f} kB")


def pictures() -> dict[str, bytes]:
    """Units cut open (six are the README's gallery), two sets taken apart, and the second pour of one."""
    variants = {name: Variant.of(name) for name in ("encapsulating", "embedded")}
    custom = HERE.parents[1] / "templates" / "custom"
    dome, film, lugs = (Variant.of(str(custom / f"{name}.toml")) for name in ("dome", "film-closed", "strap-lugs"))
    made = {f"{name}-unit.png": unit_cut_open(variant) for name, variant in variants.items()}
    made |= {f"{name}-unit.png": unit_cut_open(Variant.of(name)) for name in ("pass-through", "three-layer")}
    made |= {"strap-lugs-unit.png": unit_cut_open(lugs), "film-closed-unit.png": unit_cut_open(film)}
    made["encapsulating-moulds.png"] = exploded_view(variants["encapsulating"])
    made["strap-lugs-moulds.png"] = exploded_view(lugs)
    made["strap-lugs-pour2.png"] = step_in_section(lugs, 2)
    made["film-closed-moulds.png"] = exploded_view(film)
    made["film-closed-pour2.png"] = step_in_section(film, 2)
    made["dome-unit.png"] = unit_cut_open(dome)
    made["encapsulating-pour2.png"] = step_in_section(variants["encapsulating"], 2)
    made["phantom-box.png"] = box_taken_apart(phantom_set(load_phantom("skin")))
    section = {"encapsulating-section.svg": variants["encapsulating"].section().encode()}
    return section | {name: small(image) for name, image in made.items()}


def box_taken_apart(phantom: PhantomSet) -> bytes:
    """Draw the box of a phantom taken apart, as a PNG file."""
    shown = [body for body in phantom.tools if body.kind != "blade"]

    def place(body: Body) -> tuple[float, bool]:
        """Return a body's place in the stack: its top's height, but the tray's foot, and a layer after its frame."""
        _, _, low, _, _, high = mesh.bounds(mesh.realise(body.shape, SEGMENTS))
        return (low if body.kind == "base" else high, body.kind == "layer")

    bodies = sorted([*shown, *phantom.layers], key=place)
    parts, height = [], 0.0
    for body in bodies:
        vertices, faces = mesh.arrays(mesh.realise(body.shape, SEGMENTS))
        low, high = vertices[:, 2].min(), vertices[:, 2].max()
        parts.append(Surface(vertices + np.array([0.0, 0.0, height - low]), faces, body.colour, body.name))
        height += (high - low) + APART_MM
    return draw(parts, (1.0, -2.0, 0.7), (1200, 900))


def gallery() -> dict[str, bytes]:
    """The cards of docs/gallery: units cut open, arrays seen from the skin's side."""
    made = {}
    for path in sorted((HERE.parent / "gallery").glob("*.toml")):
        if compound_kind(path):
            made[path.stem] = patch_pictures(patch_moulds(load_array(str(path))))["pictures/patch-skin-side.png"]()
        else:
            made[path.stem] = unit_cut_open(Variant.of(str(path)))
    return {f"gallery-{name}.png": small(image) for name, image in made.items()}


def arrays() -> dict[str, bytes]:
    """Patches from the skin's side, and their tools taken apart."""
    array = load_array("forearm-pockets")
    drawn = {
        kind: patch_pictures(patch_moulds(load_array(name)))
        for kind, name in (("pockets", array), ("patch", "forearm-patch"))
    }
    band, sleeve = (patch_pictures(patch_moulds(load_array(name))) for name in ("wrist-band", "sleeve-curved"))
    maps = crosstalk_files(array)
    return {
        **{
            f"array-{kind}-{name}.png": files[f"pictures/{path}.png"]()
            for kind, files in drawn.items()
            for name, path in ARRAY_PICTURES.items()
        },
        "array-band-bent.png": band["pictures/patch-bent.png"](),
        "array-band-tools.png": band["pictures/tools.png"](),
        "array-curved-tools.png": sleeve["pictures/tools.png"](),
        "array-crosstalk.svg": maps["crosstalk.svg"],
        "array-skin-map.svg": field_picture(field_of(array_map(array)), "svg"),
    }


def pages(scratch: Path) -> dict[str, bytes]:
    """The top of a variant's page and of a batch's."""
    found = {}
    with chromium.browser() as running:
        for name, page in written(scratch):
            seen = chromium.Visit(running, page)
            if name == "variant":
                seen.drawn()
            found[f"page-{name}.png"] = small(seen.page.screenshot(full_page=name == "batch"))
            seen.close()
        found["page-live.png"] = small(dict(live_page(running, scratch, LOOKS[:1]))["light"])
    return found


def live_page(running: Any, scratch: Path, looks: Sequence[tuple[str, int, int, bool]]) -> Iterator[tuple[str, bytes]]:
    """The live page in each look: its top, with a wall that the diameter has no room for."""
    with serving(scratch, "encapsulating") as server:
        for scheme, width, height, dark in looks:
            seen = Live(running, server, width, height, dark)
            seen.choose(WALL, "2.5")
            seen.page.evaluate("() => document.activeElement.blur()")
            yield scheme, seen.page.screenshot()
            seen.close()


def moving(scratch: Path) -> dict[str, bytes]:
    """The live page in use as an animated WebP: a wall grows, is refused and repaired, a design is picked, the moulds.

    Screenshots of a running page, each as long as it takes to read. Raises ValueError past MOST_MOVING.
    """
    frames: list[tuple[Image.Image, int]] = []
    with chromium.browser() as running, serving(scratch, "encapsulating") as server:
        seen = Live(running, server, 1200, 820)

        def shot(milliseconds: int) -> None:
            seen.page.evaluate("() => document.activeElement.blur()")
            image = Image.open(io.BytesIO(seen.page.screenshot())).convert("RGB")
            frames.append((image.resize(MOVING_PX, Image.Resampling.LANCZOS), milliseconds))

        shot(1800)
        for wall, milliseconds in (("1.4", 700), ("1.6", 700), ("1.8", 900), ("2.5", 3500)):
            seen.choose(WALL, wall)
            shot(milliseconds)
        seen.pressed(seen.page.get_by_role("button", name="Use diameter_mm"))
        shot(2500)
        count = len(seen.timings())
        seen.page.select_option('select[name="design"]', "embedded")
        seen.until(lambda: len(seen.timings()) > count)
        seen.settled()
        shot(3500)
        seen.pressed(seen.page.get_by_role("button", name="Undo"))
        seen.page.check('input[value="moulds"]')
        seen.page.wait_for_timeout(500)
        shot(3500)
        seen.close()
    made = io.BytesIO()
    images, durations = zip(*frames, strict=True)
    images[0].save(
        made, "WEBP", save_all=True, append_images=images[1:], duration=list(durations), loop=0, quality=80, method=6
    )
    if len(made.getvalue()) >= MOST_MOVING:
        raise ValueError(f"a moving picture of {len(made.getvalue())} bytes, {MOST_MOVING} at most")
    return {"page-live.webp": made.getvalue()}


def screenshots(look: Path, scratch: Path) -> dict[str, bytes]:
    """The pages in every look, two of them whole; the variant's with the unit, the set taken apart, and as printed."""
    found = {}
    with chromium.browser() as running:
        found |= {f"live-{scheme}.png": image for scheme, image in live_page(running, scratch, LOOKS)}
        for name, page in written(scratch):
            for scheme, width, height, dark in LOOKS:
                seen = chromium.Visit(running, page, width, height, dark)
                if name == "variant":
                    seen.drawn()
                    found[f"{name}-{scheme}-moulds.png"] = moulds(seen)
                    seen.page.check('input[value="unit"]')
                found[f"{name}-{scheme}.png"] = seen.page.screenshot(full_page=True)
                if (name, scheme) == ("variant", "light"):
                    seen.page.emulate_media(media="print")
                    seen.page.evaluate("() => window.dispatchEvent(new Event('beforeprint'))")
                    found["variant-printed.png"] = seen.page.screenshot(full_page=True)
                seen.close()
    return found


def moulds(seen: Any) -> bytes:
    """The 3D part with the moulds taken apart."""
    seen.page.check('input[value="moulds"]')
    seen.page.uncheck('input[name="cut"]')
    seen.page.fill('input[name="apart"]', "100")
    seen.page.dispatch_event('input[name="apart"]', "change")
    seen.page.wait_for_timeout(300)
    image = seen.page.locator(".stage").screenshot()
    seen.page.fill('input[name="apart"]', "0")
    seen.page.check('input[name="cut"]')
    return image


def written(scratch: Path) -> Iterator[tuple[str, Path]]:
    """The page of one variant, and of a small sweep over walls and silicones."""
    yield "variant", write_report(build(load("encapsulating"), scratch / "one").folder)
    store, out = MemoryStore(), scratch / "sweep"
    for design in ("embedded", "encapsulating"):
        for wall in (0.8, 1.0, 1.25, 1.5, 1.75, 2.0):
            for inner, outer in (("ecoflex-00-10", "dragon-skin-10-medium"), ("ecoflex-00-10", "dragon-skin-30")):
                changes = [f"layers.0.wall_mm={wall}", f'layers.0.material="{inner}"', f'layers.1.material="{outer}"']
                name = f'name="{design} {wall} {outer}"'
                spec = load(design, [*changes, name, "diameter_mm=16.0", 'output.formats=["stl"]'])
                build(spec, out, only=["unit", "moulds", "estimate"], check=False, store=store)
    yield "batch", write_report(out)


def small(image: bytes) -> bytes:
    """The picture with 256 colours, which a drawing needs no more than. Raises ValueError past MOST_BYTES."""
    reduced = io.BytesIO()
    Image.open(io.BytesIO(image)).convert("RGB").quantize(256).save(reduced, "PNG", optimize=True)
    if len(reduced.getvalue()) >= MOST_BYTES:
        raise ValueError(f"a picture of {len(reduced.getvalue())} bytes, {MOST_BYTES} at most")
    return reduced.getvalue()


if __name__ == "__main__":
    main()
