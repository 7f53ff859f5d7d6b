"""The reference pages explain every field and option, as the code has it."""

import re

from helpers import documents
import pytest

from cns_drake.scenarios import Scenario
from docs import reference_pages
from docs.reference_pages import CITY, EXPERIMENT, LIDAR, METHODS, SCENARIO
from worlds.city import ARCHETYPES
from worlds.shapes import OBJECTS

NAMES = sorted(path.name for path in reference_pages.FOLDER.iterdir())
# Each once, in one order for all processes of a run.
MODELS = [
    *dict.fromkeys(
        model
        for sections in (SCENARIO, LIDAR, CITY, EXPERIMENT)
        for model in sections.values()
    )
]
MODELS += METHODS.values()


@pytest.fixture(scope="module")
def pages():
    return reference_pages.pages()


@pytest.mark.parametrize("name", NAMES)
def test_page_is_current(name, pages):
    path = reference_pages.FOLDER / name
    assert path.read_text() == pages[name], (
        "write it anew: .venv/bin/python docs/reference_pages.py"
    )


def test_no_other_page_is_there(pages):
    assert sorted(pages) == NAMES


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.__name__)
def test_every_field_is_explained(model):
    _, meanings = reference_pages.explain_fields(model)
    fields = reference_pages.own_fields(model)
    assert meanings.keys() == fields.keys()
    assert all(len(meaning) > 3 for meaning in meanings.values())


def test_every_model_has_a_table():
    found = set()
    waiting = list(MODELS)
    while waiting:
        model = waiting.pop()
        found.add(model)
        for field in model.model_fields.values():
            inner = set(reference_pages.models_in(field.annotation))
            waiting += inner - found
    assert found == set(MODELS)


def test_a_row_has_default_and_limits():
    page = documents.read("docs/reference/scenario.md").text
    for line in (
        "- `xyz` (3 numbers from -1000 to 1000; `[0, 0, 1.6]`): position",
        "- `columns` (integer from 4 to 8192): number",
        "- `returns` (`ideal`, `calibrated`; `ideal`): ",
        "- `name` (text; the file's name): name",
    ):
        assert f"\n{line}" in page
    _, _, drive = page.partition("\n## Scenario\n")
    fields = re.findall(r"(?m)^- `(\w+)`", drive.partition("\n## ")[0])
    assert fields == list(Scenario.model_fields)


@pytest.mark.parametrize(
    ("heading", "registry"),
    [("### Archetypes", ARCHETYPES), ("### Objects", OBJECTS)],
)
def test_what_can_be_placed_is_listed(heading, registry):
    page = documents.read("docs/city.md")
    _, _, rest = page.text.partition(f"\n{heading}\n")
    section = documents.Page(page.name, rest.partition("\n#")[0])
    listed = [piece.text for piece in documents.inline(section)]
    assert sorted(listed) == sorted(registry)
