"""A phantom whose layers' moduli were measured: from `unitcad material`'s file through to response and tissue."""

from __future__ import annotations

import json
import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from unitcad.attenuation import FractionalKelvinVoigt
from unitcad.cli import app
from unitcad.errors import Refusal
from unitcad.files import sha256
from unitcad.lab.phantom import PhantomSet, bench, phantom_files, phantom_set
from unitcad.lab.phantom.recipe import load_phantom, phantoms

LAW = FractionalKelvinVoigt(300e-6, 0.3)
STATIC = 90e3


def _coupons(folder: Path, scale: float = 1.0) -> list[str]:
    """Write three pulls of the skin's coupons: neo-Hooke, 120 kPa and a scatter of 5 %."""
    names = []
    for i, factor in enumerate((0.95, 1.0, 1.05)):
        strain = np.linspace(0.0, 1.6, 200)
        stress = scale * factor * 40.0 * ((1 + strain) - (1 + strain) ** -2)
        path = folder / f"skin-{i + 1}.csv"
        rows = [f"{100 * e:.6f},{s:.6f}" for e, s in zip(strain, stress, strict=True)]
        path.write_text("\n".join(["Strain (%),Stress (kPa)", *rows]) + "\n")
        names.append(str(path))
    return names


def _dynamic(folder: Path) -> str:
    hertz = np.geomspace(5, 200, 12)
    moduli = [LAW.complex_shear(STATIC, 2 * math.pi * one) for one in hertz]
    rows = [f"{f:.6g},{m.real / 1e3:.6g},{m.imag / 1e3:.6g}" for f, m in zip(hertz, moduli, strict=True)]
    (folder / "sweep.csv").write_text("\n".join(["Frequency (Hz),E' (kPa),E'' (kPa)", *rows]) + "\n")
    return str(folder / "sweep.csv")


def _material(folder: Path, *words: str, like: str = "ecoflex-00-50") -> None:
    fixed = ("material", *words, "--name", "skin-mix", "--like", like, "-o", str(folder / "skin-mix"))
    done = CliRunner().invoke(app, fixed)
    assert done.exit_code == 0, done.output


def _phantom(folder: Path, more: str = 'measured = "skin-mix/material.toml"') -> Path:
    text = phantoms()["skin"].read_text("utf-8").replace('name = "skin"\nsilicone', f'name = "skin"\n{more}\nsilicone')
    (folder / "ours.toml").write_text(text)
    return folder / "ours.toml"


def _made(path: Path) -> PhantomSet:
    return phantom_set(load_phantom(path))


def test_a_slow_pull_s_modulus_source_and_range_go_through_to_response_and_tissue(tmp_path: Path) -> None:
    _material(tmp_path, *_coupons(tmp_path))
    value = tomllib.loads((tmp_path / "skin-mix" / "material.toml").read_text())["materials"]["skin-mix"]
    modulus = value["quasistatic_modulus_kpa"]
    made = _made(_phantom(tmp_path))
    one = made.recipes[0]
    factor = abs(1 + (2j * math.pi * 125 * 260e-6) ** 0.27)  # the catalogue's law, from rest to 125 Hz
    assert (one.modulus_kpa, one.low_kpa) == (modulus["value"], modulus["low"])
    assert one.high_kpa == pytest.approx(factor * modulus["high"])
    shipped = phantom_set(load_phantom("skin"))
    assert made.expected.value[-1] != pytest.approx(shipped.expected.value[-1], rel=1e-3)
    assert made.expected.low[-1] < made.expected.value[-1] < made.expected.high[-1]
    layers = tomllib.loads(phantom_files.tissue_toml(made))["tissue"]["phantom-skin"]
    tissue = layers["skin"]
    assert tissue["youngs_modulus_kpa"]["value"] == pytest.approx(modulus["value"])
    assert tissue["status"] == "measured"
    assert layers["muscle"]["status"] == "secondary"
    assert "material.toml; secant over 12 to 24 %" in tissue["source"]
    assert tissue["source"].endswith("what 125 Hz may bring (assumed)")
    words = bench.casting_markdown(made)
    assert "Modulus of the skin: measured, quasi-static, material.toml" in words
    assert "with the moduli of the recipe" in words
    data = phantom_files.casting_data(made)["recipes"]
    file = {"file": "material.toml", "sha256": sha256(tmp_path / "skin-mix" / "material.toml")}
    assert (data[0]["measured"], data[1]["measured"]) == (file, None)


