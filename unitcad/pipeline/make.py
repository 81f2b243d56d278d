"""The one path from a subject, a unit or an array of units, to a whole result: its files and its manifest."""

from __future__ import annotations

from collections.abc import Sequence

from unitcad import __version__
from unitcad.cache import Store, digest
from unitcad.json_text import json_bytes
from unitcad.pipeline.manifest import CASTING, FileRecord, Manifest, count_findings
from unitcad.pipeline.plan import kernel_versions
from unitcad.pipeline.result import Product, Progress, Result
from unitcad.pipeline.subject import Subject


def make(subject: Subject, only: Sequence[str], check: bool, store: Store, progress: Progress) -> Product:
    """Make a subject's result, all files that `only` asks for, in memory and `store`.

    Raises Refusal if the moulds can't be made, Unfinished if a check lacks memory or time.
    """
    outputs = subject.outputs(only)
    made = subject.make(outputs, check, store, progress)
    progress("manifest")
    own = {subject.file: subject.toml().encode(), **made.own}
    manifest = manifest_of(subject, outputs, made)
    listed = {path: FileRecord(bytes=len(content), sha256=digest(content)) for path, content in own.items()}
    listed |= {path: FileRecord(bytes=store.size(sha256), sha256=sha256) for path, sha256 in made.shared.items()}
    manifest["files"] = dict(sorted(listed.items()))
    return Product(manifest, {**own, "manifest.json": json_bytes(manifest)}, made.shared)


def manifest_of(subject: Subject, outputs: Sequence[str], made: Result) -> Manifest:
    """Return the manifest of a result but for its files, its keys in the order of `Manifest`."""
    unit, moulds = subject.unit, subject.moulds
    manifest = Manifest(
        name=subject.name,
        design=unit.design,
        printer=unit.moulds.printer,
        hash=subject.hash[:12],
        outputs=list(outputs),
        label=made.label,
        warnings=made.warnings,
        air_ring_mm=made.air_ring_mm,
        mesh={
            "kernel": "manifold3d",
            "tolerance_mm": unit.output.tolerance_mm,
            "segments": moulds.segments,
            "note": "volume_mm3 and bbox_mm are the mesh's: its corners may exceed the surface by the tolerance",
        },
        parts=made.parts,
        steps=made.steps,
        mould_checks=made.findings,
        estimate=made.estimate,
        check=count_findings(made.meshes),
        pictures=made.pictures,
        casting=sorted(path for path in made.own if path in CASTING) or None,
        skipped=made.skipped,
        versions={"unitcad": __version__, **kernel_versions(subject.formats)},
        files={},
    )
    further = {**made.blocks, **({"compensation": made.compensation} if made.compensation else {})}
    ordered = {**dict.fromkeys(Manifest.__annotations__), **manifest, **further}
    return Manifest(**{key: value for key, value in ordered.items() if key in manifest or key in further})
