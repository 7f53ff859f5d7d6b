"""A report: its tables as files, its text, and its page.

The page needs neither a network nor other files.
"""

import base64
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
import functools
import itertools
from pathlib import Path
from urllib.parse import quote

import jinja2
from markupsafe import Markup
from matplotlib import colormaps
from matplotlib.colors import to_hex, to_rgb
import numpy as np

from cns_drake.base.complete_files import write_text
from cns_drake.base.errors import InputError
from cns_drake.base.listing import natural_key
from evaluation.change.drive_change import ChangeResult, symmetric_changes
from evaluation.recognition.costs import Cost
from evaluation.recognition.fault_kinds import (
    FAULT_KINDS,
    PairEvidence,
    fault_words,
)
from evaluation.recognition.metrics import MODES, Mode
from evaluation.recognition.place_outcome import PlaceOutcome
from evaluation.report import conclusions, result_tables
from evaluation.report.map_figures import ROUTE_COLOURS
from evaluation.report.page_data import (
    Illustration,
    PageDrive,
    Section,
    browser_data,
)
from evaluation.report.reference import NO_REFERENCE, Reference
from evaluation.results.charts import draw, styles
from evaluation.results.drawing import save
from evaluation.results.page_frame import (
    PageSection,
    environment,
    framed_page,
    read_asset,
)
from evaluation.results.table import OWN, STAGE, Results
from evaluation.results.table_forms import (
    MISSING,
    Table,
    by_pair,
    escape_markdown,
    in_table_order,
    title,
)

_TEMPLATES = "page_template"
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
# The sections that are shown from the start.
_OPEN = ("summary", "browser")
_SCRIPTS = ("state.js", "pictures.js", "page.js")
# Number of pieces of one colour in a drawn route.
_NUM_PIECES = 48
# Size of the marks of start and end, as a part of the picture.
_MARK = 0.016
# Length of the scale bar [m].
_BAR_LENGTH = 50.0
_SCATTER = {"kind": "scatter", "x": "tcr_sym", "y": "auc"}
# Controls, in which nothing changes, show no trend.
_CHANGED: dict[str, str] = {**_SCATTER, STAGE: OWN}
_DUMBBELL = {"kind": "dumbbell", "over": STAGE, "metric": "auc"}
_SURVIVAL = "AUC without and with the change, and the share that is retained"
# Width of charts [px].
_WIDTH = 480


@dataclass
class Report:
    """The contents of a report.

    Attributes:
        results: the results of all pairs and of their controls, with or without
            geometric verification as the report's protocol says.
        changes: change between the stages of each map.
        pairs: place recognition results of each pair of drives and, if there
            is one, of its control (the same routes without a change of the
            city).
        recognitions: place recognition of all pairs without their controls, and
            of drives compared with themselves.
        sessions: place recognition in databases of several drives through one
            stage, each next to the database that contains only the first of
            these drives.
        differences: AUC differences between methods.
        evidence: (database, query) -> evidence on why the best-scoring place
            of a query is wrong.
        tracks: drive -> time stamps and poses, also for the controls.
        drives: drive -> what the page shows of it.
        illustrations: figures, in the order of the page.
        costs: time and memory of each method.
        notes: notes for the reader.
        made_by: version, protocol and settings of methods that made the report.
        pages: drive -> address of the web page of its recording, relative to
            the report; drives without a page may be left out.
        reference: published numbers to compare with.
        repeated: results by the protocol of the published numbers, if this
            protocol differs from that of the report.
    """

    results: Results = field(default_factory=lambda: Results((), ()))
    changes: list[ChangeResult] = field(default_factory=list)
    pairs: list[conclusions.Controlled] = field(default_factory=list)
    recognitions: list[PlaceOutcome] = field(default_factory=list)
    sessions: list[PlaceOutcome] = field(default_factory=list)
    differences: Sequence[result_tables.MethodDifference] = ()
    evidence: dict[tuple[str, str], PairEvidence] = field(default_factory=dict)
    tracks: dict[str, result_tables.DriveTrack] = field(default_factory=dict)
    drives: dict[str, PageDrive] = field(default_factory=dict)
    illustrations: list[Illustration] = field(default_factory=list)
    costs: Sequence[Cost] = ()
    notes: Sequence[str] = ()
    made_by: Sequence[str] = ()
    pages: Mapping[str, str] = field(default_factory=dict)
    reference: Reference = NO_REFERENCE
    repeated: list[PlaceOutcome] = field(default_factory=list)

    @functools.cached_property
    def survivals(self) -> list[conclusions.Survival]:
        """Results of each method with and without change, on each pair."""
        stages = {
            name: stage
            for one, _ in self.pairs
            for name, stage in zip(
                (one.database, one.query),
                one.pair[1:],
                strict=True,
            )
        }
        return conclusions.survivals(self.results.rows, stages)

    @property
    def compared(self) -> list[PlaceOutcome]:
        """Results for which there are published numbers to compare."""
        known = filter(self.reference.covers, self.recognitions)
        return [*known, *self.repeated]


