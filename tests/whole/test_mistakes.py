"""Usual mistakes at the command line: each answer names file and line, field, value, limit and a value that works."""

import shlex

import pytest

from tests.in_process import unitcad
from unitcad.catalogue import materials
from unitcad.text import some
from unitcad.validation.load import shipped_files

UNIT = 'name = "unit"\ndesign = "encapsulating"\ndiameter_mm = 14\n'
LAYER = '[[layers]]\nmaterial = "{}"\nwall_mm = 1.25\ncap_mm = 1.25\n'
GOOD = UNIT + LAYER.format("ecoflex-00-10") + LAYER.format("dragon-skin-30")
SILICONES = ", ".join(materials())
ECOFLEX = some(
    sorted((name for name in materials() if name.startswith("ecoflex")), key=lambda name: (len(name), name)), 10
)  # the shortest is the most similar
CURVE = "Strain (%),Stress (kPa)\n" + "".join(f"{i}.5,{i}.5\n" for i in range(60))
THIN = "the motor (7), 0.1 of clearance and walls of 2.5 a side need 12.2 mm; nearest accepted: 12.2"

COMMANDS = {
    "biuld unit.toml": "COMMAND = 'biuld': unknown name; closest: build; nearest accepted: 'build'",
    "build unit.toml --jobs 4": "--jobs: unknown option; unitcad batch and unitcad check take it",
    "build unit.toml --set diameter_mm 14": "--set = 'diameter_mm': needs the form path=value in one word, such as "
    "layers.0.wall_mm=1.0",
    "build unit.toml --formats stl step": "SPEC = 'step': is a format; several take commas: --formats stl,step",
    "init new.txt": "NAME = 'new.txt': is the name of a TOML file; nearest accepted: 'new.toml'",
    "build unit.toml --format stl": "--format: unknown option; closest: --formats",
    "build encapsulatng": "SPEC = 'encapsulatng': unknown name; closest: encapsulating, single-encapsulating; "
    "nearest accepted: 'encapsulating'",
    "build Embedded": "SPEC = 'Embedded': unknown name; closest: embedded, single-embedded; "
    "nearest accepted: 'embedded'",
    "build folder": "SPEC = 'folder': is a folder; name a TOML file in it",
    "estimate made": "SPEC = 'made': is a folder; name a TOML file in it; nearest accepted: 'made/spec.toml'",
    "build ./part.step": "SPEC = './part.step': is a body: write design = \"./part.step\" in a spec",
    "build README.md": "README.md: no such file",
    "build part.csv": "SPEC = 'part.csv': is not a TOML file, whose name ends in .toml",
    "build gone.toml": "gone.toml: no such file",
    "build empty.toml": "SPEC = 'empty.toml': is empty; `unitcad schema spec` lists its keys",
    "build binary.toml": "binary.toml: not UTF-8 (byte 0)",
    "build sweep.toml": "SPEC = 'sweep.toml': is a sweep: run unitcad batch sweep.toml",
    "build target.toml": "SPEC = 'target.toml': is a target: run unitcad design target.toml",
    "build unit.toml --set 'diameter_mm 15'": "--set = 'diameter_mm 15': needs the form path=value in one word, such "
    "as layers.0.wall_mm=1.0",
    "build unit.toml --set diameter_mm=14,5": "diameter_mm = '14,5': takes a number; nearest accepted: 14.5",
    "build unit.toml --set diameter_mm='1.45 cm'": "diameter_mm = '1.45 cm': takes a number; nearest accepted: 14.5",
    "build unit.toml --set moulds.draft_deg='2 mm'": "moulds.draft_deg = '2 mm': takes a number",
    "build unit.toml --set diameter_mm=1.45cm": "diameter_mm = '1.45cm': takes a number; nearest accepted: 14.5",
    "build unit.toml --set diameter_mm=1.4": f"diameter_mm = 1.4: {THIN}",
    "build unit.toml --set diameter_mm=-14": f"diameter_mm = -14: must be at least 1, and {THIN}",
    "build unit.toml --set wall_mm=2": "wall_mm = 2: unknown key; known: layers.0.wall_mm or layers.1.wall_mm",
    "build unit.toml --set wall=2": "wall = 2: unknown key; known: layers.0.wall_mm or layers.1.wall_mm",
    "build unit.toml --set 'layers[0].wall_mm=2'": "layers[0].wall_mm = 2: unknown key; known: layers.0.wall_mm; "
    "nearest accepted: 'layers.0.wall_mm'",
    "build unit.toml --set 'layers[1].wal_mm=2'": "layers[1].wal_mm = 2: unknown key; known: layers.1.wall_mm; "
    "nearest accepted: 'layers.1.wall_mm'",
    "build unit.toml --set 'layers[5].wall_mm=2'": "layers[5].wall_mm = 2: unknown key; known: layers.0.wall_mm or "
    "layers.1.wall_mm",
    "build unit.toml --set 'layers[-1].wall_mm=2'": "layers[-1].wall_mm = 2: unknown key; known: layers.0.wall_mm or "
    "layers.1.wall_mm",
    "estimate unit.toml --map nowhere/x.svg": "--map = 'nowhere/x.svg': can't be written: no such file or directory",
    "build unit.toml --set layer.1.wall=2": "layer.1.wall = 2: unknown key; known: layers.1.wall_mm; "
    "nearest accepted: 'layers.1.wall_mm'",
    "build unit.toml --set layers.wall_mm=2": "layers.wall_mm = 2: wall_mm is a key of each entry: layers.0.wall_mm or "
    "layers.1.wall_mm; Layer 1 is layers.0",
    "build unit.toml --set material=Ecoflex": "material = 'Ecoflex': unknown key; known: layers.0.material or "
    f"layers.1.material; layers.0.material = 'Ecoflex': unknown name; closest: {ECOFLEX}",
    "build unit.toml --set layers.0.material=Ecoflex": "layers.0.material = 'Ecoflex': unknown name; closest: "
    f"{ECOFLEX}; nearest accepted: '{ECOFLEX.partition(',')[0]}'",
    "build unit.toml --set printer.first_layer_mm=0.3": "printer.first_layer_mm = 0.3: unknown key; known: "
    "moulds.first_layer_mm; nearest accepted: 'moulds.first_layer_mm'",
    "build unit.toml --set frequency=200Hz": "frequency = '200Hz': unknown key; known: estimate.frequency_hz; "
    "estimate.frequency_hz = 200; nearest accepted: 'estimate.frequency_hz'",
    "build unit.toml --set temperature=20": "temperature = 20: unknown key; known: casting.room_c; "
    "nearest accepted: 'casting.room_c'",
    "build unit.toml --set casting.temprature=20": "casting.temprature = 20: unknown key; known: casting.room_c; "
    "nearest accepted: 'casting.room_c'",
    "build unit.toml --set motor.thick=3": "motor.thick = 3: unknown key; known: motor.thickness_mm; "
    "nearest accepted: 'motor.thickness_mm'",
    "build unit.toml --set moulds.slot=2": "moulds.slot = 2: unknown key; known: moulds.slot_height_mm or "
    "moulds.slot_width_clearance_mm",
    "build unit.toml --set height=5": "height = 5: unknown key; a unit is as high as its layers make it: change "
    "layers.0.wall_mm and the others, cap_mm or skin_mm",
    "build unit.toml --set pot_life=3": "pot_life = 3: unknown key; it is the silicone's: `unitcad list materials "
    "--pot-life 20..` lists those of 20 min and more",
    "serve unit.toml --no-browser -o part.csv/x": "part.csv: is a file, not a folder; choose another with -o",
    "build wrist-band --set wall=2": "wall = 2: unknown key; known: unit.layers.0.wall_mm or unit.layers.1.wall_mm",
    "build unit.toml --set estimate.stack=1": "estimate.stack = 1: unknown key; it went: the range is that of the "
    "rule; leave it out",
    "build wrist-band --set body.radius_mm=30": "body = { radius_mm = 30 }: unknown key; limb took its place; "
    "nearest accepted: 'limb'",
    "batch sweep.toml --set wall=2 --dry-run": "wall: unknown key; known: layers.0.wall_mm or layers.1.wall_mm",
    "estimate unit.toml --frequency 0.2kHz": "--frequency = '0.2kHz': takes a number (HZ); nearest accepted: 200",
    "build unit.toml -o /proc/x": "-o = '/proc/x': can't be written: no such file or directory",
    "coupon fdm-0.4 --out=/proc/x/y": "--out = '/proc/x/y': can't be written: no such file or directory",
    "schema -o /proc/x.json": "-o = '/proc/x.json': can't be written: no such file or directory",
    "build unit.toml --set layers.5.wall_mm=2": "layers.5.wall_mm = 2: no entry 5: the list has the entries 0 to 1; "
    "Layer 1 is layers.0",
    "build unit.toml --only mould": "--only = 'mould': unknown name; closest: moulds; nearest accepted: 'moulds'",
    "build unit.toml --formats STL": "--formats = 'STL': unknown name; closest: stl; nearest accepted: 'stl'",
    "build unit.toml --fit made/spec.toml": "estimate.fit = 'spec.toml': is a spec, not a fit; name a "
    "lab-fit.toml, which `unitcad fit LAB` writes from measured units",
    "build unit.toml -o part.csv": "part.csv: is a file, not a folder; choose another with -o",
    "build unit.toml --set moulds.cavities=2x5": "moulds.cavities = '2x5': unknown name; known: fill or a list such as "
    "[1, 1]; nearest accepted: [2, 5]",
    "build forearm-patch --set layout.pitch_mm=x": "layout.pitch_mm = 'x': takes a number or a list such as [1.5, 1.5]",
    "batch unit.toml": "SWEEP = 'unit.toml': is a spec: run unitcad build unit.toml",
    "batch a b": "SWEEP = 'b': a batch takes one sweep; run a second batch for this one",
    "batch sweep.toml --formats stl step": "SWEEP = 'step': is a format; several take commas: --formats stl,step",
    "batch sweep.toml -j two": "--jobs = 'two': takes a whole number, such as 1",
    "estimate unit.toml --model pubished": "--model = 'pubished': unknown name; closest: published; "
    "nearest accepted: 'published'",
    "estimate unit.toml --frequency 125hz": "--frequency = '125hz': takes a number (HZ); nearest accepted: 125",
    "estimate unit.toml --frequency fast": "--frequency = 'fast': takes a number (HZ), such as 1",
    "check part.csv --select TT": "--select = 'TT': unknown code; unitcad list rules lists all",
    "check unit.toml": "FILE = 'unit.toml': is a spec: run unitcad build unit.toml",
    "check parts.csv": "FILE = 'parts.csv': no such file; closest: part.csv",
    "check 'none*.stl'": "FILE = 'none*.stl': no file matches",
    "check part.csv --jobs 0": "--jobs = 0: must be at least 1; nearest accepted: 1",
    "check a.stl --printer ender": "--printer = 'ender': unknown name; closest: ender-3; nearest accepted: 'ender-3'",
    "check part.csv --report sarif": "--report = 'sarif': must be FORMAT=FILE; nearest accepted: 'sarif=report.sarif'",
    "material curve.csv": "--like: is required: 'curve' is no shipped silicone, and a curve gives only a modulus; "
    "known: " + SILICONES,
    "material part.csv --width-mm nan": "--width-mm: nan is not a finite number; see unitcad material --help",
    "material part.csv": "part.csv: needs two lines or more of the same count of numbers",
    "material unit.toml": "FILE = 'unit.toml': is a spec: run unitcad build unit.toml",
    "measure part.csv": "CAMPAIGN = 'part.csv': is not a TOML file, whose name ends in .toml",
    "measure unit.toml": "CAMPAIGN = 'unit.toml': is a spec: run unitcad build unit.toml",
    "fit unit.toml": "LAB = 'unit.toml': is a spec: run unitcad build unit.toml",
    "fit nowhere": "LAB = 'nowhere': unknown name; known: synthetic-bench",
    "phantom skn": "PHANTOM = 'skn': unknown name; closest: skin; nearest accepted: 'skin'",
    "build sweep": "SPEC = 'sweep.toml': is a sweep: run unitcad batch sweep.toml",
    "estimate thickness": "SPEC = 'thickness': is a sweep: run unitcad batch thickness",
    "batch forearm-patch": "SWEEP = 'forearm-patch': is an array: run unitcad build forearm-patch",
    "design sweep": "TARGET = 'sweep.toml': is a sweep: run unitcad batch sweep.toml",
    "design quiet": "TARGET = 'quiet': unknown name; closest: quiet-edge; nearest accepted: 'quiet-edge'",
    "list motor": "KIND = 'motor': unknown name; closest: motors; nearest accepted: 'motors'",
    "schema sweeps": "KIND = 'sweeps': unknown name; closest: sweep; nearest accepted: 'sweep'",
    "init 'my unit'": "NAME = 'my unit': must be letters, digits, dots and dashes; nearest accepted: 'my-unit'",
    "init unit": "unit.toml: exists already; choose another name",
    "coupon prusa": "PRINTER = 'prusa': unknown name; closest: prusa-mk4, prusa-mk3s; nearest accepted: 'prusa-mk4'",
    "coupon fdm-0.4 -o part.csv": "part.csv: is a file, not a folder; choose another with -o",
    "list motors part.csv": "unexpected argument: part.csv; see unitcad list --help",
    "cache gc --limit 1GB": "--limit = '1GB': takes a number (MB), such as 4096",
    "serve sweep.toml": "SPEC = 'sweep.toml': is a sweep: run unitcad batch sweep.toml",
    "report unit.toml": "unit.toml: is a file; name the folder of a build or of a batch",
}
FILES = {
    ("build", 'name = "a"\ndesign = encapsulating\n'): [
        '2:10: not TOML: Invalid value; put quotes round a text: "encapsulating"'
    ],
    ("build", 'name = "a\n'): ["1:10: not TOML: the quotes do not end in their line"],
    ("build", UNIT.replace("14", "14,5")): [
        "3:17: not TOML: Expected newline or end of document after a statement; write a point in a number: 14.5"
    ],
    ("build", UNIT.replace("14", "14 mm")): [
        "3:18: not TOML: Expected newline or end of document after a statement; write a number without its unit: 14"
    ],
    ("build", "name: a\n"): ["1:5: not TOML: Expected '=' after a key in a key/value pair; write name = ..."],
    ("build", '{"name": "a"}'): ['1:1: not TOML: Invalid statement; this is JSON: write name = "value"'],
    ("build", GOOD.replace("diameter_mm", "diameter")): [
        "3: diameter = 14: unknown key; closest: diameter_mm, parameters; nearest accepted: 'diameter_mm'"
    ],
    ("build", GOOD + '[output]\nformats = "stl"\n'): [
        '13: output.formats = \'stl\': takes a list such as ["stl"]; nearest accepted: ["stl"]'
    ],
    ("build", GOOD.replace("14", '"14 mm"').replace("ecoflex-00-10", "ecoflex 00-10")): [
        "3: diameter_mm = '14 mm': takes a number; nearest accepted: 14",
        "5: layers.0.material = 'ecoflex 00-10': unknown name; closest: ecoflex-00-10, ecoflex-00-50, ecoflex-00-30; "
        "nearest accepted: 'ecoflex-00-10'",
    ],
    ("batch", 'base = "encapsulatng"\n[sweep]\nmode = "prodct"\n"layers.0.wall_mm" = [1.0]\n'): [
        "1: base = 'encapsulatng': unknown name; closest: encapsulating, single-encapsulating; "
        "nearest accepted: 'encapsulating'",
        "3: sweep.mode = 'prodct': unknown name; closest: product; nearest accepted: 'product'",
    ],
    ("batch", 'base = "encapsulating"\n[sweep]\n"layers.0.wal_mm" = [1.0]\n"layers.5.wall_mm" = [1.0]\n'): [
        "3: sweep.layers.0.wal_mm: unknown key; nearest accepted: 'layers.0.wall_mm'",
        "4: sweep.layers.5.wall_mm: the base has no entry 5 of layers: they are 0 to 1",
    ],
    ("design", '[target]\nedge_max = 12\n[at_hand]\nprinter = "prusa"\n'): [
        "2: target.edge_max = 12: is a fraction of the motor's amplitude, at most 2; nearest accepted: 0.12",
        "4: at_hand.printer = 'prusa': unknown name; closest: prusa-mk4, prusa-mk3s; nearest accepted: 'prusa-mk4'",
    ],
    ("measure", '[sensor]\nquantity = "speed"\nunit = "V"\n[[unit]]\nname = 3\nedge = "a.csv"\n'): [
        "2: sensor.quantity = 'speed': unknown name; known: acceleration, displacement, velocity",
        "5: unit.0.name = 3: takes a text",
        "6: unit.0.edge = 'a.csv': takes a list such as [\"a\"]",
    ],
    ("fit", 'name = "l"\nmoduli = "fast"\n[[unit]]\nname = "a"\nspec = "encapsulatng"\nlevel = { value = 0.05 }\n'): [
        "2: moduli = 'fast': unknown name; known: quasi-static, small-strain",
        "5: unit.0.spec = 'encapsulatng': unknown name; closest: encapsulating, single-encapsulating; "
        "nearest accepted: 'encapsulating'",
    ],
    ("phantom", 'name = "p"\n[[layers]]\nname = "a"\nsilicone = "ecoflex-00-30"\nthickness_mm = -2\n'): [
        "2: layers.0.thinner_pct: is required",
        "5: layers.0.thickness_mm = -2: must be at least 0.5; nearest accepted: 0.5",
    ],
}


