"""What the site has besides the pages of this folder.

Pages of the repository's root become pages of the site, and the public names
of each package a page of the API reference.
"""

from __future__ import annotations

import ast
import os
from pathlib import Path
import re
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("cns_drake", "evaluation")
# Root pages are below this folder of the site.
_PROJECT = "project"
_LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)\s]+)\)")


def on_files(files: Files, config: MkDocsConfig, **_: Any) -> Files:
    """Adds the pages of the root and those of the API reference."""
    for path in sorted(ROOT.glob("*.md")):
        text = path.read_text(encoding="utf-8")
        src = f"{_PROJECT}/{path.name}"
        files.append(File.generated(config, src, content=text))
    for package in PACKAGES:
        src = f"api/{package}.md"
        files.append(File.generated(config, src, content=_reference(package)))
    return files


def on_page_markdown(markdown: str, page: Page, files: Files, **_: Any) -> str:
    """Leads links to where the site has their target.

    Files of the repository that are no pages are named without a link.
    """
    src = page.file.src_uri
    folder = os.path.dirname(_in_repository(src))

    def moved(match: re.Match[str]) -> str:
        mark, label, target = match.groups()
        path, hash_mark, anchor = target.partition("#")
        if not path or "://" in path:
            return match[0]
        there = os.path.normpath(os.path.join(folder, path))
        found = _in_site(there)
        if files.get_file_from_path(found) is None:
            if not (ROOT / there).exists():
                return match[0]  # MkDocs reports it.
            return label
        way = os.path.relpath(found, os.path.dirname(src) or ".")
        return f"{mark}[{label}]({way}{hash_mark}{anchor})"

    return _LINK.sub(moved, markdown)


def _in_repository(src: str) -> str:
    """Returns the path in the repository of a page of the site."""
    own = src.removeprefix(f"{_PROJECT}/")
    return own if own != src else f"docs/{src}"


def _in_site(path: str) -> str:
    """Returns the path in the site of a page of the repository."""
    own = path.removeprefix("docs/")
    return own if own != path else f"{_PROJECT}/{path}"


def _reference(package: str) -> str:
    """Returns a page that has mkdocstrings explain the public names."""
    folder = ROOT / package
    text = (folder / "__init__.py").read_text(encoding="utf-8")
    stub = (folder / "__init__.pyi").read_text(encoding="utf-8")
    homes = {
        alias.name: node.module or ""
        for node in ast.parse(stub).body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    lines = [f"# {package}", "", ast.get_docstring(ast.parse(text)) or ""]
    for name in sorted({*homes} - {"__version__"}, key=str.lower):
        home = homes[name]
        if home.startswith("cns_drake") and package != "cns_drake":
            # A name has one place in the site.
            link = f"[{name} of cns_drake](cns_drake.md#{home}.{name})"
            lines += ["", f"## {name}", "", f"See {link}."]
        else:
            lines += ["", f"::: {home}.{name}"]
    return "\n".join([*lines, ""])
