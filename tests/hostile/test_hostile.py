"""Every command that takes a file, with files made to do harm: the law of `law.py` holds for each."""

import shutil
import sys
from pathlib import Path

import pytest
from typer.main import get_command

sys.path.insert(0, str(Path(__file__).parent))

import inputs
from law import Law

from unitcad.cli.command_line import app

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the law is enforced by Linux's means")

NO_FILE = {
    "PATH=VALUE", "NAMES", "FORMAT", "FORMAT=FILE", "CODES", "LEVEL", "PRINTER", "UNIT", "N", "PATTERN", "SECONDS",
    "MB", "MODEL", "HZ", "NAME", "TEMPLATE", "KIND", "SILICONE", "QUANTITY=COLUMN[:UNIT", "SIGN", "MM", "LOW:HIGH",
    "PORT", "ADDRESS", "I/N",
}  # fmt: skip
"""Names, in a command's help, of values that are no file; every other one is taken for a file or a folder."""
OUTPUTS = {"--out", "--pictures"}
LIGHT = {
    "build": ["--only", "unit", "--formats", "stl", "--no-check", "--no-report"],
    "batch": ["--only", "estimate", "-j", "0", "--limit", "1", "--no-report"],
    "serve": ["--no-browser"],
    "estimate": ["--model", "rule"],
    "measure": [],
}
"""Options with which a command that takes the file does little."""
LIGHTER = {("estimate", "--fit"), ("build", "--out")}
SOUND = {
    "build": ["single-embedded"], "estimate": ["single-embedded"], "batch": ["published", "--dry-run"],
    "check": ["sound.stl"], "serve": ["single-embedded"], "material": ["sound.csv"], "measure": ["campaign.toml"],
    "fit": ["synthetic-bench"], "phantom": ["skin"], "design": ["published"], "coupon": ["fdm-0.4"],
    "schema": ["spec"],
}  # fmt: skip
"""What a command does its work with while another option is tried."""


def places():
    """Each way to give a command a file: the command's words, the option ("" for an argument), whether it's written."""
    root = get_command(app)
    for name in root.list_commands(None):
        command = root.get_command(None, name)
        for one in getattr(command, "commands", {"": command}).values():
            words = [name] if one is command else [name, one.name]
            for parameter in one.params:
                if getattr(parameter, "is_flag", False):
                    continue
                kind = (parameter.metavar or "").removesuffix("...").strip("[]")
                option = max(parameter.opts, key=len) if parameter.param_type_name == "option" else ""
                if kind not in NO_FILE:
                    yield words, option, option in OUTPUTS


PLACES = list(places())
KINDS = {
    "build": "spec array", "estimate": "spec array", "accuracy": "spec array", "serve": "spec array", "batch": "sweep",
    "measure": "campaign", "fit": "fit", "phantom": "phantom", "design": "target",
}  # fmt: skip
"""Kinds of TOML that a command takes as its argument; a command that is not here gets some of all."""


@pytest.fixture(scope="session")
def law():
    with Law() as law:
        yield law


@pytest.fixture
def folder(tmp_path):
    """A folder of the command's own, next to one that it must not touch."""
    (tmp_path / "outside").mkdir()
    (tmp_path / "outside/secret").write_text("secret")
    here = tmp_path / "here"
    here.mkdir()
    (here / "sound.stl").write_bytes(inputs.stl())
    (here / "sound.csv").write_text(inputs.TABLES["sound"])
    (here / "campaign.toml").write_text(inputs.CAMPAIGN.format(settings="", record="sound.csv"))
    yield here
    assert sorted(path.name for path in tmp_path.iterdir()) == ["here", "outside"]
    assert [path.read_text() for path in (tmp_path / "outside").iterdir()] == ["secret"]


def judged(law, runs, folder):
    """What broke the law, by the command: {} if nothing did."""
    broken = {}
    for words in runs:
        outcome = law.run(words, folder, until="http://" if words[0] == "serve" else "")
        if found := outcome.broken():
            broken[" ".join(map(str, words))[:200]] = (found, outcome.said[:500])
    return broken