def test_a_dynamic_test_goes_first_and_brings_its_loss_factor(tmp_path: Path) -> None:
    """The modulus is the motor's frequency's own: no factor at the upper end."""
    _material(tmp_path, *_coupons(tmp_path), "--dma", _dynamic(tmp_path), "--frequency-hz", "125")
    entry = tomllib.loads((tmp_path / "skin-mix" / "material.toml").read_text())["materials"]["skin-mix"]
    made = _made(_phantom(tmp_path))
    one, there = made.recipes[0], LAW.complex_shear(STATIC, 2 * math.pi * 125.0)
    assert one.modulus_kpa == pytest.approx(there.real / 1e3, rel=1e-2)
    assert one.high_kpa == entry["youngs_modulus_kpa"]["high"]
    assert one.loss[0] == pytest.approx(there.imag / there.real, rel=1e-2)
    assert one.loss[1:] == (entry["loss_factor"]["low"], entry["loss_factor"]["high"])
    tissue = tomllib.loads(phantom_files.tissue_toml(made))["tissue"]["phantom-skin"]["skin"]
    assert "may bring" not in tissue["source"]
    assert tissue["loss_factor"]["status"] == "measured"


def test_a_silicone_that_nobody_tested_may_be_measured(tmp_path: Path) -> None:
    _material(tmp_path, *_coupons(tmp_path), like="dragon-skin-10-medium")
    path = _phantom(tmp_path)
    text = (
        path.read_text()
        .replace("ecoflex-00-50", "dragon-skin-10-medium")
        .replace("thinner_pct = 6.0", "thinner_pct = 40.0")
    )
    path.write_text(text)
    made = _made(path)
    assert made.recipes[0].silicone.name == "dragon-skin-10-medium"
    path.write_text(text.replace('measured = "skin-mix/material.toml"', ""))
    with pytest.raises(Refusal, match="not known"):
        _made(path)


@pytest.mark.parametrize(
    ("old", "new", "part"),
    [
        ("[materials.skin-mix]", "[materials.b]\nlike = 'ecoflex-00-50'\n[materials.skin-mix]", "must hold one table"),
        ('like = "ecoflex-00-50"', 'like = "ecoflex-00-10"', "is of ecoflex-00-10 (like), the layer of ecoflex-00-50"),
        ("low = ", "lowest = ", "lowest"),
        ('status = "measured"', 'status = "sure"', "status"),
        ("quasistatic_modulus_kpa", "youngs_modulus", "youngs_modulus"),
        ("quasistatic_modulus_kpa", "modulus_100pct_kpa", "neither youngs_modulus_kpa nor quasistatic_modulus_kpa"),
        ("", "x = [", "ours.toml"),
    ],
)
def test_a_file_that_says_something_else_is_refused(old: str, new: str, part: str, tmp_path: Path) -> None:
    _material(tmp_path, *_coupons(tmp_path))
    file = tmp_path / "skin-mix" / "material.toml"
    text = "\n".join(line for line in file.read_text().splitlines() if not line.startswith("modulus_100pct"))
    file.write_text(text.replace(old, new, 1) if old else new)
    with pytest.raises(Refusal) as refused:
        _made(_phantom(tmp_path))
    assert refused.value.field == "layers.0.measured"
    assert part.replace("ours.toml", "material.toml") in str(refused.value)


def test_a_modulus_at_another_frequency_and_a_missing_file_are_refused(tmp_path: Path) -> None:
    _material(tmp_path, "--dma", _dynamic(tmp_path), "--frequency-hz", "60")
    done = CliRunner().invoke(app, ["phantom", str(_phantom(tmp_path)), "-o", str(tmp_path / "out")])
    assert isinstance(done.exception, Refusal)
    assert "--frequency-hz 125" in str(done.exception)
    assert not (tmp_path / "out").exists()
    with pytest.raises(Refusal, match="no such file"):
        _made(_phantom(tmp_path, 'measured = "gone.toml"'))


def test_the_terminal_and_json_name_the_measured_layer(tmp_path: Path) -> None:
    _material(tmp_path, *_coupons(tmp_path))
    words = ["phantom", str(_phantom(tmp_path)), "-o", str(tmp_path / "out")]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    assert "measured" in done.output
    first = (tmp_path / "out" / "phantom-skin" / "tissue.toml").read_bytes()
    shown = json.loads(CliRunner().invoke(app, [*words, "--json"]).output)
    assert shown["recipes"][0]["measured"]["file"] == "material.toml"
    assert (tmp_path / "out" / "phantom-skin" / "tissue.toml").read_bytes() == first
