"""The pre-commit hook and the GitHub Action, as data and by running what they run."""

import importlib.metadata
import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from shapes import box, stl
from test_check_command import run
from typer.main import get_command

from unitcad.cli import app
from unitcad.meshcheck import settings
from unitcad.meshcheck.output import json_report

needs_bash = pytest.mark.skipif(sys.platform == "win32", reason="the action's script is bash")
ROOT = Path(__file__).parent.parent.parent


def _value(text, key):
    found = re.search(rf"(?m)^\s*{key}: (.+)$", text)
    return found.group(1)


@pytest.mark.parametrize(("name", "wanted"), [
    ("a.stl", True), ("dir/b.STL", True), ("c.3mf", True), ("d.obj", True), ("e.ply", True), ("f.off", True),
    ("g.step", False), ("h.stl.txt", False), ("stl", False), ("i.object", False),
])  # fmt: skip
def test_hook_takes_mesh_files_by_suffix(name, wanted):
    hook = (ROOT / ".pre-commit-hooks.yaml").read_text("utf-8")
    assert bool(re.search(_value(hook, "files"), name)) == wanted
    assert _value(hook, "entry") == "unitcad check --hook"


NAMES = [
    "--report=json=out/x.stl", "--report=sarif=/{outside}/x.stl", "--pictures=p/x.stl", "--config=x.stl",
    "--ignore=T/x.obj", "--help.stl", "-j9/--.stl",
    "--fail-on/error.stl", "--hook.stl", "-.stl", "*.stl", "-x -y.stl", "--/x.stl",
]  # fmt: skip


@needs_bash
@pytest.mark.parametrize("own", [
    [], ["--output-format", "json"], ["--output-format=json", "--config", "own.toml", "-j", "2"], ["--json", "--"],
])  # fmt: skip
def test_a_file_name_is_no_option_of_the_hook(own, tmp_path):
    """As pre-commit calls it: the entry, the user's own arguments, then names, by xargs."""
    folder, outside = tmp_path / "work", str(tmp_path / "outside").strip("/")
    names = [name.replace("{outside}", outside) for name in NAMES]
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(stl(box()) + bytes(16) if name.endswith("stl") else b"v 0 0 0\n")
    (folder / "own.toml").write_text("[check]\nfail-on = 'error'\n")
    before = sorted(tmp_path.rglob("*"))
    entry = _value((ROOT / ".pre-commit-hooks.yaml").read_text("utf-8"), "entry").split()
    program = Path(sys.executable).parent / entry[0]
    done = subprocess.run(
        ["xargs", "-0", str(program), *entry[1:], *own],
        input="\0".join(names), cwd=folder, capture_output=True, text=True,
    )  # fmt: skip
    assert sorted(tmp_path.rglob("*")) == before
    if own:
        assert {file["path"] for file in json.loads(done.stdout)["files"]} == set(names)
    else:
        assert f"{len(names)} files: " in done.stdout, done.stderr
    assert done.returncode == 123  # of xargs; the OBJ has no faces


def _scripts():
    """The action's scripts: that of the step Install, that of the step Check."""
    text = (ROOT / "action.yml").read_text("utf-8")
    return [
        "".join(line[8:] for line in found.splitlines(keepends=True))
        for found in re.findall(r"(?m)^      run: \|\n((?: {8}.*\n)+)", text)
    ]


def _program(path, words):
    """A program at `path` that writes its arguments down in a file beside the folder, then runs `words`."""
    path.parent.mkdir(exist_ok=True)
    path.write_text(
        f'#!/bin/sh\nprintf "%s|" "$@" >> {path.parent.parent}/calls\necho >> {path.parent.parent}/calls\n{words}\n'
    )
    path.chmod(0o755)


def _calls(folder):
    return (folder / "calls").read_text("utf-8").splitlines()


