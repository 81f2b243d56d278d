"""The file of a map of the skin's motion: a picture, or a page on which units are switched and turned by clicking."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from pathlib import Path

from unitcad import files
from unitcad.errors import Refusal
from unitcad.export.field import field_picture
from unitcad.report.html_page import MAP, plain_page
from unitcad.skin_map import SkinMap, field_of, map_data, unit_map
from unitcad.spec import Spec

FORMS = (".svg", ".png", ".html")


@dataclass(frozen=True)
class MapFile:
    """A map that a person asked for: its file, the typed threshold (um) if any, the share for the least pitch.

    Raises `Refusal` for an ending of another form.
    """

    path: Path
    threshold_um: float | None
    share: float

    def __post_init__(self) -> None:
        if self.path.suffix.lower() not in FORMS:
            nearest = files.with_ending(self.path, FORMS[0])
            raise Refusal("--map", str(self.path), "must end with .svg, .png or .html", nearest)

    def of_unit(self, spec: Spec, frequency_hz: float | None = None) -> SkinMap:
        """Write the map of one unit and return it."""
        return self.write(unit_map(spec, frequency_hz, self.threshold_um, self.share))

    def write(self, made: SkinMap) -> SkinMap:
        """Write a map and return it: all units on, in one phase."""
        form = self.path.suffix.lower()
        if form == ".html":
            content = map_page(made).encode()
        else:
            content = field_picture(field_of(made), "svg" if form == ".svg" else "png")
        files.write(self.path, content)
        return made


def map_page(made: SkinMap) -> str:
    """Return the HTML of a page with a map, which contacts nothing. Raises `Refusal` for a map that is too large."""
    head = f"<h1>{escape(made.name)}: motion of the skin</h1>"
    return plain_page(
        f"{made.name}: motion of the skin", f"{head}<section>{MAP}</section>", {"skin_map": map_data(made)}
    )
