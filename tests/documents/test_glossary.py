"""The glossary names its sources."""

from helpers import documents
import pytest

TERMS = documents.table(
    documents.read("docs/glossary.md"), "## Terms of the field"
)


@pytest.mark.parametrize("row", TERMS, ids=[row[0] for row in TERMS])
def test_a_term_has_a_meaning_and_two_sources(row):
    term, meaning, _, sources = row
    assert len(meaning) > len(term)
    assert len(sources.split("; ")) >= 2, sources
