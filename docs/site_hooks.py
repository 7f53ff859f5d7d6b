"""What the site has besides the pages of this folder.

Pages of the repository's root and notebooks become pages of the site, and the
public names of each package a page of the API reference. A drive and a report
to look at are in the site if they were made before (see CONTRIBUTING.md), as
the workflow `site.yml` does.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
import json
import os
from pathlib import Path
import re
from typing import Any

from latex2mathml.converter import convert
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("cns_drake", "evaluation", "worlds")
# Root pages are below this folder of the site.
_PROJECT = "project"
# What a visitor can look at: page below `live` in the site -> its link. The
# files are in a folder of the same layout.
LIVE = ROOT / "output/live"
_LIVE_PAGES = {
    "drive.html": "a drive through Suburbia, with the points of its LiDAR",
    "report/index.html": "the report on what a rebuilt city costs each method",
}
# What stands in index.md where the links are.
_LIVE_MARK = "<!-- live -->"
# Where `nav` in mkdocs.yml has the tab of the API reference.
_API_TAB = -2
# How much more a page of a tab counts in a search, and one of another tab.
_SEARCH_BOOSTS = {"How to": 4.0, "Start": 3.0, "Results": 2.0, "Reference": 1.5}
_SEARCH_BOOST = 0.5
# Code in a line, and blocks of commands; blocks of a language have elements.
_PLAIN_CODE = re.compile(r"<code>[^<]*</code>")
_WITH_HYPHEN = re.compile(r"[^\s<>]{,40}-[^\s<>]{,40}")
_FORMULA = re.compile(r"^( *)```math\n(.*?)\n *```$", re.DOTALL | re.MULTILINE)
_LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)\s]+)\)")


def on_files(files: Files, config: MkDocsConfig, **_: Any) -> Files:
    """Adds the pages of the root and those of the API reference."""
    for path in sorted(ROOT.glob("*.md")):
        text = path.read_text(encoding="utf-8")
        src = f"{_PROJECT}/{path.name}"
        files.append(File.generated(config, src, content=text))
    for package in PACKAGES:
        for path, text in _reference(package).items():
            files.append(File.generated(config, f"api/{path}", content=text))
    for notebook in (ROOT / "docs").glob("*/*.ipynb"):
        src = f"{notebook.parent.name}/{notebook.stem}.md"
        cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
        text = "\n\n".join(part for cell in cells for part in _parts(cell))
        files.append(File.generated(config, src, content=text))
    for path in _live_pages():
        made = str(LIVE / path)
        files.append(File.generated(config, f"live/{path}", abs_src_path=made))
    return files


def on_config(config: MkDocsConfig, **_: Any) -> MkDocsConfig:
    """Lists the pages of the API reference in the menu, links the repository.

    A workflow names the repository that it builds the site of.
    """
    assert config.nav is not None
    server, name = (
        os.environ.get(f"GITHUB_{key}") for key in ("SERVER_URL", "REPOSITORY")
    )
    if server and name:
        config.repo_url, config.repo_name = f"{server}/{name}", name
    for package in PACKAGES:
        own, *modules = _reference(package)
        entries: list[Any] = [f"api/{own}"]
        entries += [
            {Path(path).stem: f"api/{path}"} for path in sorted(modules)
        ]
        config.nav[_API_TAB]["Python"].append({package: entries})
    return config


def on_page_markdown(markdown: str, page: Page, files: Files, **_: Any) -> str:
    """Sets formulas, and leads links to where the site has their target.

    Files of the repository that are no pages are named without a link. Also
    sets how high a page ranks in a search: what helps you to do something comes
    first.
    """
    page.meta.setdefault("search", _search_rank(page))
    markdown = markdown.replace(_LIVE_MARK, _live_links())
    markdown = _FORMULA.sub(_set, markdown)
    src = page.file.src_uri
    folder = os.path.dirname(_in_repository(src))

    def moved(match: re.Match[str]) -> str:
        mark, label, target = match.groups()
        path, hash_mark, anchor = target.partition("#")
        if not path or "://" in path:
            return match[0]
        there = os.path.normpath(os.path.join(folder, path))
        found = _in_site(there)
        if target.startswith("live/"):
            return match[0]
        if files.get_file_from_path(found) is None:
            if not (ROOT / there).exists():
                return match[0]  # MkDocs reports it.
            return label
        way = os.path.relpath(found, os.path.dirname(src) or ".")
        return f"{mark}[{label}]({way}{hash_mark}{anchor})"

    return _LINK.sub(moved, markdown)


def on_page_content(html: str, **_: Any) -> str:
    """Keeps lines from breaking in names, in options and before %."""
    return _PLAIN_CODE.sub(
        lambda code: _WITH_HYPHEN.sub(
            r'<span class="whole">\g<0></span>', code[0]
        ),
        re.sub(r"(?<=\d) %", "&nbsp;%", html),
    )


def _live_pages() -> list[str]:
    """Returns those live pages that were made."""
    return [path for path in _LIVE_PAGES if (LIVE / path).is_file()]


def _live_links() -> str:
    """Returns a sentence that leads to the live pages."""
    links = [f"[{_LIVE_PAGES[path]}](live/{path})" for path in _live_pages()]
    if not links:
        return ""
    return (
        f"**Look before you install**, in your browser: {' and '.join(links)}."
    )


def _search_rank(page: Page) -> dict[str, Any]:
    """Returns the settings of a page for the theme's search."""
    path = page.file.src_uri
    if path == f"{_PROJECT}/CHANGELOG.md":
        return {"exclude": True}
    parents = {one.title for one in page.ancestors}
    if path.startswith("reference/"):
        parents.add("Reference")
    for tab, boost in _SEARCH_BOOSTS.items():
        if tab in parents:
            return {"boost": boost}
    return {"boost": _SEARCH_BOOST}


