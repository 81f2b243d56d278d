"""Values that the JSON Schemas forbid: wrong kinds, out of range, NaN, huge, empty, nested, dates."""

import copy
import datetime
import json
import random
import re
from collections import Counter

import msgspec

from unitcad import catalogue
from unitcad.spec.raw import RawSpec
from unitcad.spec.toml import text_of
from unitcad.validation import put

ENTRY = {"materials": "ecoflex-00-30", "motors": "LCM0720A3463F", "printers": "fdm-0.4"}
"""The free tables of a spec, and what an entry of each starts from."""
NUMBERS = (float("nan"), float("inf"), -float("inf"), -1e308, 1e308, -(10**30), 10**400)
WORDS = ("", "wörd", "\u202e\u0000", "\ud800", "-1", "nan", "x" * 5000, "a.b[0]`$")
OTHERS = (datetime.date(1979, 5, 27), datetime.datetime(1979, 5, 27, 7, 32), datetime.time(7, 32), True, [], {}, [[1]])

"""A dotted path and a value that its schema forbids."""


def bad_values(kind=RawSpec):
    """Every forbidden value for every path of a spec or of another kind of file, in the schema's order."""
    schema = msgspec.json.schema(kind)
    return list(_bad(schema, schema, ""))


def with_value(data, path, value):
    """A spec's data with a value put in, entries of the catalogue being whole but for it."""
    changed = copy.deepcopy(data)
    table, name, *rest = [*path.split("."), ""]
    if table in ENTRY and name == "ours" and rest[:-1]:
        changed[table] = {"ours": {"like": ENTRY[table]}}
        if len(rest) > 2 and rest[1] != "value":
            shipped = [getattr(entry, rest[0]) for entry in getattr(catalogue, table)().values()]
            unshipped = "none" if rest[0] == "support" else 0.5
            changed[table]["ours"][rest[0]] = {"value": next((value.value for value in shipped if value), unshipped)}
    put(changed, path, value)
    return changed


def toml(data):
    """Data as TOML, dates too."""

    def marked(node):
        if isinstance(node, dict):
            return {key: marked(below) for key, below in node.items()}
        if isinstance(node, list):
            return [marked(below) for below in node]
        return f"@@{node.isoformat()}@@" if isinstance(node, datetime.date | datetime.time) else node

    return re.sub('"@@(.*?)@@"', r"\1", text_of(marked(data)))


def sample(count, seed):
    """`count` of a spec's, drawn from a seed; no path has another one before every path has one."""
    found, met = bad_values(), Counter()
    random.Random(seed).shuffle(found)
    turns = []
    for path, _ in found:
        turns.append(met[path])
        met[path] += 1
    return [case for _, case in sorted(zip(turns, found, strict=True), key=lambda pair: pair[0])][:count]


def _bad(node, schema, path):
    members = [_followed(member, schema) for member in node.get("anyOf", [node])]
    members = [member for member in members if member.get("type") != "null"]
    if path:
        for value in _candidates(members):
            if not any(_allows(member, value) for member in members):
                yield path, value
    for member in members:
        yield from _below(member, schema, path)


def _below(member, schema, path):
    prefix = f"{path}." if path else ""
    for name, below in member.get("properties", {}).items():
        yield from _bad(below, schema, f"{prefix}{name}")
    if member.get("type") == "object" and member.get("additionalProperties") is False:
        yield f"{prefix}nonesuch", 1
    items = member.get("items")
    for i, below in enumerate(member.get("prefixItems", [items] if isinstance(items, dict) else [])):
        yield from _bad(below, schema, f"{prefix}{i}")
    free = member.get("additionalProperties")
    if isinstance(free, dict) and free:
        yield from _bad(free, schema, f"{prefix}ours")


def _candidates(members):
    yield from NUMBERS
    yield from WORDS
    yield from OTHERS
    yield from (0, 1.5, [1, 2, 3, 4], ["x"], {"nonesuch": 1}, _nested(50))
    for member in members:
        for end, beyond in (("minimum", -1), ("maximum", 1)):
            if end in member:
                limit = member[end]
                yield from (limit + beyond, limit + beyond * 1e-6 * max(1.0, abs(limit)), beyond * 5e-324)


def _allows(member, value):
    """Whether a member of a schema takes a value, as far as it goes without looking into tables and lists."""
    if "enum" in member:
        return value in member["enum"] and not isinstance(value, bool)
    kind = member.get("type")
    if kind is None:
        return not _never(value)
    if kind == "boolean":
        return isinstance(value, bool)
    if kind in ("number", "integer"):
        if isinstance(value, bool) or not isinstance(value, int | float):
            return False
        if abs(value) >= 1e19 or value != value or (kind == "integer" and isinstance(value, float)):
            return False
        return member.get("minimum", value) <= value <= member.get("maximum", value)
    if kind == "string":
        return isinstance(value, str) and member.get("minLength", 0) <= len(value) <= member.get("maxLength", 10**6)
    if kind == "array":
        if not isinstance(value, list):
            return False
        if not member.get("minItems", 0) <= len(value) <= member.get("maxItems", 10**6):
            return False
        return not value
    return isinstance(value, dict) and not value and not member.get("required") and not member.get("minProperties")


def _never(value):
    """Whether no key at all takes it."""
    try:
        json.dumps(value, allow_nan=False)
    except (TypeError, ValueError):
        return True
    return False


def _nested(depth):
    return {"a": _nested(depth - 1)} if depth else 1


def _followed(node, schema):
    return schema["$defs"][node["$ref"].removeprefix("#/$defs/")] if "$ref" in node else node
