"""The commands before a build: init and list, and coupon, which shows the clearances that a printer needs."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer
from msgspec import to_builtins

from unitcad import catalogue
from unitcad.casting.coupon import Coupon, write
from unitcad.casting.leak_coupon import LeakCoupon, Readings
from unitcad.catalogue.filters import SHORT, keep
from unitcad.catalogue.moduli import moduli_note
from unitcad.cli.output import print_json
from unitcad.cli.shared_options import AsJson, Out
from unitcad.designs import shipped as designs
from unitcad.documents import read_toml
from unitcad.errors import Refusal, UnitcadError, unknown_name
from unitcad.files import names_device, write_new
from unitcad.meshcheck.rules.registry import rules
from unitcad.rooms import file_kinds, load
from unitcad.spec import convert
from unitcad.text import some
from unitcad.validation import default_template
from unitcad.validation.cupboard import add_entry, held, read_cupboard
from unitcad.validation.load import shipped_of
from unitcad.validation.plain_data import changes_of
from unitcad.validation.starter import comment_template


def init(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the variant, and of its file NAME.toml.")],
    template: Annotated[
        str | None,
        typer.Option(
            metavar="TEMPLATE",
            help=f"Shipped file to start from (unitcad list templates). Default: {default_template()}.",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Write a commented file to start from. The last line printed is the file.

    Its first line names the schema that an editor checks it with; `unitcad schema -o FILE` writes that.
    """
    kinds = [kind for kind in file_kinds() if kind.starts]
    starts = {shipped: (kind, file) for kind in reversed(kinds) for shipped, file in shipped_of(kind).items()}
    template = template or default_template()
    if template not in starts:
        raise unknown_name("--template", template, starts)
    stem = name.removesuffix(".toml")
    if not re.fullmatch(r"[A-Za-z0-9]([A-Za-z0-9._-]{0,58}[A-Za-z0-9_-])?", stem):
        near = re.sub(r"[^A-Za-z0-9._-]+", "-", stem)[:60].strip("-._") or "my-unit"
        raise Refusal("NAME", name, "must be letters, digits, dots and dashes", near)
    if Path(stem).suffix in (".txt", ".json", ".yaml", ".yml"):
        raise Refusal("NAME", name, "is the name of a TOML file", f"{Path(stem).stem}.toml")
    if names_device(stem):
        raise Refusal("NAME", name, "is the name of a device on Windows", f"my-{stem}")
    path = Path(f"{stem}.toml")
    kind, start = starts[template]
    schema = f"unitcad-{kind.name}.schema.json"
    try:
        write_new(path, comment_template(start, stem, load(kind.model), schema).encode())
    except FileExistsError:
        raise UnitcadError(f"{path}: exists already; choose another name") from None
    except OSError as error:
        raise UnitcadError(f"{path}: {(error.strerror or 'unwritable').lower()}") from None
    if as_json:
        print_json({kind.name: str(path)})
        return
    typer.echo(f"Edit the file, then run: {kind.command} {path}")
    if not Path(schema).exists():
        typer.echo(f"To check it in an editor as you type, run: unitcad schema {kind.name} -o {schema}")
    typer.echo(str(path))


_ENTRIES: dict[str, Callable[[], dict[str, Any]]] = {
    "materials": catalogue.materials,
    "motors": catalogue.motors,
    "printers": catalogue.printers,
}


def _kinds() -> dict[str, Callable[[], dict[str, Any]]]:
    """Return the kinds in the order of the list, each with the function that returns its entries by name."""
    return {
        **{kind.plural: lambda kind=kind: _first_comments(shipped_of(kind)) for kind in file_kinds() if kind.plural},
        "designs": lambda: {name: design.about for name, design in designs().items()},
        **{name: lambda entries=entries: _values(entries()) for name, entries in _ENTRIES.items()},
        "tissue": lambda: _values(
            {f"{name}.{one.name}": one for name, of in catalogue.tissues().items() for one in of}
        ),
        "touch": lambda: _values(dict(catalogue.touch())),
        "rules": lambda: {code: f"{rule.severity}: {rule.title}" for code, rule in rules().items()},
    }


