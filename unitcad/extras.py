"""Extras that are not installed: the error, and the command that adds them."""

from __future__ import annotations

import importlib.util
import shlex
import sys
from pathlib import Path
from urllib.parse import urlsplit

from unitcad.documents import parse_json
from unitcad.errors import Missing, UnitcadError

STEP_MACHINES = ("x86_64", "AMD64", "aarch64", "arm64")
"""The machines for which the STEP kernel has wheels, as the markers of pyproject.toml name them."""


def install_step() -> str:
    """Return the command that adds the STEP kernel, or that it has no wheel for this machine."""
    import platform  # only here: most commands need no name of the machine

    machine = platform.machine()
    return install_command("step") if machine in STEP_MACHINES else f"it has no wheel for {machine}"


def missing_extra(extra: str, need: str) -> Missing:
    """Return the error of a library that an extra of this package brings; `need` names the library and its use."""
    return Missing(f"{need}: {install_command(extra)}")


def pip_install() -> list[str]:
    """Return the command that installs packages into this installation."""
    if importlib.util.find_spec("pip") is None:  # an environment made by uv
        return ["uv", "pip", "install", "--python", sys.executable]
    return [sys.executable, "-m", "pip", "install"]


def install_command(extras: str) -> str:
    """Return the command that adds extras to this installation, from the folder or address that it came from."""
    from importlib import metadata  # this and the next load email, http and ssl: a sixth of the start of a check
    from urllib.request import url2pathname

    try:
        source = parse_json(metadata.distribution("unitcad").read_text("direct_url.json") or "{}", "direct_url.json")
    except (metadata.PackageNotFoundError, UnitcadError):
        source = {}
    url = source.get("url", "")
    local = url.startswith("file:")
    folder = Path(url2pathname(urlsplit(url).path)) if local else Path(__file__).parent.parent
    command = pip_install()
    if (local or not url) and (folder / "pyproject.toml").is_file():
        if (folder / "constraints.txt").is_file():
            command += ["-c", str(folder / "constraints.txt")]
        command += ["-e"] * bool(source.get("dir_info", {}).get("editable"))
        return shlex.join([*command, f"{folder}[{extras}]"])
    if vcs := source.get("vcs_info"):
        return shlex.join([*command, f"unitcad[{extras}] @ {vcs['vcs']}+{url}@{vcs['commit_id']}"])
    if "archive_info" in source and (not local or folder.is_file()):
        return shlex.join([*command, f"unitcad[{extras}] @ {url}"])
    if not url:
        return shlex.join([*command, f"unitcad[{extras}]"])
    return f"in a clone, {shlex.join([*command, f'.[{extras}]'])}"
