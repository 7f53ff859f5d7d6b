"""The README of a built package, and the addresses in it."""

import importlib.util
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = "https://example.org/owner/project"


@pytest.fixture(scope="module")
def build():
    spec = importlib.util.spec_from_file_location(
        "hatch_build", ROOT / "hatch_build.py"
    )
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("link", "expected"),
    [
        ("[a](docs/a.md)", f"[a]({PAGE}/blob/12/docs/a.md)"),
        ("[a](docs/a.md#b)", f"[a]({PAGE}/blob/12/docs/a.md#b)"),
        ("![p](docs/p.png)", f"![p]({PAGE}/raw/12/docs/p.png)"),
        ("[two\nlines](LICENSE)", f"[two\nlines]({PAGE}/blob/12/LICENSE)"),
        ("[here](#there)", "[here](#there)"),
        ("[d](https://d.org/e)", "[d](https://d.org/e)"),
    ],
)
def test_links_to_files_become_addresses(build, link, expected):
    assert build.with_addresses(link, PAGE, "12") == expected


def test_the_repository_is_that_of_the_workflow(build):
    names = {
        "GITHUB_SERVER_URL": "https://example.org",
        "GITHUB_REPOSITORY": "owner/project",
        "GITHUB_SHA": "12",
    }
    assert build.repository_page(names) == PAGE
    for name in names:
        assert build.repository_page(names | {name: ""}) is None
    assert build.repository_page({}) is None


@pytest.mark.parametrize("is_known", [False, True])
def test_metadata(build, monkeypatch, is_known):
    for name, value in (
        ("GITHUB_SERVER_URL", "https://example.org"),
        ("GITHUB_REPOSITORY", "owner/project"),
        ("GITHUB_SHA", "12"),
    ):
        if is_known:
            monkeypatch.setenv(name, value)
        else:
            monkeypatch.delenv(name, raising=False)
    metadata = {}
    hook = build.AddressesHook(str(ROOT), {"urls": {"Paper": "p"}})
    hook.update(metadata)
    text = (ROOT / "README.md").read_text()
    assert (metadata["readme"]["text"] == text) is not is_known
    assert metadata["urls"].pop("Paper") == "p"
    assert bool(metadata["urls"]) is is_known
    assert all(url.startswith(PAGE) for url in metadata["urls"].values())