def put(folder, name, content):
    """A file with this content in the folder; its name."""
    path = folder / name.replace("/", "-")
    path.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8", "surrogatepass"))
    return path.name


def call(words, option, name):
    """The words of a command that is given a file."""
    command = words[0]
    if option:
        return [
            *words,
            *SOUND.get(command, []),
            *(LIGHT[command] if (command, option) in LIGHTER else []),
            option,
            name,
        ]
    return [*words, name, *LIGHT.get(command, [])]


def ids(place):
    return " ".join([*place[0], place[1]]).strip()


def test_every_command_that_takes_a_file_is_tried():
    tried = {words[0] for words, _, _ in PLACES}
    assert {"build", "check", "estimate", "report", "serve", "batch", "measure", "material", "fit", "cache"} <= tried
    assert len(PLACES) > 30


def _some(items, number, long):
    """Every twelfth of the items, others for each number; all of them in a long run."""
    return [item for i, item in enumerate(items) if long or (i + number) % 12 == 0]


both = pytest.mark.parametrize("long", [False, pytest.param(True, marks=pytest.mark.long)], ids=["some", "all"])


@both
@pytest.mark.parametrize("place", PLACES, ids=ids)
def test_what_is_no_regular_file(place, long, law, folder):
    words, option, written = place
    made = inputs.special(folder / "special", ".toml")
    found = _some(list(made.values()), PLACES.index(place), long)
    runs = [call(words, option, path.relative_to(folder)) for path in found]
    # A device itself is nothing to write to in a test: root could replace it.
    more = ("/proc/x", "sound.stl/x", "/dev/null/x", "") if written else ("/dev/zero", "/proc/self/mem", "")
    runs += [call(words, option, path) for path in more]
    assert judged(law, runs, folder) == {}


READ = [place for place in PLACES if not place[2] and place[0][0] != "cache"]


@both
@pytest.mark.parametrize("place", [place for place in READ if place[0] not in (["report"], ["schema"])], ids=ids)
def test_toml(place, long, law, folder):
    words, option, _ = place
    number = PLACES.index(place)
    kinds = "check" if option == "--config" else "" if option else KINDS.get(words[0], "")
    own = {f"{kind} {name}": text for kind in kinds.split() for name, text in inputs.TOML[kind].items()}
    if not kinds:
        own = {f"{kind} {name}": text for kind, group in inputs.TOML.items() for name, text in list(group.items())[:1]}
    others = _some(list((inputs.SYNTAX | inputs.ANY).items()), number, long)
    special = inputs.special(folder / "special", ".csv")
    (folder / "special/pipe.stl").symlink_to(special["pipe"].name)
    put(folder, "itself.toml", inputs.ARRAYS["itself"] if "array" in kinds else inputs.SWEEPS["itself"])
    skipped = {"spec sound"} if words == ["accuracy"] else set()
    tried = [*_some(list(own.items()), number, long), *others]
    runs = [call(words, option, put(folder, f"{n}.toml", t)) for n, t in tried if n not in skipped]
    assert judged(law, runs, folder) == {}


MESHES = sorted({name.rpartition(".")[2] for name, _ in inputs.meshes()})


@both
@pytest.mark.parametrize("suffix", MESHES)
def test_meshes(suffix, long, law, folder):
    meshes = [(name, content) for name, content in inputs.meshes() if name.endswith(suffix)]
    names = [put(folder, name, content) for name, content in _some(meshes, len(suffix), long)]
    assert judged(law, [["check", name] for name in names], folder) == {}


@both
def test_meshes_with_every_rule(long, law, folder):
    every = _some(list(inputs.meshes()), 0, long)
    names = [put(folder, name, content) for name, content in every]
    options = [
        "--printer",
        "fdm-0.4",
        "--strict",
        "--3mf-strict",
        "--pictures",
        "pictures",
        "--report",
        "sarif=a.sarif",
    ]
    assert judged(law, [["check", *options, "--", name] for name in names], folder) == {}