def _run_action(folder, **given):
    """The action's last script as a runner starts it, with a `unitcad` on the path that is this one."""
    text = (ROOT / "action.yml").read_text("utf-8")
    script = folder / "step.sh"
    script.write_text(_scripts()[1])
    _program(folder / "bin/unitcad", f'exec {sys.executable} -c "from unitcad.cli import main; main()" "$@"')
    (folder / "bin/python").write_text(f'#!/bin/sh\nexec {sys.executable} "$@"\n')
    (folder / "bin/python").chmod(0o755)
    inputs = {"FILES": ".", "FAIL_ON": "", "PRINTER": "", "ARGUMENTS": "", "SARIF": "", "SUMMARY": "true"} | given
    for name in inputs:
        assert f"{name}: ${{{{ inputs." in text
    runner = {"PATH": f"{folder / 'bin'}:{os.environ['PATH']}", "GITHUB_STEP_SUMMARY": str(folder / "summary.md")}
    environment = {**os.environ, **inputs, **runner}
    (folder / "work").mkdir(exist_ok=True)
    (folder / "work/good.stl").write_bytes(stl(box()))
    (folder / "work/bad.stl").write_bytes(stl(box()[2:]))
    return subprocess.run(
        ["bash", "--noprofile", "--norc", "-eo", "pipefail", str(script)],
        cwd=folder / "work", env=environment, capture_output=True, text=True,
    )  # fmt: skip


@needs_bash
@pytest.mark.parametrize(
    ("files", "code", "sarif"),
    [("good.stl", 0, "out.sarif"), ("bad.stl\ngood.stl", 1, "deep/er/out.sarif"), ("*.stl", 1, "")],
)
def test_the_action_reports_and_fails_on_findings(files, code, sarif, tmp_path):
    done = _run_action(tmp_path, FILES=files, SARIF=sarif)
    assert done.returncode == code, done.stderr
    assert ("::error file=bad.stl" in done.stdout) == bool(code)
    assert len(_calls(tmp_path)) == 1, "one run judges, whatever is written"
    told = (tmp_path / "summary.md").read_text("utf-8")
    assert ("| error | bad.stl | T001 " in told) == bool(code)
    assert f"{len(files.split())} file" in told or files == "*.stl"
    if sarif:
        results = json.loads((tmp_path / "work" / sarif).read_text("utf-8"))["runs"][0]["results"]
        assert bool(results) == bool(code)


@needs_bash
@pytest.mark.parametrize(
    ("given", "said"),
    [({"FILES": " "}, "is required"), ({"PRINTER": "none-such"}, "--printer")],
)  # fmt: skip
def test_the_action_fails_on_wrong_inputs_and_says_so(given, said, tmp_path):
    done = _run_action(tmp_path, **given, SARIF="out.sarif")
    assert done.returncode == 2
    assert said in done.stderr
    assert not (tmp_path / "work/out.sarif").exists()


@needs_bash
@pytest.mark.parametrize("names", [
    "my parts", "  my parts/bad one.stl  \r\n good.stl", "my parts/**/bad*.stl",
])  # fmt: skip
def test_the_action_takes_names_with_blanks(names, tmp_path):
    (tmp_path / "work/my parts/deep er").mkdir(parents=True)
    for name in ("bad one.stl", "deep er/bad two.stl"):
        (tmp_path / "work/my parts" / name).write_bytes(stl(box()[2:]))
    done = _run_action(tmp_path, FILES=names)
    assert done.returncode == 1, done.stderr
    assert "::error file=my parts/bad one.stl" in done.stdout
    assert "F001" not in done.stdout
    assert ("bad two" in done.stdout) == (names in ("my parts", "my parts/**/bad*.stl"))


@needs_bash
def test_the_action_takes_arguments_in_quotes_and_none_as_a_pattern(tmp_path):
    (tmp_path / "work").mkdir()
    (tmp_path / "work/my settings.toml").write_text("[check]\nignore = ['T001']\n")
    given = "--config 'my settings.toml'\n--jobs \"1\""
    assert _run_action(tmp_path, FILES="bad.stl", ARGUMENTS=given).returncode == 0
    done = _run_action(tmp_path, FILES="bad.stl", ARGUMENTS=given + " --ignore F*")
    assert "--config|my settings.toml|--jobs|1|--ignore|F*|" in _calls(tmp_path)[1]
    assert done.returncode == 2, "F* is no prefix of a code"
    open_quote = _run_action(tmp_path, FILES="bad.stl", ARGUMENTS="--config 'my")
    assert open_quote.returncode == 2
    assert "a quote is not closed" in open_quote.stdout


@needs_bash
def test_a_wrong_command_leaves_no_report_of_an_earlier_run(tmp_path):
    assert _run_action(tmp_path, FILES="bad.stl", SARIF="out.sarif", SUMMARY="false").returncode == 1
    assert not (tmp_path / "summary.md").exists()
    assert (tmp_path / "work/out.sarif").exists()
    assert _run_action(tmp_path, FAIL_ON="never", SARIF="out.sarif").returncode == 2
    assert not (tmp_path / "work/out.sarif").exists()


