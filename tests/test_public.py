"""What `import unitcad` offers: lazily, typed, documented, short to print, and with a file's sentences."""

import base64
import doctest
import inspect
import json
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import manifold3d
import numpy as np
import pytest
import tomli_w
import trimesh
import typed_use

import unitcad
from unitcad import attenuation
from unitcad.catalogue import entries
from unitcad.errors import Refusal, UnitcadError
from unitcad.spec.raw import RawSpec

LAYERS = [
    {"material": "ecoflex-00-10", "wall_mm": 1.25, "cap_mm": 1.0},
    {"material": "dragon-skin-30", "wall_mm": 1.25, "cap_mm": 1.0},
]
UNIT = {"name": "unit", "design": "encapsulating", "diameter_mm": 14.0, "layers": LAYERS}


def _run(code):
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip()


PUBLIC = {f"unitcad.{name}": getattr(unitcad, name) for name in unitcad.__all__} | {
    f"unitcad.attenuation.{name}": getattr(attenuation, name)
    for name in attenuation.__all__
    if isinstance(getattr(attenuation, name), type)  # Damping and Load are unions of the others
}


def _sections(text):
    """The sections of a numpydoc docstring by title."""
    parts = re.split(r"(?m)^(\w[\w ]*)\n-+\n", inspect.cleandoc(text))
    return dict(zip(parts[1::2], parts[2::2], strict=True))


@pytest.mark.parametrize("name", PUBLIC)
def test_a_public_name_is_documented_with_an_example_that_runs(name):
    value = PUBLIC[name]
    sections = _sections(value.__doc__)
    assert ">>> " in sections["Examples"]
    if inspect.isfunction(value):
        assert {"Returns", "Examples"} <= set(sections)
        assert "Raises" in sections or name == "unitcad.templates"
    # A class documents its parameters; a result, which only functions make, its attributes.
    result = isinstance(value, type) and name.endswith(("Result", "EdgeEstimate", "Response", "UnitcadError"))
    if not inspect.ismodule(value) and not result:
        listed = re.findall(r"(?m)^([*\w][\w, *]*?)(?: :.*)?$", sections.get("Parameters", ""))
        documented = {part.strip(" *") for line in listed for part in line.split(",")}
        asked = set(inspect.signature(value).parameters) - {"self"}
        assert asked <= documented, asked - documented
    parser, runner = doctest.DocTestParser(), doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    runner.run(parser.get_doctest(sections["Examples"], {}, name, None, 0))
    assert runner.tries
    assert not runner.failures


LOADED = {
    "import unitcad": {"unitcad."},
    "assert [name for name in dir(unitcad) if not name.startswith('__')] == unitcad.__all__": {"unitcad."},
    "unitcad.Spec, unitcad.Layer, unitcad.materials()": {"numpy", "scipy", "manifold3d", "trimesh", "OCP"},
    "unitcad.load('encapsulating')": {"scipy", "trimesh", "OCP"},
}
"""One after the other in a process: beginnings of modules that are not loaded yet."""


def test_no_more_is_loaded_than_is_used():
    code = "import sys\n"
    for use, needless in LOADED.items():
        loaded = f"[name for name in sys.modules if name.startswith({tuple(needless)})]"
        code += f"{use}\nassert not (loaded := {loaded}), ({use!r}, loaded)\n"
    _run(code)


def test_names_places_and_types_agree():
    text = Path(unitcad.__file__).read_text("utf-8")
    typed = text.partition("if TYPE_CHECKING:")[2].partition("__version__")[0]
    names = [line.rpartition(" as ")[2] for line in typed.splitlines() if " as " in line]
    assert sorted(names) == sorted(unitcad.__all__) == sorted(unitcad._PLACES)
    with pytest.raises(AttributeError, match="no attribute 'bild'"):
        unitcad.bild  # type: ignore[attr-defined]  # noqa: B018


