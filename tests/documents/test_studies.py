"""What the page on studies says of experiments and tables is so."""

import itertools
import re

from helpers import documents
import pytest
import yaml

from cns_drake.studies import TASKS
from evaluation.results import Results, Row
from evaluation.study import Experiment, load_experiment, shipped_experiments

PAGE = documents.read("docs/studies.md")


def codes(text):
    return re.findall(r"`([^`]+)`", text)


def first_codes(title):
    rows = documents.table(PAGE, title)
    return [name for row in rows for name in codes(row[0])]


def test_shipped_experiments_are_listed_with_their_questions():
    rows = documents.table(PAGE, "| experiment | question | findings |")
    said = {codes(row[0])[0]: row[1] for row in rows}
    assert said == {n: load_experiment(n).about for n in shipped_experiments()}


def test_experiments_that_pages_name_ship():
    named = {
        piece.text.split()[2]
        for page in documents.pages()
        for piece in documents.inline(page)
        if re.fullmatch(r"cns-drake study [a-z-]+", piece.text)
    }
    assert named
    assert named <= shipped_experiments().keys()


def test_tasks_and_their_settings_are_listed():
    rows = documents.table(PAGE, "## Tasks and metrics")
    assert [codes(row[0])[0] for row in rows] == list(TASKS)
    for row in rows:
        task = TASKS[codes(row[0])[0]]
        named = re.findall(r"`(\w+)`: ", row[2])
        assert sorted(named) == sorted(task.defaults)
        assert bool(named) == (row[2] != "none")


def test_columns_of_the_table_of_results_are_listed():
    key = {
        **dict.fromkeys(("experiment", "map", "database", "query"), "a"),
        **{"seed": 1, "factors": {}, "task": "place", "method": "a"},
        **{"verified": False, "protocol": "random-yaw"},
    }
    said = first_codes("## The table of results")
    row = Row(**key, metric="auc", value=1.0)
    assert {*said, "factors"} == set(Row.__dataclass_fields__)
    assert Results.of([row]).rows == (row,)


@pytest.mark.parametrize(
    ("page", "start", "number"),
    [
        ("docs/studies.md", "name: season-and-age", 8),
        ("docs/studies.md", "about: What do leaves", 7),
        ("docs/studies.md", "name: how-many-drives", 4),
        ("docs/studies.md", "name: fleet", 3),
        ("docs/studies.md", "name: my-sessions", 6),
        ("docs/tutorial.md", "maps: riverside", 3),
    ],
)
def test_examples_have_their_conditions(tmp_path, page, start, number):
    (block,) = (
        block.text
        for block in documents.fenced(documents.read(page))
        if block.text.startswith(start)
    )
    path = tmp_path / "example.yaml"
    path.write_text(block)
    found = load_experiment(path).conditions
    assert len(found) == number
    assert sum(one.baseline == one.factors for one in found) == 1
    # No two are the same.
    for a, b in itertools.combinations(found, 2):
        assert a.factors != b.factors


def test_the_question_of_the_page_is_the_file_beside_it():
    (block,) = (
        block.text
        for block in documents.fenced(PAGE)
        if block.text.startswith("name: season-and-age")
    )
    path = documents.ROOT / "docs/examples/season_and_age.yaml"
    assert yaml.safe_load(block) == yaml.safe_load(path.read_text())


def test_inline_examples_load(tmp_path):
    found = 0
    for page in documents.pages():
        for piece in documents.inline(page):
            if re.match(r"tasks: \{|- \{kind: ", piece.text):
                path = tmp_path / "example.yaml"
                path.write_text(piece.text)
                assert load_experiment(path).tasks
                found += 1
    assert found
    line = next(
        piece.text
        for piece in documents.inline(PAGE)
        if piece.text.startswith("{name: old")
    )
    made = Experiment.model_validate(
        {"name": "a", "maps": [yaml.safe_load(line)]}
    )
    assert made.maps[0].years == 20


@pytest.mark.parametrize(
    ("name", "number", "years"),
    [("sessions", 12, 20), ("maintenance", 6, 20), ("eight_sessions", 6, 40)],
)
def test_examples_of_several_drives_have_one_query(name, number, years):
    """Whatever the database, the city of the query has the same age."""
    path = documents.ROOT / f"docs/examples/{name}.yaml"
    found = load_experiment(path).conditions
    assert len(found) == number
    for one in (*found, *load_experiment(path, quick=True).conditions):
        assert one.changes["query"]["city"]["years"] == years
