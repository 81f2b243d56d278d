"""`batch --table`: a row a variant in one file, the least level first, whatever else the batch makes."""

import csv

import pytest
from batching import rows, unitcad

from unitcad.errors import Missing, Refusal
from unitcad.sweeps import level_table
from unitcad.sweeps.level_table import check_table

SWEEP = """
base = "encapsulating"
name = "pairs"
[sweep]
"layers.0.material" = ["dragon-skin-30", "ecoflex-00-10"]
"layers.0.wall_mm" = [1.25, 1.5]
"""


@pytest.fixture
def sweep(tmp_path):
    file = tmp_path / "pairs.toml"
    file.write_text(SWEEP)
    return file


def table_of(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_units_alone_have_the_levels_of_estimates_alone(sweep, tmp_path):
    for only in ("unit", "estimate"):
        words = (
            "--only",
            only,
            "--formats",
            "stl",
            "-j",
            0,
            "-o",
            tmp_path / only,
            "--table",
            tmp_path / f"{only}.csv",
        )
        assert unitcad("batch", sweep, *words).returncode == 0
    table, plain = table_of(tmp_path / "unit.csv"), table_of(tmp_path / "estimate.csv")
    edge = ["edge_level", "edge_low", "edge_high", "edge_measured"]
    assert [*table[0]][:7] == ["name", *edge, "layers.0.material", "layers.0.wall_mm"]
    assert [[row[key] for key in ("index", *edge)] for row in table] == [
        [row[key] for key in ("index", *edge)] for row in plain
    ]
    made = {row["index"]: row for row in rows(tmp_path / "estimate" / "pairs")}
    assert [float(row["edge_level"]) for row in table] == sorted(row["edge_level"] for row in made.values())
    for row in plain:
        assert float(row["edge_high"]) == made[int(row["index"])]["edge_high"]
    assert "layer1_mass_g" in table[0]
    assert "layer1_mass_g" not in plain[0]


def test_parquet_has_the_same_rows_with_numbers_as_numbers(sweep, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    for ending in ("csv", "parquet"):
        words = ("--only", "estimate", "-o", tmp_path / "o", "--table", tmp_path / f"t.{ending}")
        assert unitcad("batch", sweep, *words).returncode == 0
    read, plain = parquet.read_table(tmp_path / "t.parquet").to_pylist(), table_of(tmp_path / "t.csv")
    assert [{key: "" if value is None else str(value) for key, value in row.items()} for row in read] == plain
    assert isinstance(read[0]["edge_level"], float)
    assert isinstance(read[0]["index"], int)


def test_a_table_that_cannot_be_written_is_refused_before_anything_is_made(sweep, tmp_path, monkeypatch):
    done = unitcad("batch", sweep, "-o", tmp_path / "o", "--table", tmp_path / "t.xlsx")
    assert done.returncode == 2
    assert done.stderr.endswith(
        f"takes a file that ends in .csv or .parquet; nearest accepted: {str(tmp_path / 't.csv')!r}\n"
    )
    assert not (tmp_path / "o").exists()
    monkeypatch.setattr(level_table, "find_spec", lambda name: None)
    with pytest.raises(Missing, match=r"Parquet needs pyarrow: .*pip install.* pyarrow$"):
        check_table(tmp_path / "t.parquet")
    with pytest.raises(Refusal):
        check_table(tmp_path / "t")