_RANGE = "Default: all."


def list_(
    kind: Annotated[
        str, typer.Argument(help=f"Kind to list: {', '.join(_kinds())}. Default: the kinds.", metavar="[KIND]")
    ] = "",
    soft: Annotated[
        str | None,
        typer.Option(metavar="RANGE", help=f"Silicones by static modulus, such as 10..60kPa. {_RANGE}"),
    ] = None,
    pot_life: Annotated[
        str | None, typer.Option(metavar="RANGE", help=f"Silicones by pot life, such as 20.. (min). {_RANGE}")
    ] = None,
    cure: Annotated[
        str | None, typer.Option(metavar="RANGE", help=f"Silicones by cure, such as ..5h. {_RANGE}")
    ] = None,
    diameter: Annotated[
        str | None, typer.Option(metavar="RANGE", help=f"Motors by diameter, such as 8..10 (mm). {_RANGE}")
    ] = None,
    thickness: Annotated[
        str | None, typer.Option(metavar="RANGE", help=f"Motors by thickness, such as ..2.5mm. {_RANGE}")
    ] = None,
    frequency: Annotated[
        str | None, typer.Option(metavar="RANGE", help=f"Motors by frequency, such as 150..250Hz. {_RANGE}")
    ] = None,
    bed: Annotated[
        str | None, typer.Option(metavar="RANGE", help=f"Printers by the bed's shorter side, such as 200... {_RANGE}")
    ] = None,
    where: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=RANGE", help=f"Entries by any key, such as kind=lra or density_g_cm3=..1.1. {_RANGE}"
        ),
    ] = None,
    cupboard: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Only entries that a file of what you own names, and its own. Default: all, as of a kind that it does not name.",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """List the shipped entries, each value with its source and status.

    A filter leaves out the entries that have no value for it, and names them.
    """
    short = {"soft": soft, "pot_life": pot_life, "cure": cure, "diameter": diameter, "thickness": thickness}
    wanted = {key: text for key, text in {**short, "frequency": frequency, "bed": bed}.items() if text is not None}
    for text in where or []:
        key, equals, value = text.partition("=")
        if not equals:
            raise Refusal("--where", text, "is KEY=RANGE, such as kind=lra or density_g_cm3=..1.1")
        wanted[key.strip()] = value.strip()
    kinds, filtered = _kinds(), bool(wanted or cupboard)
    if not kind:
        if filtered:
            raise Refusal("KIND", None, "is required with a filter", "materials")
        print_json({"kinds": list(kinds)}) if as_json else typer.echo("\n".join(kinds))
        return
    if kind not in kinds:
        raise unknown_name("KIND", kind, kinds)
    entries, lacking = kinds[kind](), dict[str, list[str]]()
    known = dict[str, Any]()
    if kind in _ENTRIES:
        known = held(cupboard)[kind] if cupboard else _ENTRIES[kind]()
    elif filtered:
        raise Refusal("KIND", kind, f"has no values to filter by; {', '.join(_ENTRIES)} have", "materials")
    if filtered:
        known, lacking = keep(known, wanted)
        entries = _values(known)
    if as_json:
        print_json({kind: entries, **({"without_a_value": lacking} if wanted else {})})
        return
    for name, entry in entries.items():
        if isinstance(entry, str):
            typer.echo(f"{name}\t{entry}" if entry else name)
            continue
        typer.echo(name)
        for key, value in entry.items():
            how = f"; {value['method']}" if "method" in value else ""
            bounds = _bounds(value)
            typer.echo(f"  {key} = {value['value']}{bounds}  [{value['status']}] {value['source']}{how}")
        if kind == "materials" and (note := moduli_note(known[name])):
            typer.echo(f"  moduli: {note}")
    for key, names in lacking.items():
        option = f"--{key.replace('_', '-')}" if key in SHORT else key
        typer.echo(f"left out, without a value for {option}: {some(names)}", err=True)
    if filtered and not entries:
        typer.echo(f"none of the {kind} meets it", err=True)


def _bounds(value: dict[str, Any]) -> str:
    """Return the range of a value; one end may be missing."""
    ends = [f"{value[end]:g}" if end in value else "" for end in ("low", "high")]
    if all(ends):
        return f" ({ends[0]} to {ends[1]})"
    return f" (at least {ends[0]})" if ends[0] else f" (at most {ends[1]})" if ends[1] else ""


def _values(entries: dict[str, Any]) -> dict[str, Any]:
    """Return the values of entries, each with its status and source: those of an own entry may be the defaults."""
    return {
        name: {
            key: {"value": value["value"], "status": own.status, "source": own.source, **value}
            for key, value in to_builtins(entry).items()
            if isinstance(value, dict) and (own := getattr(entry, key))
        }
        for name, entry in entries.items()
    }


def _first_comments(shipped: dict[str, Path]) -> dict[str, str]:
    lines = {name: path.read_text("utf-8").partition("\n")[0] for name, path in shipped.items()}
    return {name: line.lstrip("# ") if line.startswith("#") else "" for name, line in lines.items()}


def coupon(
    printer: Annotated[
        str,
        typer.Argument(
            metavar="PRINTER", help="A printer of the catalogue (unitcad list printers), or the cupboard's."
        ),
    ],
    read: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=VALUE|FILE",
            help="Reading of a printed coupon, such as bore_mm=7.85, or a file of readings. Default: write the coupons.",
        ),
    ] = None,
    name: Annotated[str, typer.Option(metavar="NAME", help="Name of the printer's entry of your own.")] = "mine",
    cupboard: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="File of what you own, to which --read adds the entry. Default: cupboard.toml."
        ),
    ] = None,
    out: Out = Path("out"),
    as_json: AsJson = False,
) -> None:
    """Write two coupons to print first, or turn their readings into an entry of the printer.

    The fit coupon shows the clearances, the leak coupon seal, bore, ribs, tongue and squish. The last line printed is
    the folder, or the file with the entry.
    """
    own = read_cupboard(cupboard).printers if cupboard and (cupboard.exists() or not read) else {}
    leak = LeakCoupon(printer, own)
    if read:
        _read(leak, read, name, cupboard or Path("cupboard.toml"), as_json)
        return
    folder = write(leak.printer, out)
    leak.write(folder)
    if as_json:
        fits = {
            fit.key: {"feature": fit.feature, "choose": fit.choose, "values_mm": list(fit.values_mm)}
            for fit in Coupon(leak.printer).fits.values()
        }
        gauges = {
            f"{gauge.name}_mm": {"place": gauge.place, "drawn_mm": round(gauge.drawn_mm, 4), "shows": gauge.shows}
            for gauge in leak.gauges.values()
        }
        print_json({"folder": str(folder), "printer": printer, "fits": fits, "gauges": gauges})
    else:
        typer.echo(Coupon(leak.printer).markdown())
        typer.echo(leak.markdown())
        typer.echo(str(folder))


def _read(leak: LeakCoupon, given: list[str], name: str, file: Path, as_json: bool) -> None:
    """Print the options that readings give, and add the printer's entry to a cupboard."""
    data = dict[str, Any]()
    for text in given:
        data |= changes_of([text]) if "=" in text else read_toml(Path(text))
    readings = convert(data, Readings, "readings")
    settings, advice = leak.settings(readings)
    options = leak.options(settings, name)
    if settings:
        add_entry(file, "printers", name, leak.entry(settings, readings))
    if as_json:
        values = {each.key: {"value": each.value, "why": each.why} for each in settings}
        cupboard = str(file) if settings else None
        print_json({"settings": values, "advice": advice, "options": options, "cupboard": cupboard})
        return
    for each in settings:
        typer.echo(f"{each.key} = {each.value:g}: {each.why}")
    for said in advice:
        typer.echo(said)
    if options:
        typer.echo(f"unitcad build SPEC {' '.join(options)}")
        typer.echo(f"printers.{name} is in:")
        typer.echo(str(file))