@needs_bash
@pytest.mark.parametrize(
    ("step", "alone", "code", "wanted"),
    [("true", "false", 0, "[step]"), ("false", "false", 0, ""), ("yes", "false", 2, "step must be true or false, not yes"),
     ("false", "true", 0, "/packages/unitcad-check"), ("true", "true", 2, "alone takes no step"),
     ("false", "1", 2, "alone must be true or false, not 1")],
)  # fmt: skip
def test_the_action_installs_the_step_kernel_or_the_check_alone_on_demand(step, alone, code, wanted, tmp_path):
    _program(tmp_path / "bin/python", "")
    environment = {
        **os.environ,
        "SOURCE": "/a b/unitcad",
        "STEP": step,
        "ALONE": alone,
        "PATH": f"{tmp_path / 'bin'}:{os.environ['PATH']}",
    }
    done = subprocess.run(
        ["bash", "-eo", "pipefail", "-c", _scripts()[0]], env=environment, capture_output=True, text=True
    )
    assert done.returncode == code
    if code:
        assert wanted in done.stdout
    else:
        assert _calls(tmp_path) == [f"-m|pip|install|--quiet|/a b/unitcad{wanted}|"]
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]
    assert "step" in extras


@needs_bash
@pytest.mark.parametrize(("fail_on", "code"), [("", 1), ("error", 0)])
def test_the_action_takes_the_checkouts_settings(fail_on, code, tmp_path):
    (tmp_path / "work").mkdir()
    (tmp_path / "work/warn.stl").write_bytes(stl(box()) + bytes(16))
    (tmp_path / "work/unitcad.toml").write_text("[check]\nfail-on = 'warning'\n")
    done = _run_action(tmp_path, FILES="warn.stl", FAIL_ON=fail_on)
    assert done.returncode == code, done.stderr


def test_the_settings_on_the_page_are_settings(tmp_path, monkeypatch):
    page = (ROOT / "docs/how-to/checks-in-ci.md").read_text("utf-8")
    monkeypatch.chdir(tmp_path)
    shown = re.findall(r"```toml\n# (\S+)\n(.*?)```", page, re.DOTALL)
    assert [name for name, _ in shown] == ["unitcad.toml"]
    for name, text in shown:
        (tmp_path / name).write_text(text)
        found = settings.find(name)
        assert found.ignored("scans/a.stl")
        assert all(value is not None for value in vars(found.settings).values()), "it shows every key there is"
        (tmp_path / "part.stl").write_bytes(stl(box()))
        run("part.stl", "--write-baseline", "known.json", cwd=tmp_path)
        assert run("part.stl", cwd=tmp_path).returncode == 0


PIP_PROJECT = """
[build-system]
requires = []
build-backend = "backend"
backend-path = ["."]
[project]
name = "unitcad"
version = "0"
"""
BACKEND = """
import zipfile
def build_wheel(folder, config_settings=None, metadata_directory=None):
    with zipfile.ZipFile(f"{folder}/unitcad-0-py3-none-any.whl", "w") as wheel:
        wheel.writestr("unitcad-0.dist-info/METADATA", "Metadata-Version: 2.1\\nName: unitcad\\nVersion: 0\\n")
        wheel.writestr("unitcad-0.dist-info/WHEEL", "Wheel-Version: 1.0\\nRoot-Is-Purelib: true\\nTag: py3-none-any\\n")
        wheel.writestr("unitcad-0.dist-info/RECORD", "")
    return "unitcad-0-py3-none-any.whl"
"""


@pytest.fixture(scope="module")
def fresh_python(tmp_path_factory):
    """A Python with pip, as `setup-python` gives."""
    folder = tmp_path_factory.mktemp("python")
    subprocess.run([sys.executable, "-m", "venv", folder], check=True, capture_output=True)
    return folder / "bin"


