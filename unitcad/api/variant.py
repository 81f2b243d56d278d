"""A variant: a mould set with its ways to other libraries."""

# pyright: strict
from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, overload

from manifold3d import Manifold

from unitcad import text
from unitcad.catalogue import materials
from unitcad.errors import UnitcadError, WrongArgument, unknown_name
from unitcad.kernels.mesh import as_trimesh
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline.assembly import assembly
from unitcad.pipeline.mass import MassProperties, mass_properties
from unitcad.pipeline.plan import unit_section
from unitcad.report.page import view
from unitcad.shape.tree import Body
from unitcad.spec import Spec
from unitcad.validation import Source, load


@dataclass(frozen=True, eq=False)
class Variant(MouldSet):
    """A spec's unit, moulds and meshes. Each is computed when it is first used.

    Parameters
    ----------
    spec : Spec
        The spec; ``Variant.of`` takes a template's name or a file.
    given : frozenset of str, optional
        Paths of the lengths that a person gave, such as "motor.thickness_mm"; the procedure asks to measure the others.
    origin : Origin, optional
        What rooms cast in place of a unit, such as the sheet of an array. Default: the unit of the spec.

    Attributes
    ----------
    bodies : dict of str to Body
        Bodies of unit and tooling by name: "layer1", "motor", "base", "cup1" and so on. Lengths in mm, as assembled,
        z = 0 at the skin.

    Raises
    ------
    UnitcadError
        For a ``spec`` that is none.

    Examples
    --------
    >>> import unitcad
    >>> variant = unitcad.Variant.of("encapsulating", "diameter_mm=15")
    >>> list(variant.bodies)[:4]
    ['layer1', 'layer2', 'motor', 'fpcb']
    >>> mesh = variant.mesh("layer1", "trimesh")
    >>> mesh.is_watertight, mesh.vertices.shape[1]
    (True, 3)
    """

    def __post_init__(self) -> None:
        if not isinstance(self.spec, Spec):  # pyright: ignore[reportUnnecessaryIsInstance]
            given = type(self.spec).__name__
            raise UnitcadError(f"Variant takes a Spec, not {given}; Variant.of takes a template's name or a file")

    @classmethod
    def of(cls, source: Source, *overrides: str) -> Variant:
        """Return the variant of a template, a file, plain data or a spec, with each "path=value" put in.

        Raises Refusal or UnitcadError.
        """
        return cls(load(source, overrides))

    @property
    def bodies(self) -> dict[str, Body]:
        """The bodies of unit and tooling by name: "layer1", "motor", "base", "cup1" and so on.

        Raises Refusal if the moulds can't be made.
        """
        return {body.name: body for body in (*self.unit, *self.plan.tools)}

    @overload
    def mesh(self, body: Body | str, library: Literal["manifold3d"] = "manifold3d") -> Manifold: ...

    @overload
    def mesh(self, body: Body | str, library: Literal["trimesh"]) -> Any: ...

    def mesh(self, body: Body | str, library: Literal["manifold3d", "trimesh"] = "manifold3d") -> Any:
        """Return a body's closed mesh, mm, as a manifold3d.Manifold or a trimesh.Trimesh.

        `body` is a body or the name of one. Vertices are doubles, shape (n, 3); faces are integers, shape (m, 3),
        counter-clockwise from outside. Raises Refusal for a name or a library that there is not.
        """
        if library not in ("manifold3d", "trimesh"):
            raise unknown_name("library", str(library), ("manifold3d", "trimesh"))
        if not isinstance(body, Body | str):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise WrongArgument("body", body, "takes a body's name or a Body")
        if isinstance(body, str):
            of_unit = {body.name: body for body in self.unit}
            known = of_unit if body in of_unit else self.bodies  # the moulds are drawn only for a tool
            if body not in known:
                raise unknown_name("body", body, known)
            body = known[body]
        solid = super().mesh(body)
        return solid if library == "manifold3d" else as_trimesh(solid)

    def to_build123d(self, step: int | None = None, exploded: bool = False) -> Any:
        """Return unit and moulds as a build123d Compound with the children ``unit`` and ``moulds``.

        Parameters
        ----------
        step : int, optional
            Number of a pour: its tools, cured layers and inserts, the silicone in the cavity. Default: the finished
            unit at its place, and next to it the moulds of the last pour with the other tools aside.
        exploded : bool, default False
            Unit and moulds taken apart, side by side.

        Returns
        -------
        build123d.Compound
            Lengths in mm. Each child has one child a body, with its name and colour. No two bodies share volume.

        Raises
        ------
        WrongArgument
            For a pour that there is not.
        UnitcadError
            Without the extra, and if the moulds can't be made.
        """
        from unitcad.kernels import native

        return native.build123d_compound(self.spec.name, self._groups(step, exploded))

    def to_cadquery(self, step: int | None = None, exploded: bool = False) -> Any:
        """Return unit and moulds as a CadQuery Assembly with the children ``unit`` and ``moulds``.

        Parameters and errors are those of ``to_build123d``.
        """
        from unitcad.kernels import native

        return native.cadquery_assembly(self.spec.name, self._groups(step, exploded))

    def _groups(self, step: int | None, exploded: bool) -> dict[str, tuple[Body, ...]]:
        return {group.name: group.bodies for group in assembly(self, step, exploded)}

    def mass_properties(self) -> MassProperties:
        """Return volume, mass, centre and inertia of the unit and of each body in it.

        Silicones have the catalogue's densities, the motor the catalogue's mass. Circuit and wires are assumed.
        """
        return mass_properties(self)

    def show(self) -> None:
        """Show unit and moulds, named and coloured, in ocp-vscode or YACV. Raises UnitcadError without either."""
        from unitcad.kernels import native

        native.show(self.to_build123d())

    def section(self) -> str:
        """Return the drawing of the unit cut along its tail, with dimensions in mm, as SVG."""
        return unit_section(self)

    def __repr__(self) -> str:
        return f"Variant({self.spec.summary})"

    def _repr_html_(self) -> str:
        known, rows = materials(self.spec.materials), list[tuple[object, ...]]()
        for body in self.unit:
            if body.step is None:
                continue
            material, volume = known[self.spec.layers[body.step - 1].material], self.mesh(body).volume()
            # g/cm3 times mm3 is mg.
            mass = volume * float(material.density_g_cm3) / 1000
            rows.append((body.name, material.name, round(volume, 2), round(mass, 3)))
        head = ("layer", "material", "volume, mm³", "mass, g")
        drawn = text.drawing(self.section(), f"section of {self.spec.name}") + view(self.spec)
        return drawn + text.table(head, rows, self.spec.summary)