def test_signatures_are_those_of_a_file():
    keys = inspect.signature(unitcad.Spec).parameters
    assert list(keys) == list(RawSpec.__struct_fields__)
    required = [name for name, key in keys.items() if key.default is key.empty]
    assert required == ["name", "design", "diameter_mm", "layers"]
    assert list(inspect.signature(unitcad.check).parameters)[:2] == ["files", "printer"]


def test_the_typed_material_is_the_one_that_a_spec_takes():
    text = inspect.getsource(entries).partition("class MaterialEntry")[2].partition("class MotorEntry")[0]
    typed = [line.split(":")[0].strip() for line in text.splitlines() if "= None" in line]
    assert typed == list(unitcad.Material.__struct_fields__)


def test_what_is_typed_runs(tmp_path):
    assert typed_use.silicones()["ecoflex-00-10"] == 1.04
    volume, first, level = typed_use.use(tmp_path)
    assert volume > 0
    assert first.verdict == "pass"
    assert level is not None
    assert 0 < level < 1


BAD = [
    {"diameter_mm": 3.0},
    {"diameter_mm": float("inf")},
    {"layers": []},
    {"layers": [{**LAYERS[0], "wall_mm": 0.1}, LAYERS[1]]},
    {"layers": [{**LAYERS[0], "material": "ecoflx"}, LAYERS[1]]},
    {"desing": "embedded"},
    {"moulds": {"cavities": [2, 0]}},
    {"materials": {"mine": {"like": "ecoflex"}}},
    {"name": "a\u202eb"},
]


@pytest.mark.parametrize("wrong", BAD, ids=lambda wrong: json.dumps(wrong)[:40])
def test_a_spec_is_refused_with_the_sentence_of_its_file(wrong, tmp_path):
    data = {**UNIT, **wrong}
    file = tmp_path / "unit.toml"
    file.write_text(tomli_w.dumps(data), "utf-8")
    with pytest.raises(Refusal) as of_file:
        unitcad.load(file)
    for source in (lambda: unitcad.Spec(**data), lambda: unitcad.load(data), lambda: unitcad.load(UNIT, set=wrong)):
        with pytest.raises(Refusal) as typed:
            source()
        told = of_file.value.as_dict()
        for one in (told, *told.get("others", ())):
            assert (one.pop("file"), one.pop("line") > 0) == (str(file), True)
        if "others" not in typed.value.as_dict():  # of a class's keys the first fault is told
            told.pop("others", None)
        assert typed.value.as_dict() == told


@pytest.mark.parametrize("missing", UNIT)
def test_a_missing_key_is_refused_as_in_a_file(missing):
    data = {key: value for key, value in UNIT.items() if key != missing}
    with pytest.raises(Refusal, match=f"^{missing}: is required$"):
        unitcad.Spec(**data)


@pytest.mark.parametrize("wrong", [object(), 1j, np.ones(3), {1, 2}, b"wide"], ids=lambda wrong: type(wrong).__name__)
def test_what_no_file_holds_is_refused_with_its_field(wrong):
    with pytest.raises(Refusal, match=r"^diameter_mm: takes no"):
        unitcad.Spec(**{**UNIT, "diameter_mm": wrong})


def test_a_spec_of_classes_is_that_of_the_file(tmp_path):
    typed = typed_use.typed_spec()
    data = {
        "name": "typed",
        "design": "encapsulating",
        "diameter_mm": 15,
        "layers": [{**LAYERS[0], "material": "soft"}, LAYERS[1]],
        "motor": {"part": "LCM0720A3463F", "fill": True},
        "fpcb": {"tail": "both"},
        "moulds": {"printer": "sla"},
        "materials": {"soft": {"like": "ecoflex-00-10", "density_g_cm3": 1.05}},
    }
    file = tmp_path / "typed.toml"
    file.write_text(tomli_w.dumps(data), "utf-8")
    assert typed == unitcad.load(file)
    assert isinstance(typed, unitcad.Spec)


