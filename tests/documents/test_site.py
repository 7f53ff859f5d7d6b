"""The site is built without a broken link, and has every page and name."""

from html.parser import HTMLParser
import json
import os
from pathlib import Path
import re
import subprocess
import sys
from urllib.parse import unquote, urlparse

from helpers import documents
from helpers.browser import chromium, has_chromium
import pytest

import cns_drake
import evaluation

COMMAND = (sys.executable, "-m", "mkdocs", "build", "--strict")
# By day, `test_links` follows the links of the sources.
pytestmark = [pytest.mark.slow, pytest.mark.night]


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    built = subprocess.run(
        # With -q it would not count warnings.
        [*COMMAND, "--site-dir", folder],
        cwd=documents.ROOT,
        env=os.environ | {"NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
    )
    assert built.returncode == 0, built.stderr
    return folder


class Links(HTMLParser):
    """What a page links to, shows and has anchors for."""

    def __init__(self, path):
        super().__init__()
        self.targets = set()
        self.anchors = set()
        self.scripts = set()
        self.feed(path.read_text())

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        self.anchors.add(values.get("id"))
        if tag == "script":
            self.scripts.add(values.get("src"))
        if tag in ("a", "img", "script", "link"):
            self.targets.add(values.get("href") or values.get("src"))


def test_every_link_leads_somewhere(site):
    pages = {path: Links(path) for path in site.rglob("*.html")}
    shown = 0
    for path, page in pages.items():
        if path.name == "404.html":
            continue  # The address does not matter.
        for target in page.targets - {None}:
            parts = urlparse(target)
            if parts.scheme or parts.netloc:
                assert target not in page.scripts, (path, target)
                continue
            there = path
            if parts.path:
                there = Path(
                    os.path.normpath(path.parent / unquote(parts.path))
                )
            assert there.exists(), (path, target)
            if parts.fragment and there in pages:
                anchor = unquote(parts.fragment)
                assert anchor in pages[there].anchors, (path, target)
            shown += there.suffix in (".jpg", ".png")
    assert shown > 20


def test_every_page_is_in_it(site):
    for page in documents.pages():
        name = page.name.removeprefix("docs/")
        own = name if name != page.name else f"project/{name}"
        html = Path(own.removesuffix(".md") + ".html")
        if html.name == "README.html":
            html = html.with_name("index.html")
        assert (site / html).exists(), page.name


def test_every_public_name_is_explained(site):
    explained = set()
    examples = 0
    pages = sorted((site / "api").rglob("*.html"))
    for path in pages:
        explained |= {str(a).rpartition(".")[2] for a in Links(path).anchors}
        # Examples are blocks of code.
        examples += bool(
            re.search(
                r"<summary>Example</summary>\s*<div class=.highlight",
                path.read_text(),
            )
        )
    names = {*cns_drake.__all__, *evaluation.__all__} - {"__version__"}
    assert names <= explained
    assert examples > 2
    # One page for each module, all of them in the menu.
    menu = (site / "api/cns_drake/sensors.html").read_text()
    assert len(pages) > 10
    for path in pages:
        link = os.path.relpath(path, site / "api/cns_drake")
        assert f'href="{link}"' in menu, link


def test_search_finds_methods_and_names(site):
    index = json.loads((site / "search/search_index.json").read_text())
    titles = {entry["title"] for entry in index["docs"]}
    assert {"add_lidar", "Layered overlap", "Tutorial"} <= titles


@pytest.mark.skipif(not has_chromium(), reason="no Chromium")
def test_search_works_from_a_folder(site, tmp_path):
    with chromium(tmp_path) as browser:
        browser.open((site / "tutorial.html").as_uri(), 1300, 900)
        browser.evaluate(
            "document.querySelector('#__search').click();"
            "const field = document.querySelector('input[name=query]');"
            "field.value = 'add_lidar';"
            "field.dispatchEvent(new Event('input', {bubbles: true}));"
            "field.dispatchEvent(new KeyboardEvent('keyup', {bubbles: true}))"
        )
        links = "[...document.querySelectorAll('.md-search-result__link')]"
        browser.wait_for(f"{links}.length > 0")
        found = browser.evaluate(f"{links}.map((link) => link.href)")
        assert any(one.endswith("sensors.add_lidar") for one in found)
        assert browser.complaints == []
