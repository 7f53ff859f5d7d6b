"""Every command and example of the documents runs, and does what it says."""

import re
import shlex

from helpers import documents
from helpers.document_recipes import NOT_RUN, RECIPES
from helpers.document_workplace import Workplace, claims, daily
import pytest
from typer.main import get_command

from cns_drake import command_line as drake_cli
from evaluation import command_line as eval_cli

DAILY = daily()


@pytest.fixture(scope="module")
def workplace(tmp_path_factory):
    workplace = Workplace(tmp_path_factory.mktemp("reader"))
    yield workplace
    workplace.close()


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=() if name in DAILY else pytest.mark.night)
        for name in RECIPES
    ],
)
def test_it_runs(name, workplace):
    printed = workplace.follow(name)
    for text in RECIPES[name].prints:
        assert text in printed
    for pattern in RECIPES[name].makes:
        assert list(workplace.folder.glob(pattern)), pattern


def test_words_of_all_commands_are_understood():
    """Also of those that do not run, or only at night."""
    programs = {
        "cns-drake": get_command(drake_cli.app),
        "cns-eval": get_command(eval_cli.app),
    }
    line = re.compile(r"(?m)(cns-drake|cns-eval) ([a-z-]+.*?)(?=$|&&|#|\|)")
    number = 0
    for page in documents.pages():
        for piece in documents.pieces(page):
            if piece.language not in ("", "bash", "inline"):
                continue
            text = piece.text.replace("\\\n", " ")
            for name, rest in line.findall(text):
                words = shlex.split(rest)
                context = programs[name].make_context(name, list(words))
                command = programs[name].resolve_command(context, words)[1]
                try:
                    command.make_context(words[0], words[1:], context)
                except Exception as error:
                    # A sentence may mention a command without its drives.
                    is_short = type(error).__name__ == "MissingParameter"
                    assert is_short, piece.place
                    assert piece.language == "inline", piece.place
                number += 1
    assert number > 100


def test_the_day_has_a_use_of_each_command():
    text = " ".join(
        piece.text
        for page in documents.pages()
        for piece in documents.pieces(page)
        for name in claims(piece)
        if name in DAILY
    )
    for program, app in (("drake", drake_cli.app), ("eval", eval_cli.app)):
        for name in get_command(app).commands:
            # They need minutes; test_training trains, and test_film films.
            if name not in ("train", "film"):
                assert f"cns-{program} {name}" in text


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
    assert set(names) == {*RECIPES, *NOT_RUN.values()}
    assert all(names.count(name) == 1 for name in RECIPES)
