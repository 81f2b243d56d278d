"""Names that would be markup, code, orders to a terminal or formulas, through every output; none is more than text."""

import csv
import io
import itertools
import json
import re
import unicodedata
import xml.etree.ElementTree as ElementTree
import zipfile
from random import Random

import chromium
import numpy as np
import pytest
from markdown_it import MarkdownIt
from typer.testing import CliRunner

from unitcad import text
from unitcad.cache import MemoryStore
from unitcad.cli import app
from unitcad.cli.output import say_error
from unitcad.errors import Refusal, UnitcadError
from unitcad.export import chart, printing
from unitcad.pipeline.write import build
from unitcad.report import write_report
from unitcad.spec import to_toml
from unitcad.validation import from_data, read

SHOWN = [
    "<script>window.hit=1</script>",
    "</script><script>window.hit=2</script>",
    "</title><img src=x onerror=window.hit=3>",
    "<svg/onload=window.hit=4>",
    "<a href='javascript:window.hit=5'>x</a>",
    "<!-- <b> --> ]]> <![CDATA[",
    "javascript:window.hit=6",
    "[click](javascript:window.hit=7)",
    "![x](http://127.0.0.1:9/x.png)",
    "<http://127.0.0.1:9/>",
    "`code` *bold* _italic_ ~~struck~~ | cell | cell",
    "# heading",
    "- item",
    "{{7*7}} ${7*7} #{7*7} <%= 7*7 %> {% raw %}",
    "'\"` \\\" \\' &quot; &#60;script&#62;",
    "=cmd|'/c calc'!A0",
    "+1+1",
    "@SUM(1)",
    "CON",
    "nul.txt",
    "../../etc/passwd",
    "..\\..\\x",
    "[red]x[/red] [/] [link=http://127.0.0.1:9/]y",
    ":smile: %s %n %x {0} {0.__class__}",
    "שלום عليكم",
    "é日本🙂",
    "x" * 120,
    "\\X2\\0000\\X0\\ \\",
]
"""Names that are shown as they are."""
REFUSED = [
    "a\0b",
    "\x1b[31mred\x1b[0m",
    "\x1b]8;;http://127.0.0.1:9/\x1b\\x\x1b]8;;\x1b\\",
    "a\x07\x08\x7f",
    "a\x9b2Jb",
    "line\nline",
    "tab\ttab",
    "\r\rover",
    "gnp.\u202etxt.exe",
    "\u2066hidden\u2069",
    "a\u2028b",
    "\ufeffa",
    "a\ud800b",
    "a\ufffeb",
    "a\U000e0041b",
]
"""Names with characters that deceive."""


def _spec(name):
    """A spec in which variant, material and source have that name."""
    data = read("single-embedded")
    data |= {"name": name, "output": {"formats": []}}
    entry = {"like": "ecoflex-00-30", "youngs_modulus_kpa": {"value": 48.0, "low": 40.0, "high": 56.0, "source": name}}
    data["materials"] = {name: entry}
    data["layers"][0]["material"] = name
    return from_data(data)


def _random_names(seed, count):
    """Names put together from pieces of the others."""
    random = Random(seed)
    pieces = [piece for name in SHOWN for piece in re.findall(r"\w+|\W", name)]
    made = ["".join(random.choices(pieces, k=random.randint(1, 30)))[:100] for _ in range(count)]
    return [name if name.strip() else f"{name}x" for name in made]


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """A variant of each name."""
    return _built(SHOWN, tmp_path_factory.mktemp("names"))


def _built(names, out):
    asked = {"only": ["unit", "casting", "estimate"], "check": False, "store": MemoryStore()}
    return {name: build(_spec(name), out, **asked).folder for name in names}


@pytest.mark.parametrize("name", REFUSED)
@pytest.mark.parametrize("place", ["name", "key", "material", "parameter", "unknown"])
def test_a_name_that_deceives_is_refused_with_its_field(name, place, capsys):
    data = read("single-embedded")
    if place == "name":
        data["name"] = name
    elif place == "key":
        data["materials"] = {name: {"like": "ecoflex-00-30"}}
    elif place == "material":
        data["layers"][0]["material"] = name
    elif place == "parameter":
        data["parameters"] = {"x": name}
    else:
        data[name] = 1
    with pytest.raises(Refusal) as refused:
        from_data(data)
    fields = {"name": "name", "material": "layers.0.material", "parameter": "parameters.x"}
    assert refused.value.field == fields.get(place, refused.value.field)
    assert text.invisible(str(refused.value)) is None
    say_error(refused.value, "text")
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert all(unicodedata.category(c) != "Cc" for c in said.removesuffix("\n"))
    if place == "name":
        assert from_data({**data, "name": refused.value.nearest}).name == refused.value.nearest


