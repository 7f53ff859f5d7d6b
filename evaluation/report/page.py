"""A report: its tables as files, its text, and its page.

The page needs neither a network nor other files.
"""

import base64
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
import functools
from pathlib import Path
from urllib.parse import quote

import jinja2
from markupsafe import Markup

from cns_drake.base.complete_files import write_text
from cns_drake.base.files import natural_key
from evaluation.change.drive_change import symmetric_changes
from evaluation.recognition.fault_names import FAULT_KINDS, fault_words
from evaluation.recognition.metrics import MODES, Mode
from evaluation.recognition.place_outcome import PlaceOutcome
from evaluation.report import ranking
from evaluation.report.contents import Report
from evaluation.report.illustrations import Illustration
from evaluation.report.page_data import browser_data
from evaluation.report.reference import NO_REFERENCE, Reference
from evaluation.report.route_pictures import (
    BAR_LENGTH,
    route_colours,
    route_picture,
)
from evaluation.report.tables import survival
from evaluation.report.tables.change import change_table
from evaluation.report.tables.costs import cost_numbers, cost_table
from evaluation.report.tables.differences import (
    difference_numbers,
    difference_table,
)
from evaluation.report.tables.faults import fault_numbers, fault_table
from evaluation.report.tables.poses import pose_error_numbers, pose_table
from evaluation.report.tables.queries import query_table
from evaluation.report.tables.recognition import (
    audit_table,
    metric_numbers,
    recognition_table,
    sessions_table,
)
from evaluation.results.charts.markers import marker_corners
from evaluation.results.page_frame import (
    PageSection,
    environment,
    framed_page,
    read_asset,
)
from evaluation.results.styles import method_styles
from evaluation.results.table_forms import (
    MISSING,
    Table,
    by_pair,
    escape_markdown,
    in_table_order,
    title,
)

_TEMPLATES = "page_template"
# Number of colours in the legend of a route.
_LEGEND_COLOURS = 9
_TITLE = "Structural change and place recognition"
_MEDIA_TYPES = {"svg": "image/svg+xml", "webp": "image/webp"}
# Name of a section -> its heading, in the order of the page.
_SECTIONS = {
    "summary": "Ranking",
    "survival": "Survival",
    "maps": "Maps",
    "change": "Change",
    "recognition": "Recognition",
    "figures": "Figures",
    "browser": "Queries",
}
# The sections that are shown from the start, as is an only section.
_OPEN = ("summary", "browser")
_SCRIPTS = ("state.js", "pictures.js", "page.js")


def write_report(
    report: Report, folder: Path, *, with_tables: bool = False
) -> Path:
    """Writes the page and the text of a report.

    Args:
        report: the report.
        folder: folder to write.
        with_tables: whether to write the wide tables, too.

    Returns:
        The path of `report.html`.

    Raises:
        InputError: a file cannot be written.
    """
    tables = _shown_tables(report)
    if with_tables:
        _write_tables(report, tables, folder)
    text = _render("report.md", **_content(report, tables))
    write_text(folder / "report.md", text.rstrip() + "\n")
    path = folder / "report.html"
    write_page(path, report)
    return path


def _write_tables(
    report: Report, tables: Mapping[str, Sequence[Table]], folder: Path
) -> None:
    """Writes wide tables, which are views of the results."""
    results = report.recognitions
    every = [*results, *report.repeated]
    queries = query_table(results, report.tracks, report.evidence)
    # Evidence is of the queries that the other results got wrong.
    again = query_table(report.repeated, report.tracks, {})
    numbers = {
        "survival": survival.survival_numbers(report.survivals),
        "tcr": change_table(report.changes, report.reference, report.evidence),
        "place_recognition": audit_table(every, report.reference),
        "poses": pose_error_numbers(results),
        "metrics": metric_numbers(every),
        "differences": difference_numbers(report.differences),
        "why": fault_numbers(results, report.evidence),
        "query_details": replace(queries, rows=queries.rows + again.rows),
        "query_details_unchanged": query_table(
            [
                replace(control, pair=changed.pair)
                for changed, control in report.pairs
                if control
            ],
            report.tracks,
            {},
        ),
    }
    if report.costs:
        numbers["costs"] = cost_numbers(report.costs)
    for name, table in numbers.items():
        table.write_csv(folder / f"{name}.csv")
        if name not in ("why", "differences") and name in tables:
            forms = {
                "md": map(_captioned, tables[name]),
                "tex": (shown.to_latex() for shown in tables[name]),
            }
            for ending, texts in forms.items():
                write_text(folder / f"{name}.{ending}", "\n".join(texts))