@pytest.mark.parametrize("name", ["encapsulating", "embedded"])
def test_a_changed_spec_is_the_changed_file(name):
    for change in ({"diameter_mm": 16.0}, {"moulds.printer": "sla"}, {"motor.fill": True}, {"fpcb.tail_width_mm": 3.5}):
        assert unitcad.load(unitcad.load(name), set=change) == unitcad.load(name, set=change)
    assert unitcad.load(name, set="diameter_mm=16") == unitcad.load(name, set={"diameter_mm": np.float64(16)})
    pinned = unitcad.load(name, set={"moulds.bed_x_mm": 150.0})
    changed = unitcad.load(pinned, set={"moulds.printer": "sla"})
    assert changed.moulds.bed_x_mm == 150.0


def test_a_spec_is_frozen():
    with pytest.raises(AttributeError):
        unitcad.load("encapsulating").diameter_mm = 15.0  # type: ignore[misc]


def test_meshes_are_handed_out_in_both_libraries():
    variant = unitcad.Variant(unitcad.Spec(**UNIT))
    solid, mesh = variant.mesh("layer1"), variant.mesh("layer1", "trimesh")
    assert isinstance(solid, manifold3d.Manifold)
    assert isinstance(mesh, trimesh.Trimesh)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(solid.volume(), rel=1e-12)
    assert variant.mesh(variant.bodies["cup1"]).volume() == variant.mesh("cup1").volume()
    with pytest.raises(Refusal, match="body = 'layer3': unknown name; closest: layer2, layer1"):
        variant.mesh("layer3")
    with pytest.raises(Refusal, match="library = 'open3d': unknown name"):
        variant.mesh("layer1", "open3d")  # type: ignore[call-overload]
    with pytest.raises(Refusal, match="body = 1: takes a body's name or a Body"):
        variant.mesh(1)  # type: ignore[call-overload]
    with pytest.raises(UnitcadError, match="Variant takes a Spec, not str"):
        unitcad.Variant("encapsulating")  # type: ignore[arg-type]


class _Tags(HTMLParser):
    """Start tags and attributes; raises for an end tag that ends nothing."""

    def __init__(self):
        super().__init__()
        self.open, self.seen, self.images = list[str](), set[str](), list[str]()
        self.sandboxes = list[str | None]()

    def handle_starttag(self, tag, attrs):
        self.seen |= {tag, *(name for name, _ in attrs)}
        self.images += [value or "" for name, value in attrs if name == "src"]
        self.sandboxes += [dict(attrs).get("sandbox") for _ in [tag] if tag == "iframe"]
        if tag != "img":
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def _shown(tmp_path):
    hostile = {**UNIT, "name": "<script>alert(1)</script>&" + "long" * 22}
    spec = unitcad.Spec(**hostile)
    good, bad = tmp_path / "<b>good.stl", tmp_path / "bad.stl"
    trimesh.creation.box((9, 9, 9)).export(good)
    bad.write_text("solid x\nfacet\n")
    return [
        spec,
        unitcad.Variant(spec),
        unitcad.estimate(spec),
        unitcad.build(spec, tmp_path / "out", only=["unit"], formats=["stl"]),
        unitcad.check(good, bad, tmp_path / "missing.stl"),
    ]


def check_shown(value):
    """Check that a result is short to print, and that its table is whole and holds no script."""
    assert len(repr(value)) <= 200
    assert "\n" not in repr(value)
    assert len(max(map(repr, getattr(value, "reports", ())), key=len, default="")) <= 200
    tags = _Tags()
    tags.feed(value._repr_html_())
    tags.close()
    assert tags.open == []
    frame = {"iframe", "title", "sandbox", "style", "srcdoc"}
    assert tags.seen <= {"table", "caption", "tr", "th", "td", "img", "src", "alt"} | frame
    # The 3D view may run programs, in a frame that neither the notebook nor any address can be reached from.
    assert tags.sandboxes in ([], ["allow-scripts"])
    for image in tags.images:
        kind, _, content = image.partition(",")
        assert kind == "data:image/svg+xml;base64"
        svg = base64.b64decode(content).decode()
        assert svg.startswith("<svg")
        assert "<script" not in svg


