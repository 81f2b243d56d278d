"""Names of mesh files that would be markup, orders to a terminal or workflow commands, through every output."""

import json
import re
import sys
import xml.etree.ElementTree as ElementTree
from random import Random
from urllib.parse import unquote_to_bytes

import pytest

from unitcad import text
from unitcad.export import finding_pictures
from unitcad.meshcheck import check_file
from unitcad.meshcheck.findings import FileReport, Finding, Location
from unitcad.meshcheck.output import render

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such names")
OPEN = "v 0 0 0\nv 9 0 0\nv 0 9 0\nv 0 0 9\nf 1 3 2\nf 1 2 4\nf 2 3 4\n"
NAMES = [
    "::error file=x::boo", "a\n::error::boo", "a\r\n::set-output name=x::y", "##[error]x", "a%0A::error::x",
    "a,line=3::x", "\x1b[31mred\x1b[0m", "\x1b]8;;x\x07", "a\x9b2Jb", "tab\tbell\x07", "gnp.\u202elts", "a\u2028b",
    "\ufeffa", "\udce4\udcff", "<script>x<script>", "\"><x y='", "]]><!--", "&amp;&#60;", "[red]x[red]", "{{7*7}}${x}",
    "#?%20 a b", "-rf", "--pictures", "*?[x]", "C:\\x", "..", "é日本🙂", "'; drop", "$(x)`x`", "a|b;c&d",
]  # fmt: skip
_PIECES = [piece for name in NAMES for piece in re.findall(r"\w+|\W", name)]


def random_names(seed, count):
    """Names put together from pieces of the others."""
    random = Random(seed)
    return ["".join(random.choices(_PIECES, k=random.randint(1, 25)))[:60].replace("/", "_") for _ in range(count)]


def judge(folder, name):
    """Whether a file's name is text in each format and in a picture's name."""
    path = folder / f"{name}.obj"
    path.write_text(OPEN)
    report = check_file(path)
    assert report.has("T001")
    place = Location(face=1, xyz=(1.0, 2.0, 3.0), object=name, part=name)
    said = FileReport(
        str(path), (*report.findings, Finding("P017", "warning", f"says {name}", 1, (place,))), report.facts
    )
    lines = render([said], "text").splitlines()
    assert len(lines) == len(said.findings) + 5
    assert all(text.invisible(line) is None for line in lines)
    commands = render([said], "github").split("\n")
    assert [line.startswith("::") for line in commands] == [True] * len(said.findings) + [False, False]
    for line in commands[: len(said.findings)]:
        assert "\r" not in line
        assert "\x1b" not in line
        head = line.removeprefix("::").partition("::")[0]
        assert re.fullmatch(r"(error|warning) file=[^,:]*(,line=\d+)?,title=[^,:]*", head, re.DOTALL), line
    suite = ElementTree.fromstring(render([said], "junit").encode("utf-8", "replace"))
    assert {element.tag for element in suite.iter()} <= {"testsuites", "testsuite", "testcase", "failure", "system-out"}
    shown = json.loads(render([said], "json").encode("utf-8"))["files"][0]["path"]
    assert shown == str(path) or not str(path).isprintable()
    for result in json.loads(render([said], "sarif"))["runs"][0]["results"]:
        uri = result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"]
        assert re.fullmatch(r"file:///[A-Za-z0-9._~/!$&'()*+,;=:@%-]+", uri)
        assert unquote_to_bytes(uri.removeprefix("file://")) == bytes(path)
    assert re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]*", finding_pictures.folder_name(str(path)))
    path.unlink()


@pytest.mark.parametrize("name", NAMES, ids=ascii)
def test_a_name_is_text_in_every_output(tmp_path, name):
    judge(tmp_path, name)


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.long) for seed in range(1, 20))])
def test_names_put_together_at_random_are_text(tmp_path, seed):
    for name in random_names(seed, 20):
        judge(tmp_path, name)