def write_page(path: Path, report: Report) -> None:
    """Writes the web page of a report.

    Raises:
        InputError: the page cannot be written.
    """
    data = None
    if report.recognitions:
        data = browser_data(
            report.recognitions,
            report.drives,
            symmetric_changes(report.changes),
            report.pages,
            report.evidence,
        )
    tables = _shown_tables(report)
    illustrations = defaultdict(list)
    for illustration in report.illustrations:
        illustrations[illustration.section].append(illustration)
    drives_of_maps = _drives_of_maps(report)
    forms = [f"All methods in mode {mode}" for mode in MODES]
    if report.compared:
        forms.append(f"Beside {report.reference.title}")
    forms_of_table = zip(forms, tables["place_recognition"], strict=True)
    content = _content(report, tables)
    has_section = {
        "summary": any(
            content[name]
            for name in ("headline", "survival_summary", "judgements")
        )
        or bool(report.pages),
        "survival": bool(report.survivals),
        "maps": bool(drives_of_maps),
        "change": bool(tables["tcr"][0].rows or illustrations["change"]),
        "recognition": bool(report.recognitions),
        "figures": bool(illustrations["figures"]),
        "browser": bool(report.recognitions),
    }
    values = {
        **content,
        "illustrations": illustrations,
        "survivals_by_pair": by_pair(report.survivals),
        "drives_of_maps": drives_of_maps,
        "other_forms": list(forms_of_table)[1:],
        # Without a match in the database, no answer is wrong.
        "fault_kinds": {kind: fault_words(kind) for kind in FAULT_KINDS[1:]},
        "image_step": data["imageStep"] if data else 1,
    }
    sections = [
        PageSection(
            name,
            word,
            Markup(_render(f"section_{name}.html", **values)),
            is_open=name in _OPEN or sum(has_section.values()) == 1,
        )
        for name, word in _SECTIONS.items()
        if has_section[name]
    ]
    text = framed_page(
        _TITLE,
        _TITLE,
        Markup(_render("intro.html", **values)),
        sections,
        made_by=report.made_by,
        style=read_asset(__package__, _TEMPLATES, "page.css"),
        scripts=[
            read_asset(__package__, _TEMPLATES, name) for name in _SCRIPTS
        ],
        data=data,
    )
    write_text(path, text)


def _shown_tables(report: Report) -> dict[str, list[Table]]:
    """Returns the tables for print of each file, by the file's name."""
    results = report.recognitions
    # The last one is counted as the reference did.
    counted: list[tuple[Sequence[PlaceOutcome], Mode | None, Reference]] = [
        (results, mode, NO_REFERENCE) for mode in MODES
    ]
    if report.compared:
        counted.append((report.compared, None, report.reference))
    changes = change_table(report.changes, report.reference, report.evidence)
    return {
        "survival": [survival.survival_table(report.survivals)],
        "tcr": [changes.without_empty("paper")],
        "place_recognition": [
            recognition_table(
                shown, report.changes, mode, reference, report.evidence
            )
            for shown, mode, reference in counted
        ],
        "differences": [difference_table(report.differences)],
        "why": [fault_table(results, report.evidence)],
        "poses": [pose_table(results)],
        "costs": [cost_table(report.costs)],
        # A printed table has a single protocol.
        "audit": [
            audit_table(shown, report.reference)
            for shown in (results, report.repeated)
            if shown or shown is results
        ],
        "sessions": [sessions_table(report.sessions)],
    }


def _content(
    report: Report, tables: Mapping[str, Sequence[Table]]
) -> dict[str, object]:
    """Returns the values for the templates of the text and of the page."""
    ranked, headline = ranking.ranked_methods(
        report.results, report.differences
    )
    measured = [report.recognitions, report.repeated]
    return {
        "report": report,
        "tables": tables,
        "protocols": [
            f"{words}: {shown[0].protocol_name}"
            for shown, words in zip(
                measured,
                (
                    "Protocol of this report",
                    f"Protocol of {report.reference.title}",
                ),
                strict=True,
            )
            if shown
        ],
        "ranked": ranked,
        "beside": ranking.further_columns(report.results),
        "styles": method_styles(in_table_order(mean.method for mean in ranked)),
        "headline": headline if report.pairs else "",
        "judgements": report.reference.judge(
            [*report.recognitions, *report.repeated], report.changes
        ),
        "survival_summary": survival.survival_summary(report.survivals),
    }


def _captioned(table: Table) -> str:
    return f"{escape_markdown(table.caption)}\n\n{table.to_markdown()}"


def _drives_of_maps(report: Report) -> dict[str, list[str]]:
    """Returns the drives of each map, in the order of stages.

    A drive that is in no pair stands under its own name.
    """
    found: dict[str, dict[str, str]] = {}
    for result in report.recognitions:
        names = (result.database, result.query)
        found.setdefault(result.pair[0], {}).update(
            zip(result.pair[1:], names, strict=True)
        )
    groups = {
        map_name: [stages[stage] for stage in sorted(stages, key=natural_key)]
        for map_name, stages in found.items()
    }
    placed = {name for names in groups.values() for name in names}
    groups.update({n: [n] for n in report.drives if n not in placed})
    return groups


def _data_address(illustration: Illustration) -> str:
    """Returns a data URL that contains the figure."""
    path = illustration.stem.with_name(
        f"{illustration.stem.name}.{illustration.page_kind}"
    )
    data = base64.b64encode(path.read_bytes()).decode("ascii")
    return f"data:{_MEDIA_TYPES[illustration.page_kind]};base64,{data}"


def _render(name: str, /, **values: object) -> str:
    """Returns a template filled with values; HTML and SVG escape their text."""
    return _environment().get_template(name).render(values)


@functools.cache
def _environment() -> jinja2.Environment:
    found = environment(
        __package__,
        _TEMPLATES,
        {
            "captioned": _captioned,
            "corners": marker_corners,
            "data_address": _data_address,
            "interval_text": survival.interval_text,
            "markdown": escape_markdown,
            "method_title": title,
            "percent": survival.percent,
            "quoted": quote,
            "route_picture": route_picture,
        },
    )
    found.globals |= {
        "bar_length": round(BAR_LENGTH),
        "missing": MISSING,
        "no_control": survival.NO_CONTROL,
        "route_colours": route_colours(_LEGEND_COLOURS),
    }
    return found
