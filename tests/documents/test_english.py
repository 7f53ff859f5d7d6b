"""The English of documents, comments, docstrings and messages."""

from __future__ import annotations

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
    r"\b(?:tells|told by|is told|are told|knows|nobody|somebody)\b"
)

# File -> why a person does it there, or who else gave the word.
ALLOWED = {
    "tests/documents/test_english.py": "this list",
    "CHANGELOG.md": "names of old releases",
}


def texts(*patterns: str) -> list[Path]:
    return sorted(
        path
        for pattern in patterns
        for path in ROOT.glob(pattern)
        if str(path.relative_to(ROOT)) not in ALLOWED
        and not {"node_modules", "site"} & set(path.parts)
    )


def findings(pattern: re.Pattern[str], paths: list[Path]) -> list[str]:
    return [
        f"{path.relative_to(ROOT)}:{text.count(chr(10), 0, found.end()) + 1}:"
        f" {' '.join(found[0].split())}"
        for path in paths
        for text in [path.read_text(encoding="utf-8")]
        for found in pattern.finditer(text)
    ]


CODE = ("cns_drake/**/*.py", "evaluation/**/*.py", "diagrams/*.py")
DOCUMENTS = ("*.md", "docs/**/*.md", "worlds/**/*.md", "worlds/**/*.yaml")


def test_subjects_come_first():
    paths = texts(*CODE, *DOCUMENTS, "tests/**/*.py", "docs/*.py")
    assert len(paths) > 900
    assert findings(OPENING, paths) == []


def test_programs_do_not_know_or_tell():
    assert findings(PERSONAL, texts(*CODE, *DOCUMENTS)) == []


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