def answer(words, folder):
    done = unitcad(*words, cwd=folder)
    assert done.returncode == 2
    return [line.removeprefix("error: ") for line in done.stderr.splitlines()]


@pytest.mark.parametrize("line", COMMANDS)
def test_a_mistake_in_a_command_is_answered_in_one_line(line, tmp_path):
    for folder in ("folder", "made"):
        (tmp_path / folder).mkdir()
    files = {
        "unit.toml": GOOD,
        "made/spec.toml": GOOD,
        "empty.toml": "",
        "part.csv": "a,b\n",
        "part.step": "",
        "curve.csv": CURVE,
    }
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    (tmp_path / "binary.toml").write_bytes(b"\xff\x00\x80")
    (tmp_path / "sweep.toml").write_text(shipped_files("sweeps")["thickness"].read_text())
    (tmp_path / "target.toml").write_text(shipped_files("targets")["quiet-edge"].read_text())
    assert answer(shlex.split(line), tmp_path) == [COMMANDS[line]]


@pytest.mark.parametrize(("command", "text"), FILES)
def test_every_mistake_in_a_file_is_told_with_its_line(command, text, tmp_path):
    (tmp_path / "a.toml").write_text(text)
    assert answer([command, "a.toml"], tmp_path) == [f"a.toml:{line}" for line in FILES[command, text]]
