"""The documents hang together: links lead somewhere, the README is short."""

import re

from helpers import documents
import pytest

PAGES = {page.name: page for page in documents.pages()}


@pytest.mark.parametrize("page", PAGES.values(), ids=PAGES)
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)]+)\)", documents.prose(page)):
        if target.startswith("https://"):
            continue
        file, _, anchor = target.partition("#")
        linked = follow(page, file) if file else page.name
        assert (documents.ROOT / linked).exists(), target
        if anchor:
            assert anchor in documents.anchors(PAGES[linked]), target


def follow(page, file):
    """Returns the path from the root of the project of what a page names."""
    path = (documents.ROOT / page.name).parent / file
    # Else it would lead out of the project.
    return str(path.resolve().relative_to(documents.ROOT))


def test_pages_are_reached_from_the_readme():
    reached = set()
    waiting = {"README.md"}
    while waiting:
        page = PAGES[waiting.pop()]
        reached.add(page.name)
        linked = re.findall(r"\]\(([\w./-]+\.md)", page.text)
        waiting |= {follow(page, file) for file in linked} - reached
    assert reached == PAGES.keys()
