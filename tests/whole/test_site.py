"""The docs as a site: every link leads somewhere, and nothing is loaded from outside."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from docs.readme import HOME, README, home_block
from unitcad.meshcheck.rules.registry import rules

pytest.importorskip("material", reason="the site needs the extra docs")
ROOT = Path(__file__).parents[2]
LOADED = re.compile(
    r"""<(?:script|img|iframe|source|object|embed)[^>]*\s(?:src|data)=["']?((?:https?:)?//[^"'\s>]+)"""
    r"""|<link(?![^>]*rel=["']?canonical)[^>]*\shref=["']?((?:https?:)?//[^"'\s>]+)"""
    r"""|@import\s+["']?((?:https?:)?//[^"'\s;]+)|url\(["']?((?:https?:)?//[^"')]+)"""
)


def build(source, target):
    # Not --quiet: strict then counts no warnings.
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "-f", str(source / "mkdocs.yml")]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    return subprocess.run(
        [*command, "-d", str(target)], capture_output=True, text=True, env=environment, timeout=300, check=False
    )


def loaded(folder):
    """What the pages and style sheets of a site load from outside."""
    files = [path for path in folder.rglob("*") if path.suffix in (".html", ".css")]
    return ["".join(found) for path in files for found in LOADED.findall(path.read_text("utf-8"))]


def test_the_site_builds_strictly_and_loads_nothing_from_outside(tmp_path):
    done = build(ROOT, tmp_path / "site")
    assert done.returncode == 0, done.stderr
    assert loaded(tmp_path / "site") == []
    python = (ROOT / "docs/reference/python.md").read_text("utf-8")
    shown = (tmp_path / "site/reference/python.html").read_text("utf-8")
    assert shown.count("<h2 id=") == len(re.findall(r"(?m)^## ", python))  # no heading is lost in a block of code
    rules_page = (tmp_path / "site/reference/mesh-rules.html").read_text("utf-8")
    folds = re.findall(r"<details>\s*<summary>\s*<h3 id=\"(\w+)\"", rules_page)
    assert folds == [code.lower() for code in rules()]  # a phone shows a line a rule, and each has its address
    for page in (ROOT / "docs").rglob("*.md"):
        assert (tmp_path / "site" / page.relative_to(ROOT / "docs").with_suffix(".html")).is_file(), page
        relative = page.relative_to(ROOT / "docs").as_posix()
        assert (
            relative.startswith("evidence/accuracy/")
            or relative == "index.md"
            or f"]({relative})" in (ROOT / "docs" / "index.md").read_text("utf-8")
        ), f"the index of the docs lacks {relative}"


WITHOUT_EXTRAS = """
import importlib.metadata, re, sys, tomllib
sys.path.insert(0, ".")
project = tomllib.load(open("pyproject.toml", "rb"))["project"]
def name(text): return re.split(r"[^A-Za-z0-9._-]", text)[0].lower()
extras = project["optional-dependencies"]
own = {name(one) for one in (*project["dependencies"], *extras["docs"])}
others = {name(one) for each in extras.values() for one in each} - own - {"unitcad"}
found = importlib.metadata.packages_distributions()
gone = {module for module, dists in found.items() if {dist.lower() for dist in dists} & others}
class Blocked:
    def find_spec(self, module, *_):
        if module.partition(".")[0] in gone:
            raise ModuleNotFoundError(module)
sys.meta_path.insert(0, Blocked())
import docs.generated
print(len(gone), len(docs.generated.pages()))
"""


def test_the_extra_docs_is_all_that_the_pages_need():
    done = subprocess.run([sys.executable, "-c", WITHOUT_EXTRAS], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    blocked, made = map(int, done.stdout.split())
    assert blocked > 5
    assert made > 8


def test_the_home_shows_what_the_readme_shows():
    block = re.search(r"(?ms)^```text\n.*?^```$", README.read_text("utf-8"))
    assert block
    assert home_block(block[0]) in HOME.read_text("utf-8")


def test_a_lost_link_fails_the_site(tmp_path):
    shutil.copytree(ROOT / "docs", tmp_path / "docs", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "mkdocs.yml", tmp_path)
    with (tmp_path / "docs/index.md").open("a") as page:
        page.write("\n[x](nowhere.md) [y](reference/spec.md#nothing)\n")
    done = build(tmp_path, tmp_path / "site")
    assert done.returncode != 0
    assert "nowhere.md" in done.stdout + done.stderr
    assert "#nothing" in done.stdout + done.stderr
