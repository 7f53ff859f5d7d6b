"""The report as one page, which needs neither a network nor other files."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
import html
from importlib import resources
import json
from pathlib import Path
import re

from cns_drake.base.files import completing
from evaluation.change.change_result import (
    ChangeResult,
    symmetric_changes,
)
from evaluation.recognition.metrics import MODES
from evaluation.recognition.recognition_result import RecognitionResult
from evaluation.recognition.survival import Survival
from evaluation.report.page_data import (
    Illustration,
    PageDrive,
    Section,
    browser_data,
)
from evaluation.report.page_routes import route_legend, route_picture
from evaluation.report.page_survival import survival_section
from evaluation.report.reference import Finding, Judgement
from evaluation.report.tables import Table

_MEDIA_TYPES = {"svg": "image/svg+xml", "webp": "image/webp"}
_SLOT = re.compile(r"\{\{(\w+)\}\}")
# In the order in which they rely on one another.
_SCRIPTS = ("state.js", "pictures.js", "page.js")


@dataclass(frozen=True)
class PageContent:
    """All that the page shows.

    Attributes:
        notes: of which cities there is nothing to compare.
        judgements: claims, judged.
        beside: whose numbers stand beside; empty for none.
        changes: TCR of all pairs.
        change: Table I.
        recognition: Table II in its forms, that of mode all last but one.
        audit: all numbers.
        poses: how good the poses are that come with the places.
        costs: of the methods; without rows if they were not measured.
        illustrations: figures, already written.
        recognitions: place recognition of all pairs.
        survivals: the same with their controls.
        drives: name -> drive, all that occur in a pair.
        pages: drive -> address, relative to the page, of its recording to
            look around in; drives without one may be left out.
    """

    notes: Sequence[str]
    judgements: Sequence[Judgement]
    beside: str
    changes: Sequence[ChangeResult]
    change: Table
    recognition: Sequence[Table]
    audit: Table
    poses: Table
    costs: Table
    illustrations: Sequence[Illustration]
    recognitions: Sequence[RecognitionResult]
    survivals: Sequence[Survival]
    drives: Mapping[str, PageDrive]
    pages: Mapping[str, str] = field(default_factory=dict)


def write_page(path: Path, content: PageContent) -> None:
    """Writes the page.

    Raises:
        InputError: if it cannot be written.
    """
    browser, data = "", None
    if content.recognitions:
        browser = _template("browser.html")
        data = browser_data(
            content.recognitions,
            content.drives,
            symmetric_changes(content.changes),
            content.pages,
        )
    chart = _figures(content.illustrations, "survival")
    sections = [
        ("survival", "Survival", survival_section(content.survivals, chart)),
        ("summary", "Summary", _summary(content)),
        ("maps", "Maps", _maps(content)),
        ("change", "Change", _change(content)),
        ("recognition", "Recognition", _recognition(content)),
        ("figures", "Figures", _figures(content.illustrations, "figures")),
        ("browser", "Queries", browser),
    ]
    sections = [section for section in sections if section[2]]
    slots = {
        "lead": _lead(content),
        "style": _template("page.css"),
        "script": "\n".join(_template(name) for name in _SCRIPTS),
        "links": "".join(
            f'<a href="#{name}">{word}</a>' for name, word, _ in sections
        ),
        "sections": "\n".join(
            f'<section id="{name}">{inner}</section>'
            for name, _, inner in sections
        ),
        "data": _to_script(data),
    }
    # One pass: what is put in is not searched for slots.
    text = _SLOT.sub(lambda m: slots[m[1]], _template("page.html"))
    with completing(path) as part:
        part.write_text(text, encoding="utf-8")


def _lead(content: PageContent) -> str:
    """Returns what the page is about, and the way to the single queries."""
    text = (
        "How much cities changed between drives, and how well LiDAR place"
        " recognition copes"
    )
    if content.beside:
        text += f", beside the numbers of {html.escape(content.beside)}"
    lead = f"<p>{text}.</p>"
    lead += "".join(f"<p>{html.escape(note)}</p>" for note in content.notes)
    if content.recognitions:
        lead += (
            '<p class="links"><a href="#browser">Look at every query, one by'
            " one</a></p>"
        )
    return lead


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
    parts = ['<h2>Summary</h2><ul class="facts">']
    parts += [f"<li>{what} <b>{n}</b></li>" for what, n in facts]
    parts.append("</ul>")
    if content.changes:
        parts.append(
            "<p>TCR_sym says how much changed between two drives: 0 where"
            " nothing did, 1 where everything did.</p>"
        )
    for one in content.judgements:
        parts.append(f"<h3>{html.escape(one.heading)}</h3>")
        parts.append(_judged(one.findings))
    if content.pages:
        parts.append('<h3>Recordings to look around in</h3><p class="links">')
        parts += [
            _link(address, name) for name, address in content.pages.items()
        ]
        parts.append("</p>")
    return "".join(parts)


def _judged(found: Sequence[Finding]) -> str:
    parts = ['<dl class="findings">']
    for one in found:
        kind = one.verdict.replace(" ", "-")
        parts.append(
            f"<dt>{html.escape(one.claim)}"
            f' <span class="verdict {kind}">{one.verdict}</span></dt>'
            f"<dd>{html.escape(one.evidence)}</dd>"
        )
    parts.append("</dl>")
    return "".join(parts)


def _maps(content: PageContent) -> str:
    parts = []
    for map_name, drives in _drives_of_maps(content).items():
        parts.append(f'<h3>{html.escape(map_name)}</h3><div class="maps">')
        for name in drives:
            caption = html.escape(name)
            if name in content.pages:
                link = _link(content.pages[name], "look around in 3-D")
                caption = f"{caption} {link}"
            picture = route_picture(content.drives[name])
            parts.append(_figure(picture, caption))
        parts.append("</div>")
    if not parts:
        return ""
    return (
        "<h2>Maps and routes</h2><p>Each drive over the map that its own"
        f" scans make, from above.</p>{route_legend()}{''.join(parts)}"
    )


def _drives_of_maps(content: PageContent) -> dict[str, list[str]]:
    """Returns map -> its drives, in the order of stages.

    A drive that is in no pair stands under its own name.
    """
    found: dict[str, dict[str, str]] = {}
    for result in content.recognitions:
        names = (result.outcome.database, result.outcome.query)
        found.setdefault(result.map_name, {}).update(
            zip(result.stages, names, strict=True)
        )
    groups = {
        map_name: [stages[stage] for stage in sorted(stages)]
        for map_name, stages in found.items()
    }
    placed = {name for names in groups.values() for name in names}
    groups.update({n: [n] for n in content.drives if n not in placed})
    return groups


def _change(content: PageContent) -> str:
    parts = []
    if content.change.rows:
        parts.append("<h2>Table I: temporal change ratio</h2>")
        parts.append(_scrolling(content.change, "plain"))
    figures = _figures(content.illustrations, "change")
    if figures:
        parts.append(f"<h2>What changed</h2>{figures}")
    return "".join(parts)


def _recognition(content: PageContent) -> str:
    if not content.recognitions:
        return ""
    parts = ["<h2>Table II: place recognition</h2>"]
    parts.append(_scrolling(content.recognition[0], "grouped"))
    names = [f"All methods in mode {mode}" for mode in MODES]
    names = names[-(len(content.recognition) - 1) :]
    for name, table, kind in (
        *(
            (name, table, "grouped")
            for name, table in zip(names, content.recognition[1:], strict=True)
        ),
        ("All numbers: intervals, N, T, TP", content.audit, "plain audit"),
    ):
        parts.append(
            f"<details><summary>{name}</summary>{_scrolling(table, kind)}"
            "</details>"
        )
    parts.append(_figures(content.illustrations, "recognition"))
    parts.append("<h2>Pose, not only place</h2>")
    parts.append(_scrolling(content.poses, "grouped"))
    if content.costs.rows:
        parts.append("<h2>What the methods cost</h2>")
        parts.append(_scrolling(content.costs, "plain"))
    return "".join(parts)


def _scrolling(table: Table, kind: str) -> str:
    """Returns a table with its caption.

    Args:
        table: of which the first two columns say what a row is of.
        kind: classes of style: "grouped", "plain", or "plain audit".
    """
    return (
        f"<p>{html.escape(table.caption)}</p>"
        f'<div class="scrolling table {kind}" tabindex="0">'
        f"{table.to_html()}</div>"
    )


def _figures(illustrations: Sequence[Illustration], section: Section) -> str:
    parts = []
    for one in illustrations:
        if one.section != section:
            continue
        path = one.stem.with_name(f"{one.stem.name}.{one.page_kind}")
        data = base64.b64encode(path.read_bytes()).decode("ascii")
        title = html.escape(one.title, quote=True)
        picture = (
            f'<img alt="{title}" style="--panels:{one.num_panels}"'
            f' src="data:{_MEDIA_TYPES[one.page_kind]};base64,{data}">'
        )
        caption = title
        if one.num_panels > 1:
            caption += ' <span class="swipe">(swipe for all panels)</span>'
        if one.legend:
            caption += "<br>"
        for colour, word in one.legend:
            caption += (
                '<span class="entry"><span class="key"'
                f' style="background:rgb{colour}"></span>'
                f"{html.escape(word)}</span>"
            )
        parts.append(_figure(picture, caption))
    heading = "<h2>Figures</h2>" if parts and section == "figures" else ""
    return heading + "".join(parts)


def _figure(picture: str, caption: str) -> str:
    """Returns a figure with a switch that makes it as large as it is.

    A check box does it: no script is needed, and the address stays.
    """
    return (
        f'<figure><div class="scrolling" tabindex="0">{picture}</div>'
        f"<figcaption>{caption}"
        ' <label class="enlarge"><input type="checkbox">'
        "<span>full size</span></label></figcaption></figure>"
    )


def _link(address: str, text: str) -> str:
    return (
        f'<a href="{html.escape(address, quote=True)}">{html.escape(text)}</a>'
    )


def _template(name: str) -> str:
    folder = resources.files(__name__.rpartition(".")[0]).joinpath(
        "page_template"
    )
    return folder.joinpath(name).read_text("utf-8")


def _to_script(data: dict | None) -> str:
    """Returns JSON that cannot end the script element it stands in."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c")
