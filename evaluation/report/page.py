"""The report as one page, which needs neither a network nor other files."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
import json
from pathlib import Path
from typing import get_args

from markupsafe import Markup

from cns_drake.base.files import completing
from evaluation.change.drive_change import (
    ChangeResult,
    symmetric_changes,
)
from evaluation.recognition.fault_kinds import FAULT_KINDS, PairEvidence
from evaluation.recognition.metrics import MODES
from evaluation.recognition.place_recognition import RecognitionResult
from evaluation.recognition.survival import Survival
from evaluation.report.page_data import (
    Illustration,
    PageDrive,
    Section,
    browser_data,
)
from evaluation.report.page_routes import (
    BAR_LENGTH,
    route_colours,
    route_picture,
)
from evaluation.report.page_survival import survival_groups
from evaluation.report.page_templates import read_asset, render
from evaluation.report.reference import Judgement
from evaluation.report.survival_tables import (
    SURVIVAL_CAPTION,
    survival_summary,
)
from evaluation.report.tables import Table

_MEDIA_TYPES = {"svg": "image/svg+xml", "webp": "image/webp"}
# Name of a section -> its heading, in the order of the page.
_SECTIONS = {
    "survival": "Survival",
    "summary": "Summary",
    "maps": "Maps",
    "change": "Change",
    "recognition": "Recognition",
    "figures": "Figures",
    "browser": "Queries",
}
# Each script uses only those before it.
_SCRIPTS = ("state.js", "pictures.js", "page.js")


@dataclass(frozen=True)
class PageContent:
    """All that the page shows.

    Attributes:
        notes: cities without a pair to compare.
        judgements: claims and their verdicts.
        beside: source of the published numbers beside ours; empty for none.
        changes: TCR of all pairs.
        change: Table I.
        recognition: all forms of Table II; the last but one is that of mode
            all.
        audit: all numbers.
        why: reasons for wrong best places.
        evidence: (database, query) -> evidence of these reasons.
        poses: errors of the poses that methods estimate.
        costs: of the methods; without rows if they were not measured.
        illustrations: figures, already written.
        recognitions: place recognition of all pairs.
        survivals: the same with their controls.
        drives: name -> drive, for all drives of a pair.
        pages: drive -> address, relative to the page, of the page of its
            recording; drives without a page may be left out.
    """

    notes: Sequence[str]
    judgements: Sequence[Judgement]
    beside: str
    changes: Sequence[ChangeResult]
    change: Table
    recognition: Sequence[Table]
    audit: Table
    why: Table
    evidence: Mapping[tuple[str, str], PairEvidence]
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
    data = None
    if content.recognitions:
        data = browser_data(
            content.recognitions,
            content.drives,
            symmetric_changes(content.changes),
            content.pages,
            content.evidence,
        )
    illustrations = _by_section(content.illustrations)
    drives_of_maps = _drives_of_maps(content)
    tables = content.recognition[1:]
    modes = MODES[len(MODES) - len(tables) :]
    has_section = {
        "survival": bool(content.survivals),
        "summary": True,
        "maps": bool(drives_of_maps),
        "change": bool(content.change.rows or illustrations["change"]),
        "recognition": bool(content.recognitions),
        "figures": bool(illustrations["figures"]),
        "browser": bool(content.recognitions),
    }
    text = render(
        "page.html",
        content=content,
        sections={n: w for n, w in _SECTIONS.items() if has_section[n]},
        illustrations=illustrations,
        data_of=_data_address,
        survival_groups=survival_groups(content.survivals),
        survival_summary=survival_summary(content.survivals),
        survival_caption=SURVIVAL_CAPTION,
        facts=_facts(content),
        drives_of_maps=drives_of_maps,
        route_picture=route_picture,
        route_colours=route_colours(),
        route_bar=round(BAR_LENGTH),
        modes=list(zip(modes, tables, strict=True)),
        fault_kinds=FAULT_KINDS,
        style=read_asset("page.css"),
        script=Markup("\n").join(map(read_asset, _SCRIPTS)),
        data=_to_script(data),
    )
    with completing(path) as part:
        part.write_text(text, encoding="utf-8")


def _by_section(
    illustrations: Sequence[Illustration],
) -> dict[Section, list[Illustration]]:
    return {
        section: [one for one in illustrations if one.section == section]
        for section in get_args(Section)
    }


def _facts(content: PageContent) -> list[tuple[str, int]]:
    """Returns the labels and numbers of maps, pairs and methods."""
    maps = {result.map_name for result in content.changes}
    pairs = {result.pair for result in content.recognitions}
    methods = {result.method for result in content.recognitions}
    return [
        ("maps", len(maps)),
        ("pairs of stages", len(content.changes)),
        ("database → query", len(pairs)),
        ("methods", len(methods)),
    ]


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


def _data_address(one: Illustration) -> str:
    """Returns a data URL that contains the figure."""
    path = one.stem.with_name(f"{one.stem.name}.{one.page_kind}")
    data = base64.b64encode(path.read_bytes()).decode("ascii")
    return f"data:{_MEDIA_TYPES[one.page_kind]};base64,{data}"


def _to_script(data: dict | None) -> Markup:
    """Returns JSON that cannot end the script element around it."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    return Markup(text.replace("<", "\\u003c"))