def _set(block: re.Match[str]) -> str:
    """Returns a formula as MathML, which browsers set without a script."""
    indent, latex = block.groups()
    formula = convert(latex, display="block")
    return f'{indent}<div class="formula">{formula}</div>'


def _parts(cell: dict[str, Any]) -> Iterator[str]:
    """Yields the Markdown of a notebook's cell, and of its outputs."""
    source = "".join(cell["source"])
    is_code = cell["cell_type"] == "code"
    yield f"```python\n{source}\n```" if is_code else source
    for output in cell.get("outputs", ()):
        data = output.get("data", {})
        if "text" in output:
            yield f"```text\n{''.join(output['text'])}```"
        if "image/png" in data:
            image = "".join(data["image/png"]).replace("\n", "")
            yield f'<img alt="" src="data:image/png;base64,{image}">'


def _in_repository(src: str) -> str:
    """Returns the path in the repository of a page of the site."""
    own = src.removeprefix(f"{_PROJECT}/")
    return own if own != src else f"docs/{src}"


def _in_site(path: str) -> str:
    """Returns the path in the site of a page of the repository."""
    own = path.removeprefix("docs/")
    if own.endswith(".ipynb"):
        return own.replace(".ipynb", ".md")
    return own if own != path else f"{_PROJECT}/{path}"


def _reference(package: str) -> dict[str, str]:
    """Returns the pages that explain the public names, one for each module.

    The key is the page's path below `api/`. The first page is the package's
    own: it lists the names of all modules.
    """
    folder = ROOT / package
    text = (folder / "__init__.py").read_text(encoding="utf-8")
    stub = (folder / "__init__.pyi").read_text(encoding="utf-8")
    homes = {
        alias.name: f"{package}.{node.module}"
        for node in ast.parse(stub).body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
        if alias.name != "__version__"
    }
    pages: dict[str, str] = {}
    rows = []
    for name in sorted(homes, key=str.lower):
        home = homes[name]
        module = ".".join(home.split(".")[:2])
        path = module.replace(".", "/") + ".md"
        rows.append(f"| [{name}]({path}#{home}.{name}) | `{module}` |")
        pages.setdefault(path, f"# {module}\n")
        pages[path] += f"\n::: {home}.{name}\n"
    lines = [f"# {package}", "", ast.get_docstring(ast.parse(text)) or "", ""]
    lines += ["| name | module |", "|---|---|", *rows, ""]
    return {f"{package}.md": "\n".join(lines), **pages}