def test_reprs_are_short_and_html_holds_no_script(tmp_path):
    for value in _shown(tmp_path):
        check_shown(value)
    assert repr(unitcad.load("encapsulating")) == (
        "Spec('encapsulating': encapsulating, 14 mm, ecoflex-00-10 1.25 / dragon-skin-30 1.25)"
    )


def test_arguments_that_can_not_be_are_refused(tmp_path):
    with pytest.raises(Refusal, match="printer = 'fdm': unknown name"):
        unitcad.check("a.stl", printer="fdm")
    with pytest.raises(Refusal, match="unit = 'yard': unknown name"):
        unitcad.check("a.stl", unit="yard")
    with pytest.raises(Refusal, match=r"timeout = 0: must be a number from 0\.001"):
        unitcad.check("a.stl", timeout=0)
    with pytest.raises(UnitcadError, match="check needs a file, a folder or a glob"):
        unitcad.check()
    with pytest.raises(Refusal, match=r"estimate\.frequency_hz = 9000: must be at most 5000"):
        unitcad.estimate("encapsulating", frequency_hz=9000)
    with pytest.raises(Refusal, match=r"estimate\.models\.0 = 'own': unknown name"):
        unitcad.estimate("encapsulating", models=["own"])  # type: ignore[list-item]
    with pytest.raises(Refusal, match=r"formats = 'stp': unknown name"):
        unitcad.build("encapsulating", tmp_path, formats=["stp"])  # type: ignore[list-item]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: unitcad.load(3), r"^int is no spec: name a template or a file, or give a dict"),  # type: ignore[arg-type]
        (lambda: unitcad.load("encapsulating", set=3), "^set takes a dict by path or texts"),  # type: ignore[arg-type]
        (lambda: unitcad.load("encapsulating", set=[3]), "^set takes .*, not int$"),  # type: ignore[list-item]
        (lambda: unitcad.Spec("encapsulating"), "^Spec takes its keys by name"),  # type: ignore[call-arg]
        (lambda: unitcad.load("encapsulatin"), "^spec = 'encapsulatin': unknown name"),
        (lambda: unitcad.load("encapsulating", set="x"), "^set = 'x': needs the form path=value"),
        (lambda: unitcad.build("embedded", 3), "^out = 3: takes a path, not int$"),  # type: ignore[arg-type]
        (lambda: unitcad.build("embedded", only="units"), "^only = 'units': unknown name"),
        (lambda: unitcad.build("embedded", only=[3]), "^only = 3: takes a text or a list of"),  # type: ignore[list-item]
        (lambda: unitcad.estimate("embedded", models=3), "^models = 3: takes a text or"),  # type: ignore[arg-type]
        (lambda: unitcad.check("a.stl", jobs="2"), "^jobs = '2': must be a whole number"),  # type: ignore[arg-type]
        (lambda: unitcad.check("a.stl", timeout=True), "^timeout = true: must be a number"),
        (lambda: unitcad.check(["a.stl"]), r'^files = \["a.stl"\]: takes a path, not list$'),  # type: ignore[arg-type]
        (lambda: unitcad.check("a.stl", printer=3), "^printer = 3: takes a printer's name"),  # type: ignore[arg-type]
        (lambda: unitcad.check("a.stl", unit=3), "^unit = 3: takes a unit's name"),  # type: ignore[arg-type]
        (lambda: unitcad.check("a.stl", ignore=3), "^ignore = 3: takes a text or"),  # type: ignore[arg-type]
    ],
)
def test_arguments_of_another_type_are_refused_in_one_sentence(call, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UnitcadError, match=words):
        call()
    assert list(tmp_path.iterdir()) == []


def test_a_single_text_is_a_list_of_one(tmp_path):
    built = unitcad.build("encapsulating", tmp_path, formats="stl", only="unit", check=False)
    assert list(built.volumes) == ["layer1", "layer2", "motor", "fpcb"]
    assert list(unitcad.estimate("encapsulating", models="published").models) == ["published"]