@pytest.mark.parametrize("name", REFUSED)
def test_an_error_about_a_file_or_from_a_design_is_no_order_to_the_terminal(name, capsys):
    say_error(UnitcadError(f"{name}: no such file"), "text")
    assert text.invisible(capsys.readouterr().err.removesuffix("\n")) is None


def _judge(name, folder):
    """Whether a name is text in each of a variant's files."""
    manifest = json.loads((folder / "manifest.json").read_text("utf-8"))
    assert manifest["name"] == name
    assert re.fullmatch(r"[a-z0-9-]+(\.[0-9][a-z0-9-]*)*-[0-9a-f]{12}", folder.name)
    tokens = MarkdownIt("commonmark", {"html": True}).enable("table").parse((folder / "casting.md").read_text("utf-8"))
    fold = {"<details>\n<summary>Drawings</summary>\n", "</details>\n"}
    tokens = [token for token in tokens if token.type != "html_block" or token.content not in fold]
    spans = [child for token in tokens for child in token.children or [token]]
    assert not {"html_block", "html_inline", "link_open", "code_inline", "em_open"} & {token.type for token in spans}
    steps = {path for path in manifest["files"] if path.startswith("steps/")}
    assert {str(token.attrs["src"]) for token in spans if token.type == "image"} == {"step1-section.svg", *steps}
    heads = [_shown(after) for token, after in itertools.pairwise(tokens) if token.tag == "h1" and token.nesting == 1]
    assert heads == [_once_spaced(f"Casting {name}")]
    part = _once_spaced(f"silicone {name}:")  # no line begins with a name: "# name" would be a heading
    assert any(_shown(token).startswith(part) for token in tokens if token.type == "inline")
    for row in csv.reader(io.StringIO((folder / "bom.csv").read_text("utf-8"))):
        assert len(row) == 5
        assert not any(value[:1] in tuple("=+@\t\r") for value in row)
    for file in folder.rglob("*.svg"):
        tags = {element.tag.rpartition("}")[2] for element in ElementTree.parse(file).iter()}
        assert not tags & {"script", "foreignObject", "image", "a", "use", "iframe"}


def _shown(token):
    """Return what a reader of rendered Markdown sees."""
    return _once_spaced("".join(child.content for child in token.children or [] if child.type != "softbreak"))


def _once_spaced(text):
    """Return a text as HTML shows it: runs of spaces as one, none at the ends."""
    return " ".join(text.split())


@pytest.mark.parametrize("name", SHOWN)
def test_a_name_is_text_in_every_file(name, folders):
    _judge(name, folders[name])


@pytest.mark.long
@pytest.mark.parametrize("seed", range(20))
def test_names_put_together_at_random_are_text_in_every_file(seed, tmp_path):
    for name, folder in _built(_random_names(seed, 10), tmp_path).items():
        _judge(name, folder)


@pytest.mark.parametrize("name", SHOWN)
def test_a_bodys_name_is_text_in_meshes_and_drawings(name):
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32)
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    with zipfile.ZipFile(
        io.BytesIO(printing.content([printing.MeshPart(name, (0.1, 0.2, 0.3), vertices, faces)]))
    ) as made:
        model = ElementTree.fromstring(made.read("3D/3dmodel.model"))
    objects = [element.get("name") for element in model.iter() if element.tag.endswith("}object")]
    assert objects == [name]
    marked = chart.text(0.0, 0.0, name)
    assert ElementTree.fromstring(marked).text == name


@pytest.mark.smoke
def test_a_page_of_all_names_runs_no_script_and_asks_for_nothing(folders, browser):
    root = next(iter(folders.values())).parent
    page = write_report(root)
    for name in ["", *SHOWN[:4]]:
        visit = chromium.Visit(browser, page, fragment=folders[name].name if name else "")
        visit.page.on("dialog", lambda dialog, errors=visit.errors: errors.append(dialog.message))
        visit.page.wait_for_timeout(100)
        asked = [url.partition("#")[0] for url in visit.requests if not url.startswith(("data:", "blob:"))]
        assert asked == [page.resolve().as_uri()]
        assert visit.page.evaluate("window.hit") is None
        shown = visit.page.inner_text("main")
        assert all(" ".join(each.split()) in " ".join(shown.split()) for each in ([name] if name else SHOWN))
        if name:
            assert visit.page.title() == name
        visit.close()


def test_a_terminal_gets_names_as_text(tmp_path):
    for name in SHOWN[::7]:
        file = tmp_path / "a.toml"
        file.write_text(to_toml(_spec(name)), "utf-8")
        done = CliRunner().invoke(app, ["estimate", str(file)], env={"COLUMNS": "400", "TERM": "dumb"})
        assert done.exception is None
        assert name in done.stdout
        assert "\x1b" not in done.stdout