@both
def test_step(long, law, folder):
    pytest.importorskip("OCP")
    names = [put(folder, name, content) for name, content in _some(inputs.steps(), 0, long)]
    assert judged(law, [["check", name] for name in names], folder) == {}


@both
def test_bodies_of_a_spec(long, law, folder):
    runs = []
    for name, content in _some([x for x in inputs.meshes() if x[0].endswith((".stl", ".3mf"))], 0, long):
        body = put(folder, name, content)
        spec = put(folder, f"{name}.toml", inputs.SPEC.replace('"embedded"', f"'{body}'"))
        runs.append(["estimate", spec])
    assert judged(law, runs, folder) == {}


RECORDINGS = [".csv", ".wav", ".mat", ".h5", ".tdms", ".uff", "any"]


@both
@pytest.mark.parametrize("suffix", RECORDINGS)
def test_recordings(suffix, long, law, folder):
    pytest.importorskip("h5py")
    runs = []
    for name, content in inputs.recordings():
        if name.endswith(suffix) if suffix != "any" else " any" in name:
            record = put(folder, name, content)
            settings = "[recording]\nrate_hz = 2000\n" if len(runs) % 2 else ""
            campaign = inputs.CAMPAIGN.format(settings=settings, record=record)
            runs.append(["measure", put(folder, f"{name}.toml", campaign)])
    assert len(runs) > 9
    assert judged(law, _some(runs, len(suffix), long), folder) == {}


@both
def test_tables(long, law, folder):
    sizes = ["--width-mm", "6", "--thickness-mm", "3", "--gauge-mm", "33"]
    names = [put(folder, name, content) for name, content in inputs.tables()]
    runs = [["material", name, *sizes] for name in names] + [
        ["material", "sound.csv", "--dma", name] for name in names[::3]
    ]
    assert judged(law, _some(runs, 0, long), folder) == {}


@pytest.fixture(scope="session")
def result(law, tmp_path_factory):
    """The folder of a unit's result."""
    folder = tmp_path_factory.mktemp("result")
    outcome = law.run(["build", "single-embedded", "--formats", "stl,svg", "--no-report"], folder)
    assert outcome.code == 0, outcome.said
    return next((folder / "out").iterdir())


@both
@pytest.mark.parametrize(
    "file", ["manifest.json", "estimate.json", "casting.json", "x.cast.json", "batch.json", "spec.toml"]
)
def test_results(file, long, result, law, folder):
    runs = []
    texts = list((inputs.SYNTAX if file == "spec.toml" else inputs.JSON).items())
    for name, text in _some(texts, len(file), long):
        there = folder / name
        shutil.copytree(result, there)
        put(there, file, text)
        runs += [["report", name], ["check", "--manifest", name]][: 2 if file == "manifest.json" else 1]
    assert judged(law, runs, folder) == {}
    runs = [["serve", words[1], "--no-browser"] for words in runs[::3]]
    assert judged(law, runs, folder) == {}


@both
def test_a_batch_that_is_taken_up(long, law, folder):
    sweep = put(folder, "sweep.toml", 'base = "single-embedded"\n[sweep]\ndiameter_mm = [14]\n')
    batch = ["batch", sweep, "--only", "estimate", "-j", "0", "--no-report", "--cache", "cache", "-o"]
    assert judged(law, [[*batch, "whole"]], folder) == {}
    runs = []
    texts = _some([*inputs.JSON.items(), *inputs.ANY.items()], 1, long)
    for i, (name, text) in enumerate(texts):
        shutil.copytree(folder / "whole", folder / name)
        put(folder / name / "sweep", ("journal.jsonl", "batch.json", "batch.lock")[i % 3], text)
        runs.append([*batch, name])
    for i, path in enumerate(sorted(path for path in (folder / "cache").rglob("*") if path.is_file())[:30]):
        if i % 2:
            path.chmod(0o644)
            path.write_bytes(inputs.NOISE)
    runs += [
        ["cache", "ls", "--cache", "cache"],
        ["cache", "gc", "--cache", "cache", "--limit", "0"],
        [*batch, "again"],
    ]
    assert judged(law, runs, folder) == {}