def chart_illustrations(report: Report, folder: Path) -> list[Illustration]:
    """Draws the charts with the results of all maps.

    Charts of published numbers stand next to the charts of the report. A chart
    without data is left out, with a note in the report.

    Args:
        report: the report.
        folder: folder for the files.

    Returns:
        The figures that were drawn.
    """
    name = "AUC against TCR_sym"
    charts: list[tuple[str, str, Section, dict[str, str], Results]] = [
        ("auc_over_tcr", name, "figures", _CHANGED, report.results)
    ]
    if report.compared:
        published = report.reference.to_results()
        name = f"{name}, of {report.reference.title}"
        stem = "auc_over_tcr_published"
        charts.insert(0, (stem, name, "figures", _SCATTER, published))
    if any(control for _, control in report.pairs):
        charts.append(
            ("survival", _SURVIVAL, "survival", _DUMBBELL, report.results)
        )
    shown = []
    for stem, words, section, chart, results in charts if report.pairs else ():
        gates = {"gate": tuple(results.distinct("gate"))}
        try:
            drawn = draw({**chart, **gates}, results, _WIDTH, alone=True)
            save(drawn.figure, folder / stem)
        except InputError as error:
            report.notes = [*report.notes, f"{words}: left out: {error}"]
            continue
        legend = []
        for label, (colour, *_) in drawn.legend.items():
            red, green, blue = (round(255 * part) for part in to_rgb(colour))
            legend.append(((red, green, blue), label))
        shown.append(
            Illustration(
                folder / stem,
                words,
                "svg",
                section=section,
                legend=tuple(legend),
            )
        )
    return shown


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
    queries = result_tables.query_table(results, report.tracks, report.evidence)
    # Evidence is of the queries that the other results got wrong.
    again = result_tables.query_table(report.repeated, report.tracks, {})
    numbers = {
        "survival": conclusions.survival_numbers(report.survivals),
        "tcr": result_tables.change_table(
            report.changes, report.reference, report.evidence
        ),
        "place_recognition": result_tables.audit_table(every, report.reference),
        "poses": result_tables.pose_error_numbers(results),
        "metrics": result_tables.metric_numbers(every),
        "differences": result_tables.difference_numbers(report.differences),
        "why": result_tables.fault_numbers(results, report.evidence),
        "query_details": replace(queries, rows=queries.rows + again.rows),
        "query_details_unchanged": result_tables.query_table(
            [
                replace(control, pair=one.pair)
                for one, control in report.pairs
                if control
            ],
            report.tracks,
            {},
        ),
    }
    if report.costs:
        numbers["costs"] = result_tables.cost_numbers(report.costs)
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
    for one in report.illustrations:
        illustrations[one.section].append(one)
    drives_of_maps = _drives_of_maps(report)
    forms = [f"All methods in mode {mode}" for mode in MODES]
    if report.compared:
        forms.append(f"Beside {report.reference.title}")
    forms_of_table = zip(forms, tables["place_recognition"], strict=True)
    # A section without an entry is always there.
    has_section = {
        "survival": bool(report.survivals),
        "maps": bool(drives_of_maps),
        "change": bool(tables["tcr"][0].rows or illustrations["change"]),
        "recognition": bool(report.recognitions),
        "figures": bool(illustrations["figures"]),
        "browser": bool(report.recognitions),
    }
    values = {
        **_content(report, tables),
        "illustrations": illustrations,
        "survivals_by_pair": by_pair(report.survivals),
        "drives_of_maps": drives_of_maps,
        "other_forms": list(forms_of_table)[1:],
        "fault_kinds": {kind: fault_words(kind) for kind in FAULT_KINDS},
        "image_step": data["imageStep"] if data else 1,
    }
    sections = [
        PageSection(
            name,
            word,
            Markup(_render(f"section_{name}.html", **values)),
            is_open=name in _OPEN,
        )
        for name, word in _SECTIONS.items()
        if has_section.get(name, True)
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
    """Returns name of a file -> its tables for print."""
    results = report.recognitions
    # The last one is counted as the reference did.
    counted: list[tuple[Sequence[PlaceOutcome], Mode | None, Reference]] = [
        (results, mode, NO_REFERENCE) for mode in MODES
    ]
    if report.compared:
        counted.append((report.compared, None, report.reference))
    changes = result_tables.change_table(
        report.changes, report.reference, report.evidence
    )
    return {
        "survival": [conclusions.survival_table(report.survivals)],
        "tcr": [changes.without_empty("paper")],
        "place_recognition": [
            result_tables.recognition_table(
                some, report.changes, mode, reference, report.evidence
            )
            for some, mode, reference in counted
        ],
        "differences": [result_tables.difference_table(report.differences)],
        "why": [result_tables.fault_table(results, report.evidence)],
        "poses": [result_tables.pose_table(results)],
        "costs": [result_tables.cost_table(report.costs)],
        "audit": [
            result_tables.audit_table(
                [*results, *report.repeated], report.reference
            )
        ],
        "sessions": [result_tables.sessions_table(report.sessions)],
    }


def _content(
    report: Report, tables: Mapping[str, Sequence[Table]]
) -> dict[str, object]:
    """Returns the values for the templates of the text and of the page."""
    ranked, headline = conclusions.ranked_methods(
        report.results, report.differences
    )
    return {
        "report": report,
        "tables": tables,
        "ranked": ranked,
        "beside": conclusions.further_columns(report.results),
        "styles": styles(in_table_order(one.method for one in ranked)),
        "headline": headline if report.pairs else "",
        "judgements": report.reference.judge(
            [*report.recognitions, *report.repeated], report.changes
        ),
        "survival_summary": conclusions.survival_summary(report.survivals),
    }


def _captioned(table: Table) -> str:
    return f"{escape_markdown(table.caption)}\n\n{table.to_markdown()}"


def _drives_of_maps(report: Report) -> dict[str, list[str]]:
    """Returns map -> its drives, in the order of stages.

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


def route_picture(drive: PageDrive) -> Markup:
    """Returns a drive's route on its map from above, as an SVG element.

    The route is red at its start and blue at its end. One unit is one metre; x
    points right and y down. The picture of the map is an element `image` with
    the id `view-<name of the drive>`, which the query browser uses as well.
    """
    left, right, bottom, top = drive.extent
    width, height = right - left, top - bottom
    size = _MARK * max(width, height)
    data = base64.b64encode(drive.view).decode("ascii")
    route = drive.route * [1.0, -1.0]
    (x0, y0), (x1, y1) = route[0], route[-1]
    end, base = right - 0.03 * width, -bottom - 0.03 * height
    mark = [[x0, y0 - size], [x0 - size, y0 + size], [x0 + size, y0 + size]]
    # Pieces are joined at their ends.
    last = len(route) - 1
    num = min(_NUM_PIECES, max(last, 1))
    ends = np.linspace(0, last, num + 1).astype(int)
    pieces = [route[a : b + 1] for a, b in itertools.pairwise(ends)]
    return Markup(
        _render(
            "route.svg",
            name=drive.name,
            box=_numbers([left, -top, width, height]),
            image=f"data:image/webp;base64,{data}",
            route=_points(route),
            pieces=zip(_route_colours(num), map(_points, pieces), strict=True),
            start=_points(np.array(mark)),
            end=_numbers([x1 - size, y1 - size, 2 * size]),
            bar=_numbers([end - _BAR_LENGTH, end, base]),
        )
    )


def _route_colours(num: int = 9) -> list[str]:
    """Returns colours from the start of a route to its end."""
    colours = colormaps[ROUTE_COLOURS](np.linspace(0.0, 1.0, num))
    return [to_hex(colour) for colour in colours]


def _points(line: np.ndarray) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in line)


def _numbers(values: Iterable[float]) -> list[str]:
    return [f"{value:.2f}" for value in values]


def _data_address(one: Illustration) -> str:
    """Returns a data URL that contains the figure."""
    path = one.stem.with_name(f"{one.stem.name}.{one.page_kind}")
    data = base64.b64encode(path.read_bytes()).decode("ascii")
    return f"data:{_MEDIA_TYPES[one.page_kind]};base64,{data}"


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
            "data_address": _data_address,
            "interval_text": conclusions.interval_text,
            "markdown": escape_markdown,
            "method_title": title,
            "percent": conclusions.percent,
            "quoted": quote,
            "route_picture": route_picture,
        },
    )
    found.globals |= {
        "bar_length": round(_BAR_LENGTH),
        "missing": MISSING,
        "no_control": conclusions.NO_CONTROL,
        "route_colours": _route_colours(),
    }
    return found
