"""Every command and example of the documents runs, and does what it says."""

from dataclasses import replace

from helpers import documents
from helpers.document_recipes import NOT_RUN, RECIPES
from helpers.document_workplace import Workplace, claims
import pytest


@pytest.fixture(scope="module")
def workplace(tmp_path_factory):
    workplace = Workplace(tmp_path_factory.mktemp("reader"))
    yield workplace
    workplace.close()


@pytest.mark.slow
@pytest.mark.parametrize("name", RECIPES)
def test_it_runs(name, workplace):
    printed = workplace.follow(name)
    for text in RECIPES[name].prints:
        assert text in printed
    for pattern in RECIPES[name].makes:
        assert list(workplace.folder.glob(pattern)), pattern


def test_each_piece_has_one_recipe():
    pieces = [
        piece for page in documents.pages() for piece in documents.pieces(page)
    ]
    claimed = {piece: claims(piece) for piece in pieces}
    faults = [
        f"{piece.place}: {len(names)} tests run this: {piece.text}"
        for piece, names in claimed.items()
        if len(names) != 1
    ]
    assert not faults, "\n".join(faults)
    names = [name for names in claimed.values() for name in names]
    assert sorted(names) == sorted([*RECIPES, *NOT_RUN.values()])


@pytest.mark.parametrize(
    "text",
    [
        "```\n.venv/bin/cns-drake dance\n```",
        "- a list:\n\n  ```bash\n  ls\n  ```",
        "```yaml\nmap: nowhere\n```",
        "Type `cns-drake scan --twice` now.",
        "Type `cns-drake\nscan --twice` now.",
        "| `dask scheduler` | starts |",
    ],
)
def test_new_pieces_are_noticed(text):
    page = documents.read("docs/how-to/own_city.md")
    before = documents.pieces(page)
    longer = replace(page, text=f"{page.text}\n{text}\n")
    (new,) = set(documents.pieces(longer)) - set(before)
    assert claims(new) == []
    assert new.line > max(piece.line for piece in before)


def test_names_of_commands_are_not_run():
    text = "See `cns-drake scan`, or `--help`, or `a.py`."
    assert documents.pieces(documents.Page("a.md", text)) == []
