"""The report as one page, which needs neither a network nor other files."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import html
from importlib import resources
import json
from pathlib import Path
import re

from evaluation.files import completing
from evaluation.findings import Finding
from evaluation.page_data import Illustration, PageDrive, browser_data
from evaluation.results import (
    ChangeResult,
    RecognitionResult,
    symmetric_changes,
)
from evaluation.tables import Table

_MEDIA_TYPES = {"svg": "image/svg+xml", "webp": "image/webp"}
_SLOT = re.compile(r"\{\{(\w+)\}\}")


@dataclass(frozen=True)
class PageContent:
    """All that the page shows.

    Attributes:
        findings: of the paper, judged.
        changes: TCR of all pairs.
        change: Table I.
        recognition: Table II in its forms.
        audit: all numbers.
        illustrations: figures, already written.
        recognitions: place recognition of all pairs.
        drives: name -> drive, all that occur in a pair.
    """

    findings: Sequence[Finding]
    changes: Sequence[ChangeResult]
    change: Table
    recognition: Sequence[Table]
    audit: Table
    illustrations: Sequence[Illustration]
    recognitions: Sequence[RecognitionResult]
    drives: Mapping[str, PageDrive]


def write_page(path: Path, content: PageContent) -> None:
    """Writes the page.

    Raises:
        InputError: if it cannot be written.
    """
    slots = {
        "style": _template("page.css"),
        "script": _template("page.js"),
        "summary": _summary(content),
        "tables": _tables(content),
        "figures": _figures(content.illustrations),
        "browser": "",
        "data": "null",
    }
    if content.recognitions:
        slots["browser"] = _template("browser.html")
        data = browser_data(
            content.recognitions,
            content.drives,
            symmetric_changes(content.changes),
        )
        slots["data"] = _to_script(data)
    # One pass: what is put in is not searched for slots.
    text = _SLOT.sub(lambda m: slots[m[1]], _template("page.html"))
    with completing(path) as part:
        part.write_text(text, encoding="utf-8")


def _summary(content: PageContent) -> str:
    maps = {result.map_name for result in content.changes}
    pairs = {result.pair for result in content.recognitions}
    methods = {result.method for result in content.recognitions}
    facts = [
        ("maps", len(maps)),
        ("pairs of stages", len(content.changes)),
        ("database → query", len(pairs)),
        ("methods", len(methods)),
    ]
    parts = ['<ul class="facts">']
    parts += [f"<li>{what} <b>{n}</b></li>" for what, n in facts]
    parts.append("</ul>")
    if content.findings:
        parts.append('<dl class="findings">')
        for one in content.findings:
            kind = one.verdict.replace(" ", "-")
            parts.append(
                f"<dt>{html.escape(one.claim)}"
                f' <span class="verdict {kind}">{one.verdict}</span></dt>'
                f"<dd>{html.escape(one.evidence)}</dd>"
            )
        parts.append("</dl>")
    return "".join(parts)


def _tables(content: PageContent) -> str:
    parts = []
    if content.change.rows:
        parts.append("<h2>Table I: temporal change ratio</h2>")
        parts.append(_scrolling(content.change))
    if content.recognitions:
        parts.append("<h2>Table II: place recognition</h2>")
        parts.append(_scrolling(content.recognition[0]))
        for name, table in (
            ("All methods in mode all", content.recognition[1]),
            ("All methods in mode filtered", content.recognition[2]),
            ("All numbers: intervals, N, T, TP", content.audit),
        ):
            parts.append(
                f"<details><summary>{name}</summary>{_scrolling(table)}"
                "</details>"
            )
    return "".join(parts)


def _scrolling(table: Table) -> str:
    return (
        f"<p>{html.escape(table.caption)}</p>"
        f'<div class="scrolling" tabindex="0">{table.to_html()}</div>'
    )


def _figures(illustrations: Sequence[Illustration]) -> str:
    parts = []
    for one in illustrations:
        path = one.stem.with_name(f"{one.stem.name}.{one.page_kind}")
        data = base64.b64encode(path.read_bytes()).decode("ascii")
        title = html.escape(one.title, quote=True)
        parts.append(
            '<figure><div class="scrolling" tabindex="0"><img'
            f' alt="{title}" src="data:{_MEDIA_TYPES[one.page_kind]};base64,'
            f'{data}"></div><figcaption>{title}</figcaption></figure>'
        )
    return "".join(parts)


def _template(name: str) -> str:
    folder = resources.files("evaluation").joinpath("page_template")
    return folder.joinpath(name).read_text("utf-8")


def _to_script(data: dict) -> str:
    """Returns JSON that cannot end the script element it stands in."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c")
