"""The glossary names sources, and pages say its terms."""

import re

from helpers import documents
import pytest

GLOSSARY = documents.read("docs/glossary.md")
TERMS = documents.table(GLOSSARY, "## Terms of the field")
# Earlier words that also have an everyday meaning, or another one.
EVERYDAY = {
    "aside",
    "correct pose",
    "description",
    "drawn",
    "fit",
    "hidden",
    "history",
    "judge",
    "kept",
    "merged scans",
    "plan",
    "room",
    "start",
    "survey",
    "truth",
    "twin",
}


def earlier_words(cell):
    return [word.strip() for word in cell.partition(":")[0].split(",")]


@pytest.mark.parametrize("row", TERMS, ids=[row[0] for row in TERMS])
def test_a_term_has_a_meaning_an_earlier_word_and_two_sources(row):
    term, meaning, earlier, sources = row
    assert len(meaning) > len(term)
    assert all(earlier_words(earlier))
    assert len(sources.split("; ")) >= 2, sources


@pytest.mark.parametrize(
    "page",
    [
        page
        for page in documents.pages()
        if page.name not in ("CHANGELOG.md", GLOSSARY.name)
    ],
    ids=lambda page: page.name,
)
def test_pages_do_not_say_earlier_words(page):
    words = {word for row in TERMS for word in earlier_words(row[2])}
    assert words >= EVERYDAY
    text = re.sub(r"`[^`]*`|--[\w-]+|\]\([^)]*\)", "", documents.prose(page))
    text = " ".join(text.split())
    found = [
        word
        for word in sorted(words - EVERYDAY)
        if re.search(rf"\b{word}(s|d)?\b", text, re.IGNORECASE)
    ]
    assert found == []
