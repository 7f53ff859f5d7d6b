"""First stages at random, and stages by years, of small towns."""

import csv
import re

from helpers.small_cityjson import CityWriter, write_blocks
from helpers.small_osm import OsmWriter
import numpy as np
import pytest
from typer.testing import CliRunner
import yaml

from cns_drake.command_line import app
from evaluation.base import InputError
from worlds.imports import ImportOptions, import_city


def run(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


def names(folder, stage):
    text = (folder / f"stage_{stage}.sdf").read_text()
    return set(re.findall('visual name="([^"/]+)', text))


def write_rows(path, extra=0):
    """Five rows of eight touching houses of 12 m, and ten single ones."""
    city = CityWriter()
    for row in range(5):
        for k in range(8):
            city.box(f"row.{row}.{k}", 10.0 * k, 40.0 * row, (10.0, 10.0, 12.0))
    for k in range(10 + extra):
        city.box(f"alone.{k}", 120.0, 25.0 * k, (10.0, 10.0, 5.0))
    return city.write(path)


@pytest.mark.parametrize(("part", "seed"), [(0.3, 0), (0.3, 1), (0.7, 0)])
def test_a_part_is_not_there_yet_or_lower(tmp_path, part, seed):
    source = write_rows(tmp_path / "city.json")
    folder = tmp_path / "town"
    report = import_city(source, folder, ImportOptions(grow=part, seed=seed))
    drawn = yaml.safe_load((folder / "import.yaml").read_text())
    drawn = drawn["first_stage_at_random"]
    missing, lower = set(drawn["missing"]), drawn["part_of_height"]
    assert len(missing) + len(lower) == round(50 * part)
    assert not missing & set(lower)
    whole = names(folder, "02")
    assert len(whole) == 51
    expected = (whole - missing - set(lower)) | {f"{n}_lower" for n in lower}
    assert names(folder, "01") == expected
    assert report.stages == {"01": 50 - len(missing), "02": 50}
    # Only high buildings were lower before, and they stand on the ground.
    assert all(name.startswith("row") for name in lower)
    for name, share in lower.items():
        text = (folder / "meshes" / f"{name}_body_lower.obj").read_text()
        z = [float(line.split()[3]) for line in text.splitlines()
             if line.startswith("v ")]  # fmt: skip
        assert min(z) == 0.0
        assert max(z) == pytest.approx(12.0 * share, abs=1e-3)
        assert 0.4 <= share <= 0.7
    # Half of the volume goes in whole rows of houses.
    changed = missing | set(lower)
    rows = [sum(n.startswith(f"row.{k}.") for n in changed) for k in range(5)]
    assert rows.count(8) >= (1 if part < 0.5 else 2)
    with (folder / "structures.csv").open() as stream:
        listed = [row["name"] for row in csv.DictReader(stream)]
    assert len(listed) == len(set(listed)) == 51 + len(lower)


@pytest.mark.slow
def test_the_lot_is_that_of_the_seed(tmp_path):
    source = write_rows(tmp_path / "city.json")
    drawn = []
    for name, seed in (("a", 3), ("b", 3), ("c", 4)):
        import_city(source, tmp_path / name, ImportOptions(grow=0.3, seed=seed))
        facts = yaml.safe_load((tmp_path / name / "import.yaml").read_text())
        drawn.append(facts["first_stage_at_random"])
    assert drawn[0] == drawn[1]
    assert drawn[0]["missing"] != drawn[2]["missing"]


@pytest.mark.slow
@pytest.mark.night
def test_a_city_without_years_has_two_stages_and_two_drives(tmp_path):
    source = write_blocks(tmp_path / "blocks.json", years=False)
    result = run("import", source, "--output", tmp_path / "town")
    assert result.exit_code == 0, result.output
    found = {path.name for path in (tmp_path / "town").glob("*.yaml")}
    assert found == {
        "import.yaml", "sequence_01.yaml", "sequence_02.yaml",
        "other_01.yaml", "other_02.yaml",
    }  # fmt: skip
    plain = run("import", source, "--plain", "--output", tmp_path / "plain")
    assert plain.exit_code == 0, plain.output
    assert "one stage; give --years or --grow" in plain.output
    assert not (tmp_path / "plain" / "stage_02.sdf").exists()
    last = (tmp_path / "town" / "stage_02.sdf").read_text()
    only = (tmp_path / "plain" / "stage_01.sdf").read_text()
    standing = [
        dict.fromkeys(re.findall('visual name="([^/"]+)', text))
        for text in (last, only)
    ]
    # All buildings, and the objects added along the streets.
    of_file = [name for name in standing[0] if name in standing[1]]
    assert of_file == list(standing[1])


@pytest.mark.parametrize(
    ("options", "fault"),
    [
        (["--grow", "0.3", "--plain"], "--grow: not with --plain"),
        (["--grow", "0.3", "--years", "1950", "1980"], "--grow: --years"),
    ],
)
def test_options_that_exclude_each_other(tmp_path, options, fault):
    source = write_rows(tmp_path / "city.json")
    result = run("import", source, *options, "--output", tmp_path / "town")
    assert isinstance(result.exception, InputError)
    assert str(result.exception).startswith(fault)


def test_demolished_buildings_stood_in_their_time(tmp_path):
    osm = OsmWriter()
    boxes = {
        "old": {"building": "yes", "start_date": "1890"},
        "gone": {"building": "demolished", "start_date": "C19",
                 "end_date": "1944-03"},
        "razed": {"razed__building": "house", "end_date": "~1970"},
        "sold": {"building": "yes", "start_date": "1900", "end_date": "1950s"},
        "when": {"building": "demolished"},
        "where": {"was__building": "yes"},
        "short": {"building": "yes", "start_date": "1961", "end_date": "1969"},
    }  # fmt: skip
    number = {
        name: osm.box(40.0 * k, 0, 10, 10, **tags)
        for k, (name, tags) in enumerate(boxes.items())
    }
    source = osm.write(tmp_path / "city.osm")
    report = import_city(
        source, tmp_path / "town", ImportOptions((1900, 1960, 2000))
    )
    standing = {"01": "old gone razed sold", "02": "old razed", "03": "old"}
    for stage, some in standing.items():
        expected = {f"building_w{number[name]}" for name in some.split()}
        assert names(tmp_path / "town", stage) == {*expected, "ground"}
    kinds = {kind: example for kind, _, example in report.faults}
    assert kinds == {
        "demolished building, left out": f"w{number['when']}",
        "was:building, left out": f"w{number['where']}",
        "building that stood between stages, left out": (
            f"building_w{number['short']}"
        ),
    }
    report = import_city(source, tmp_path / "today", ImportOptions())
    assert names(tmp_path / "today", "01") == {
        f"building_w{number['old']}", "ground",
    }  # fmt: skip
    counts = {kind: count for kind, count, _ in report.faults}
    assert counts["building demolished, left out"] == 4
    assert np.isclose(report.stages["01"], 1)


def write_gone(path):
    """Writes three houses; two replaced others."""
    osm = OsmWriter()
    number = {
        "old": osm.box(0, 0, 10, 10, building="yes"),
        "razed": osm.box(40, 0, 10, 10, razed__building="yes"),
        "new": osm.box(43, 2, 10, 10, building="yes"),
        "was": osm.box(80, 0, 10, 10, was__building="yes", start_date="1950"),
        "dated": osm.box(82, 0, 9, 9, building="yes", start_date="1990"),
        "part": osm.box(83, 1, 2, 2, building__part="yes", height="30"),
        "historic": osm.box(120, 0, 10, 10, historic__building="yes"),
        "until": osm.box(160, 0, 9, 9, razed__building="yes", end_date="1980"),
    }
    return number, osm.write(path / "city.osm")


@pytest.mark.parametrize(
    ("undated", "first", "second", "third"),
    [
        # In 2000 the house of 1990 was there, and its predecessor was not.
        ("first", "old razed was historic until",
         "old razed dated historic", "old new dated"),
        ("last", "was", "razed historic dated", "old new dated"),
        ("never", "was", "dated", "dated"),
    ],
)  # fmt: skip
def test_demolished_buildings_without_a_date_stood_before_the_last_stage(
    tmp_path, undated, first, second, third
):
    number, source = write_gone(tmp_path)
    options = ImportOptions((1960, 2000, 2020), undated=undated, dressed=True)
    import_city(source, tmp_path / "town", options)
    for stage, some in (("01", first), ("02", second), ("03", third)):
        expected = {f"building_w{number[name]}" for name in some.split()}
        found = names(tmp_path / "town", stage)
        assert {name for name in found if "building" in name} == expected


def test_the_first_stage_by_lot_has_demolished_buildings(tmp_path):
    number, source = write_gone(tmp_path)
    import_city(
        source, tmp_path / "town", ImportOptions(grow=0.01, dressed=True)
    )
    name = {key: f"building_w{value}" for key, value in number.items()}
    first, last = (
        {one for one in names(tmp_path / "town", stage) if "building" in one}
        for stage in ("01", "02")
    )
    assert last == {name["old"], name["new"], name["dated"]}
    gone = [name["razed"], name["historic"], name["until"]]
    assert first == {name["old"], name["dated"], *gone}
    facts = yaml.safe_load((tmp_path / "town" / "import.yaml").read_text())
    assert facts["first_stage_at_random"]["missing"] == [name["new"]]
    assert sorted(facts["first_stage_at_random"]["gone_since"]) == sorted(gone)
    plain = import_city(source, tmp_path / "plain", ImportOptions())
    counts = {kind: count for kind, count, _ in plain.faults}
    assert sum(n for kind, n in counts.items() if ":building" in kind) == 3