@needs_bash
@pytest.mark.parametrize("search", [None, ".", "src", ":src"])
@pytest.mark.parametrize("step", ["Install", "Check"])
def test_the_action_runs_no_code_of_the_checkout(step, search, fresh_python, tmp_path):
    """Modules with the name of everything that Python, pip or unitcad may import, and a workflow's own PYTHONPATH."""
    checkout, ran, project = (tmp_path / name for name in ("checkout", "ran", "project"))
    installed = {name for name in importlib.metadata.packages_distributions() if name.isidentifier()}
    names = {*sys.stdlib_module_names, *installed, "sitecustomize", "usercustomize"}
    for folder in (checkout, checkout / "src"):
        for name in ("pip", "unitcad"):
            (folder / name).mkdir(parents=True)
        for name in names:
            whole = folder / name if (folder / name).is_dir() else None
            for file in [whole / "__init__.py", whole / "__main__.py"] if whole else [folder / f"{name}.py"]:
                file.write_text(f"open({str(ran / name)!r}, 'w').close()\n")
    for name, text in {"pyproject.toml": PIP_PROJECT, "backend.py": BACKEND}.items():
        project.mkdir(exist_ok=True)
        (project / name).write_text(text)
    ran.mkdir()
    (checkout / "a.stl").write_bytes(stl(box()))
    inputs = {
        "STEP": "false",
        "ALONE": "false",
        "SOURCE": str(project),
        "PIP_TARGET": str(tmp_path / "installed"),
        "PIP_NO_INDEX": "1",
    }
    inputs |= {"FILES": "a.stl\nno such name.stl", "FAIL_ON": "", "PRINTER": "", "SARIF": "", "SUMMARY": "true"}
    inputs |= {"ARGUMENTS": "--jobs 2 --output-format 'text'", "GITHUB_STEP_SUMMARY": str(tmp_path / "summary.md")}
    programs = fresh_python if step == "Install" else Path(sys.executable).parent
    environment = {**os.environ, **inputs, "PATH": f"{programs}:{os.environ['PATH']}"}
    if search is not None:
        environment |= {"PYTHONPATH": search, "PYTHONWARNINGS": "ignore::colorsys.Planted"}
    script = tmp_path / "step.sh"
    script.write_text(_scripts()[step == "Check"])
    done = subprocess.run(
        ["bash", "--noprofile", "--norc", "-eo", "pipefail", str(script)],
        cwd=checkout, env=environment, capture_output=True, text=True,
    )  # fmt: skip
    assert [path.name for path in ran.iterdir()] == []
    if step == "Install":
        assert done.returncode == 0, done.stderr
        assert (tmp_path / "installed/unitcad-0.dist-info").is_dir()
    else:
        assert done.returncode == 2, done.stderr
        assert "4 files: 3 failed, 1 passed." in (tmp_path / "summary.md").read_text("utf-8")


def test_the_actions_inputs_are_not_pasted_into_its_script():
    """An input inside `run:` would let a pull request's text become a command."""
    assert (ROOT / "action.yml").read_text("utf-8").count("run:") == len(_scripts()) == 2
    assert not any("${{" in script for script in _scripts())


def test_the_page_on_ci_names_what_there_is():
    """Its snippets use the hook's id, every input of the action and no other, and options of the command only."""
    page = (ROOT / "docs/how-to/checks-in-ci.md").read_text("utf-8")
    action = (ROOT / "action.yml").read_text("utf-8")
    assert f"- id: {_value((ROOT / '.pre-commit-hooks.yaml').read_text('utf-8'), '- id')}\n" in page
    inputs = re.findall(r"(?m)^  ([\w-]+):$", action[action.index("inputs:") : action.index("runs:")])
    step = page[page.index("you/unitcad@REF  #") : page.index("- uses: github/codeql-action")]
    assert re.findall(r"(?m)^          ([\w-]+):", step) == inputs
    known = {name for parameter in get_command(app).get_command(None, "check").params for name in parameter.opts}
    assert set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", page)) <= known


def test_the_page_on_ci_shows_the_json_that_is_written(judge):
    page = (ROOT / "docs/how-to/checks-in-ci.md").read_text("utf-8")
    shown = json.loads(page[page.index("```json\n") + 8 : page.index("```\n", page.index("```json"))])
    content = re.search(r"open\('open.obj', 'w'\).write\('(.*)'\)", page)
    found = json_report([judge(content.group(1).replace("\\n", "\n"), "open.obj")])
    found["files"][0]["path"] = "open.obj"
    del found["files"][0]["findings"][0]["locations"][1:]
    found["files"][0]["facts"]["area_mm2"] = round(found["files"][0]["facts"]["area_mm2"], 6)
    assert shown == found
