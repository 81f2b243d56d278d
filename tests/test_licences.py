"""The page of licences has every dependency of pyproject.toml, and nothing that they need has the GPL."""

import re
import tomllib
from importlib import metadata
from pathlib import Path

ROOT = Path(__file__).parents[1]
LGPL = {"nptdms", "casadi"}
NOT_SHIPPED = ("all", "dev", "docs", "test")


def _name(requirement):
    found = re.match(r"[A-Za-z0-9_.-]+", requirement)
    assert found
    return found[0]


def _direct():
    """Return each dependency with its extra."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    extras = {"": project["dependencies"], **project["optional-dependencies"]}
    return [
        (extra, _name(requirement))
        for extra, requirements in extras.items()
        for requirement in requirements
        if extra not in NOT_SHIPPED and not requirement.startswith("unitcad")
    ]


def test_the_page_has_every_dependency():
    rows = re.findall(r"(?m)^\| (\S*) ?\| (\S+) \| (.+) \|$", (ROOT / "docs/reference/licences.md").read_text("utf-8"))
    assert [(extra, package) for extra, package, _ in rows if package not in ("package", "---")] == _direct()


def test_no_dependency_has_the_gpl():
    todo, seen = [name for _, name in _direct()], set()
    while todo:
        name = todo.pop().lower().replace("_", "-")
        if name in seen:
            continue
        seen.add(name)
        try:
            about = metadata.metadata(name)
        except metadata.PackageNotFoundError:
            continue  # for another system or version of Python
        stated = [about.get("License-Expression") or "", *(about.get_all("Classifier") or [])]
        said = " ".join(line for line in stated if "License" in line or line == stated[0])
        assert name in LGPL or not re.search(r"\b[AL]?GPL|General Public License", said), f"{name}: {said}"
        todo += [_name(one) for one in metadata.requires(name) or [] if "extra ==" not in one]
    assert len(seen) > 60
