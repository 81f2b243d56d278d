"""What a build writes passes `unitcad check` as it is, against its manifest too."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from unitcad.cli import app
from unitcad.validation.load import every_template


@pytest.mark.parametrize("template", sorted(every_template()))
def test_a_result_passes_check_and_its_manifest(template: str, tmp_path: Path) -> None:
    formats = "stl,3mf,step" if template == "encapsulating" else "stl,3mf"
    built = CliRunner().invoke(
        app, ["build", template, "-o", str(tmp_path), "--only", "unit,moulds", "--formats", formats, "--no-check"]
    )
    if template == "custom/dome":  # has no moulds
        return
    assert built.exit_code == 0, built.output
    folder = built.stdout.splitlines()[-1]
    for arguments in ([folder], ["--manifest", folder]):
        checked = CliRunner().invoke(app, ["check", *arguments])
        assert checked.exit_code == 0, checked.output
