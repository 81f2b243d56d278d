"""Results as a damaged disk or somebody who means harm would leave them: what is done to one variant's folder."""

import json
import os

SECRET = "the-secret-of-another-folder"


def _linked(name, outside="secret.svg"):
    def spoil(folder):
        (folder / name).unlink(missing_ok=True)
        (folder / name).symlink_to(folder.parent.parent / "outside" / outside)

    return spoil


def _piped(name):
    def spoil(folder):
        (folder / name).unlink(missing_ok=True)
        os.mkfifo(folder / name)

    return spoil


def _written(name, content):
    def spoil(folder):
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())

    return spoil


def _torn(name):
    def spoil(folder):
        content = (folder / name).read_bytes()
        (folder / name).write_bytes(content[: len(content) // 2])

    return spoil


def _said(file, /, **values):
    """The file with other values."""

    def spoil(folder):
        (folder / file).write_text(json.dumps({**json.loads((folder / file).read_text()), **values}))

    return spoil


def _with_number(file, number):
    """The file with a number as Python would not write it."""

    def spoil(folder):
        (folder / file).write_text((folder / file).read_text().replace("{", f'{{"more": {number},', 1))

    return spoil


def _device(name):
    def spoil(folder):
        (folder / name).unlink()
        (folder / name).symlink_to("/dev/zero")

    return spoil


def _large(name, size=40_000_000):
    def spoil(folder):
        with open(folder / name, "wb") as file:
            file.truncate(size)

    return spoil


def _folder_link(folder):
    (folder / "more").symlink_to(folder.parent.parent / "outside")


def _loop(folder):
    (folder / "again").symlink_to(folder)
    (folder / "turn.svg").symlink_to("turn.svg")


def _many(folder):
    (folder / "many").mkdir()
    for i in range(2500):
        (folder / "many" / f"{i}.txt").touch()


def _deep(folder):
    here = folder
    for _ in range(300):
        here = here / "d"
        here.mkdir()
    (here / "deep.svg").write_text("<svg/>")


def _code(folder):
    text = (folder / "spec.toml").read_text()
    source = json.dumps(f"open({str(folder.parent.parent / 'RAN')!r}, 'w')\ndef f(spec): pass\n")
    text = text.replace('design = "single-embedded"', "").replace('design = "embedded"', 'design = "d.py:f"')
    (folder / "spec.toml").write_text(f"design_source = {source}\n{text}")


def _odd_names(folder):
    for name in (b"\xff\xfe.svg", b"<img src=x onerror=alert(1)>.svg", b"\x1b[31m.txt", "‮gnp.txt".encode(), b"a\nb"):
        with open(os.path.join(os.fsencode(folder), name), "wb") as file:
            file.write(b"<svg xmlns='http://www.w3.org/2000/svg'/>")


SVG = (
    '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" width="9" height="9">'
    "<script>alert(1)</script><image href='http://127.0.0.1:9/x.png'/><image xlink:href='file:///etc/passwd'/>"
    "<foreignObject><iframe xmlns='http://www.w3.org/1999/xhtml' src='http://127.0.0.1:9/'/></foreignObject>"
    "<style>@import url(http://127.0.0.1:9/x.css)</style><rect width='9' height='9' onload='alert(2)'/></svg>"
)
SCRIPT = "</script><script>window.hit=1</script><img src=x onerror=window.hit=2>"

KINDS = {
    "section.svg is a link out": (_linked("section.svg"), True),
    "another drawing is a link out": (_linked("x.svg"), True),
    "a folder is a link out": (_folder_link, True),
    "links in a circle": (_loop, True),
    "manifest.json is a link out": (_linked("manifest.json", "secret.json"), False),
    "spec.toml is a link out": (_linked("spec.toml", "secret.toml"), True),
    "estimate.json is a link out": (_linked("estimate.json", "secret.json"), True),
    "manifest.json is a pipe": (_piped("manifest.json"), False),
    "estimate.json is a pipe": (_piped("estimate.json"), True),
    "spec.toml is a pipe": (_piped("spec.toml"), True),
    "a drawing is a pipe": (_piped("y.svg"), True),
    "manifest.json is a device": (_device("manifest.json"), False),
    "manifest.json is too large": (_large("manifest.json"), False),
    "a drawing is too large": (_large("section.svg"), True),
    "manifest.json is torn": (_torn("manifest.json"), False),
    "manifest.json is empty": (_written("manifest.json", ""), False),
    "manifest.json is a list": (_written("manifest.json", "[1, 2]"), False),
    "manifest.json is not UTF-8": (_written("manifest.json", b"\xff\xfe{}"), False),
    "manifest.json is deep": (_written("manifest.json", '{"a": ' + "[" * 900 + "]" * 900 + "}"), False),
    "parts are numbers": (_said("manifest.json", parts=[1, 2], mould_checks=5), False),
    "mould checks are of a wrong type": (_said("manifest.json", mould_checks=[{"code": 5, "ok": "yes"}]), False),
    "numbers are huge": (_with_number("manifest.json", "1e999"), False),
    "numbers have 5,000 digits": (_with_number("manifest.json", "9" * 5000), False),
    "numbers are NaN": (_said("manifest.json", air_ring_mm=float("nan")), False),
    "a key is the page's own": (_said("manifest.json", warnings=[], extra={"\0": 0}), False),
    "estimate.json is torn": (_torn("estimate.json"), True),
    "estimate.json is of wrong types": (_written("estimate.json", '{"models": [5], "layered": {"r_mm": "x"}}'), True),
    "casting.json is of wrong types": (_written("casting.json", '{"pours": 7, "bill": {"a": 1}}'), True),
    "spec.toml has code": (_code, True),
    "spec.toml is torn": (_torn("spec.toml"), True),
    "names hold markup": (_said("manifest.json", name=SCRIPT, label=SCRIPT, warnings=[SCRIPT], design=SCRIPT), True),
    "names hold half characters": (_said("manifest.json", name="\ud800", warnings=["‮\x1b[2J"]), False),
    "drawings hold scripts": (_written("section.svg", SVG), True),
    "files have odd names": (_odd_names, True),
    "files are many": (_many, True),
    "folders are deep": (_deep, True),
}
"""What is done to a folder, and whether its variant is still shown (else it is listed as damaged)."""


def outside(folder):
    """What no page may hold."""
    folder.mkdir()
    (folder / "secret.svg").write_text(f"<svg xmlns='http://www.w3.org/2000/svg'><text>{SECRET}</text></svg>")
    (folder / "secret.json").write_text(json.dumps({"name": SECRET, "warnings": [SECRET]}))
    (folder / "secret.toml").write_text(f'name = "{SECRET}"\n')
