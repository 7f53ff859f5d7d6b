"""Names in `stages.yaml` after a plan has grown."""

import csv
from pathlib import Path
import re
import shutil

from helpers.small_city import write_small_city
import pytest
from typer.testing import CliRunner
import yaml

from cns_drake.command_line import app
from evaluation.base import InputError
from worlds.city import generate_city

pytestmark = pytest.mark.slow

STAGES = """
# The first ones.
stages:
  "01":
    story: without office_001 and its like
    absent:
      houses: [office_001, 'brick_block_001']   # the "north"
      "trees: tree_001":
        - tree_001
        - &last tree_002
    lower:
      it: &grown {height: 6, structures: [office_051], but: [tree_*]}
      that: {<<: *grown, height: 9}
  "02": {story: all of it}
lots: {market: [office_051]}
"""
# Its structures have the first numbers.
DISTRICT = """
  - name: new_square
    area: [[-55, -105], [-15, -105], [-15, -55], [-55, -55]]
    buildings:
      - {archetype: office, at: [-35, -70], size: [16, 14], height: 20}
      - {archetype: brick_block, at: [-35, -95], size: [16, 12], height: 14}
    scatter: [{objects: {lime_tree: 1}, spacing: 12}]
"""


def rows_of(folder):
    with open(folder / "structures.csv", encoding="utf-8") as file:
        return {row["name"]: row for row in csv.DictReader(file)}


def place(row):
    return row["x"], row["y"], row["class"]


def insert(folder):
    plan = (folder / "city.yaml").read_text()
    first = "districts:\n"
    assert first in plan
    plan = plan.replace(first, first + DISTRICT.lstrip("\n"))
    (folder / "city.yaml").write_text(plan)


@pytest.fixture(scope="module")
def generated(tmp_path_factory):
    """A generated city, to copy."""
    folder = write_small_city(tmp_path_factory.mktemp("cities") / "small")
    (folder / "stages.yaml").write_text(STAGES)
    generate_city(folder)
    return folder


@pytest.fixture
def grown(generated, tmp_path):
    """A city whose plan has a new first district."""
    folder = shutil.copytree(generated, tmp_path / "small")
    insert(folder)
    return folder


@pytest.mark.night
def test_a_grown_plan_is_not_generated_with_the_old_names(grown):
    files = {path: path.read_bytes() for path in grown.glob("*.*")}
    with pytest.raises(
        InputError, match=r"stages.yaml: \w+ is \w+ now, and"
    ) as e:
        generate_city(grown)
    assert "--repair-stages" in str(e.value)
    assert files == {path: path.read_bytes() for path in grown.glob("*.*")}
    # Without a table the names stay; one of them no longer exists.
    (grown / "structures.csv").unlink()
    with pytest.raises(InputError, match="unknown structure tree_001"):
        generate_city(grown)


@pytest.mark.night
def test_names_follow_what_stays_where_it_is(grown):
    before = rows_of(grown)
    outcome = CliRunner().invoke(
        app, ["city", str(grown), "--repair-stages", "--check"]
    )
    assert outcome.exit_code == 1
    assert (grown / "stages.yaml").read_text() == STAGES
    assert str(grown / "stages.yaml") in outcome.output
    done = CliRunner().invoke(app, ["city", str(grown), "--repair-stages"])
    assert done.exit_code == 0, done.output
    after = rows_of(grown)
    text = (grown / "stages.yaml").read_text()
    # Each name is that of the structure at the old one's place.
    named = re.compile(
        r"(?<=[\[ '])(?:office|brick_block|tree)_\d+(?=[\],'\n])"
    )
    old, new = named.findall(STAGES), named.findall(text)
    assert len(old) == len(new) == 6
    for one, other in zip(old, new, strict=True):
        assert one != other
        assert place(before[one]) == place(after[other])
        assert f"{one} is {other} now" in outcome.output
    # All other text is unchanged.
    assert named.sub("", text) == named.sub("", STAGES)
    stages = yaml.safe_load(text)["stages"]
    assert "office_001" in stages["01"]["story"]
    assert "trees: tree_001" in stages["01"]["absent"]
    # A second run changes nothing.
    again = CliRunner().invoke(app, ["city", str(grown), "--repair-stages"])
    assert again.exit_code == 0
    assert " is " not in again.output
    assert (grown / "stages.yaml").read_text() == text


def test_missing_names_are_listed_and_nothing_written(grown):
    plan = (grown / "city.yaml").read_text()
    (grown / "city.yaml").write_text(
        plan.replace("at: [30, -21]", "at: [36, -21]")
    )
    lines = []
    with pytest.raises(InputError, match=r"1 structure.* such as office_051"):
        generate_city(grown, lines.append, repair_stages=True)
    assert "office_051 has no counterpart" in lines
    assert (grown / "stages.yaml").read_text() == STAGES


def test_patterns_that_match_others_are_noted(grown):
    text = STAGES.replace("tree_*", '"office_00?", "tree_*"')
    (grown / "stages.yaml").write_text(text)
    lines = []
    generate_city(grown, lines.append, repair_stages=True)
    # Trees that are new do not count.
    noted = [line for line in lines if "matches other" in line]
    assert noted == ["office_00? matches other structures than before"]
    assert "office_00?" in (grown / "stages.yaml").read_text()


@pytest.mark.night
def test_a_plan_that_has_not_grown_is_left_alone(generated, tmp_path):
    folder = shutil.copytree(generated, tmp_path / "small")
    generate_city(folder, repair_stages=True)
    for path in filter(Path.is_file, generated.rglob("*")):
        same = folder / path.relative_to(generated)
        assert same.read_bytes() == path.read_bytes()
    assert (folder / "stages.yaml").read_text() == STAGES


@pytest.mark.night
def test_a_faulty_table_is_no_hindrance_but_to_repair(tmp_path):
    folder = write_small_city(tmp_path / "small")
    (folder / "structures.csv").write_text("instance,name\n1,a\n")
    with pytest.raises(InputError, match=r"structures\.csv: .*class"):
        generate_city(folder, repair_stages=True)
    generate_city(folder)
    (folder / "structures.csv").unlink()
    with pytest.raises(InputError, match=r"structures\.csv: No such file"):
        generate_city(folder, repair_stages=True)
