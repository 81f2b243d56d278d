"""Mould sets of templates, and ways to plant a fault in one."""

from dataclasses import replace

from unitcad.checks import check_moulds
from unitcad.export import printing
from unitcad.export.printing import print_ready
from unitcad.kernels.mesh import arrays
from unitcad.meshcheck import Options, check_bytes
from unitcad.moulds.mould_set import MouldSet
from unitcad.spec import printer_of
from unitcad.validation import load


def set_of(source, *overrides):
    """Return the mould set of a template or a spec file."""
    return of_spec(load(source, overrides))


def of_spec(spec):
    """Return the mould set of a spec, its plan made. Raises Refusal where the moulds can't be."""
    moulds = MouldSet(spec)
    _ = moulds.plan
    return moulds


def broken(moulds):
    """Return the codes of the checks that a set breaks."""
    return {finding.code for finding in check_moulds(moulds) if not finding.ok}


def mesh_findings(moulds):
    """Return what the mesh rules find in the bodies and the pieces of a set, as they are written to STL."""
    findings = []
    for body in (*moulds.unit, *moulds.plan.pieces):
        content = printing.stl(*print_ready(*arrays(moulds.mesh(body)), body.upside_down), body.name)
        printer = printer_of(moulds.spec) if body.made == "printed" else None
        report = check_bytes(content, f"{body.name}.stl", Options(printer=printer))
        findings += [f"{body.name}: {f.code} {f.message}" for f in report.findings if f.severity != "info"]
    return findings


def with_plan(moulds, plan):
    """Return the set with other tools and pours."""
    return replace(moulds, origin=replace(moulds.source, plan=lambda: plan))


def with_fault(moulds, name, change):
    """Return the set with one tool drawn otherwise."""
    plan = moulds.plan
    tools = tuple(replace(tool, shape=change(tool.shape)) if tool.name == name else tool for tool in plan.tools)
    return with_plan(moulds, replace(plan, tools=tools))


def without(moulds, name):
    """Return the set with a tool forgotten on the bench."""
    plan = moulds.plan
    steps = tuple(replace(step, tools=tuple(tool for tool in step.tools if tool != name)) for step in plan.steps)
    return with_plan(moulds, replace(plan, steps=steps))
