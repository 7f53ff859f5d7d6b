"""The English of documents, comments, docstrings and messages."""

from __future__ import annotations

import ast
from collections.abc import Iterator
import itertools
from pathlib import Path
import re

import pytest

ROOT = Path(__file__).parents[2]

# The first word of a sentence, comment or docstring.
OPENING = re.compile(
    r'(?:"""|(?:#|[.!?:]["\')`]*)\s+(?:#\s+)?|\n\s*\n\s*)(Of|Who|So)\s+\S+'
)

# What only a person does.
PERSONAL = re.compile(
    r"\b(tells|told by|(?:is|are|was|not) told|knows|nobody|somebody)\b",
    re.IGNORECASE,
)

# A field of a docstring behind the end of another one's text.
HIDDEN_FIELD = re.compile(r"\n +\w[^\n]*\. ([a-z_]+:)\n")

# A bullet or a number of a list within a line.
INNER_BULLET = re.compile(r"[.:;]\s(?:- |\d\. )[A-Z]")

# One at the beginning of a line, which the lines of its text stand right of.
BULLET = re.compile(r"( *)(?:- |\d\. )")

# Fields whose text does not begin with its noun: "of the vehicle" says what a
# reader has yet to guess.
NOUNLESS_FIELD = re.compile(r"^ +(\w+(?:, \w+)*): of\b", re.MULTILINE)
MOST_NOUNLESS_FIELDS = 100

# What readers had to read twice, or a second name of a thing.
READ_TWICE = re.compile(
    r"need not be trusted|in place of one of the two drives|are left by"
    r"|structures more stand|recorded once a turn|counts once, under"
    r"|Sets H and O|in H, changed|recall at 100|recall_at_100_precision"
    r"|AUROC of queries|radius_told|through the stage of the"
    # False, for markets end when their lots are built on.
    r"|all structures of the (?:earlier|stage before)|stage lies within the one"
)

# Found text -> why it stays.
ALLOWED = {
    "Of a city drawn anew by cns-drake": "the mark of files, old ones too",
}


def texts(*patterns: str) -> list[Path]:
    return sorted(
        path
        for pattern in patterns
        for path in ROOT.glob(pattern)
        if not {"node_modules", "site"} & set(path.parts)
        and path != Path(__file__)
    )


def findings(pattern: re.Pattern[str], paths: list[Path]) -> list[str]:
    return [
        f"{path.relative_to(ROOT)}:{text.count(chr(10), 0, found.end()) + 1}:"
        f" {' '.join(found[0].split())}"
        for path in paths
        for text in [path.read_text(encoding="utf-8")]
        for found in pattern.finditer(text)
        if not text.startswith(tuple(ALLOWED), found.start(1))
    ]


CODE = ("cns_drake/**/*.py", "evaluation/**/*.py", "diagrams/*.py")
ALL_CODE = (*CODE, "tests/**/*.py", "docs/*.py")
DOCUMENTS = ("*.md", "docs/**/*.md", "worlds/**/*.md", "worlds/**/*.yaml")


def docstrings(paths: list[Path]) -> Iterator[tuple[str, str]]:
    """Yields the place and the text of each docstring."""
    for path in paths:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
                text = ast.get_docstring(node)
                if text is not None:
                    line = node.body[0].lineno
                    yield f"{path.relative_to(ROOT)}:{line}", text


def test_subjects_come_first():
    paths = texts(*ALL_CODE, *DOCUMENTS)
    assert len(paths) > 700
    assert findings(OPENING, paths) == []


def test_programs_do_not_know_or_tell():
    assert findings(PERSONAL, texts(*CODE, *DOCUMENTS)) == []


def joined(text: str) -> str:
    """Returns text as a reader sees it, without the quotes within a string."""
    return " ".join(re.sub(r'"\n\s*f?"', "", text).split())


def test_sentences_are_read_once_and_things_have_one_name():
    paths = texts(
        *CODE, *DOCUMENTS, "evaluation/**/*.html", "cns_drake/**/*.html"
    )
    found = {
        (path.name, match[0])
        for path in paths
        for match in READ_TWICE.finditer(
            joined(path.read_text(encoding="utf-8"))
        )
    }
    # The former names of columns, which are still read.
    former = {"radius_told", "recall_at_100_precision"}
    assert found == set(
        itertools.product(("csv_files.py", "CHANGELOG.md"), former)
    )
    assert joined('("What is"\n    f" kept")') == '("What is kept")'


@pytest.mark.parametrize(
    "text",
    [
        "# Of a kind.",
        '"""So it is.',
        "One. Who comes?",
        "One:\n    # So two.",
        "One.\n\nOf two",
    ],
)
def test_a_wrong_beginning_is_found(text):
    assert OPENING.search(text)


@pytest.mark.parametrize("text", ["Offset", "# Sofia", "Whose", "One of So"])
def test_other_words_are_left_alone(text):
    assert not OPENING.search(text)


def test_a_docstring_begins_with_one_line():
    long = [
        place
        for place, text in docstrings(texts(*ALL_CODE))
        if "\n" in text.split("\n\n")[0]
    ]
    assert long == []


def test_each_field_of_a_docstring_begins_a_line():
    assert findings(HIDDEN_FIELD, texts(*ALL_CODE)) == []
    text = "\n    a: the first. b:\n        the second.\n"
    assert HIDDEN_FIELD.search(text)[1] == "b:"


def lost_bullets(text: str) -> list[str]:
    """Returns the lines of a docstring whose lists were joined or cut."""
    lines = text.splitlines()
    found = [line for line in lines if INNER_BULLET.search(line)]
    for line, following in itertools.pairwise(lines):
        bullet = BULLET.match(line)
        if bullet and following.strip() and not BULLET.match(following):
            indent = len(following) - len(following.lstrip())
            # A heading of Drake's block of ports may follow its list.
            if indent <= len(bullet[1]) and not following.endswith(":"):
                found.append(following)
    return found


def test_lists_are_whole():
    assert [
        f"{place}: {line}"
        for place, text in docstrings(texts(*ALL_CODE))
        for line in lost_bullets(text)
    ] == []


def test_a_lost_bullet_is_noticed():
    assert lost_bullets("- One goes\n  on.\n- Two.\n\n1. a\n   b\n2. c") == []
    assert lost_bullets("- One. - Two.") == ["- One. - Two."]
    assert lost_bullets("Text:\n1. One\ngoes on.") == ["goes on."]


def test_fields_begin_with_their_nouns():
    found = [
        f"{place}: {field[1]}"
        for place, text in docstrings(texts(*CODE))
        for field in NOUNLESS_FIELD.finditer(text)
    ]
    assert len(found) < MOST_NOUNLESS_FIELDS, "\n".join(found)
