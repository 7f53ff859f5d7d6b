"""Tables, figures and a page, from the results of the jobs of a study."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import quote

from cns_drake.base.files import completing, make_folder
from evaluation.change.drive_change import (
    ChangeResult,
    symmetric_changes,
)
from evaluation.recognition.costs import Cost
from evaluation.recognition.fault_kinds import PairEvidence
from evaluation.recognition.place_recognition import RecognitionResult
from evaluation.recognition.protocol import (
    PAPER_PROTOCOL,
    RetrievalProtocol,
)
from evaluation.recognition.survival import Survival
from evaluation.report import page
from evaluation.report.cost_table import cost_numbers, cost_table
from evaluation.report.curve_figures import (
    draw_auc_over_change,
    draw_pr_curves,
)
from evaluation.report.fault_tables import fault_numbers, fault_table
from evaluation.report.metric_table import metric_numbers
from evaluation.report.page_data import Illustration, PageDrive
from evaluation.report.pose_tables import pose_numbers, pose_table
from evaluation.report.query_table import DriveTrack, query_table
from evaluation.report.reference import (
    NO_REFERENCE,
    Judgement,
    Reference,
)
from evaluation.report.result_tables import (
    audit_table,
    change_table,
    recognition_tables,
)
from evaluation.report.survival_figure import draw_survival
from evaluation.report.survival_tables import (
    survival_numbers,
    survival_summary,
    survival_table,
)
from evaluation.report.tables import Table, escape_markdown
from evaluation.study.chosen_methods import MethodChoice, choose_methods
from evaluation.study.collection import (
    City,
    RecordingInfo,
    group_cities,
    nothing_to_compare,
)
from evaluation.study.figure_files import (
    auc_illustration,
    curves_stem,
    illustrations,
    survival_illustration,
)
from evaluation.study.parts import read_part
from evaluation.study.study_layout import StudyFiles


@dataclass
class _Collected:
    """The parts of all cities."""

    changes: list[ChangeResult] = field(default_factory=list)
    survivals: list[Survival] = field(default_factory=list)
    tracks: dict[str, DriveTrack] = field(default_factory=dict)
    illustrations: list[Illustration] = field(default_factory=list)
    drives: dict[str, PageDrive] = field(default_factory=dict)
    recognitions: list[RecognitionResult] = field(default_factory=list)
    # (Database, query) -> evidence.
    evidence: dict[tuple[str, str], PairEvidence] = field(default_factory=dict)


def assemble(
    recordings: Iterable[RecordingInfo],
    output: Path,
    methods: Sequence[MethodChoice] | None = None,
    pages: Mapping[str, str] | None = None,
    *,
    protocol: RetrievalProtocol = PAPER_PROTOCOL,
    with_costs: bool = False,
    reference: Reference = NO_REFERENCE,
    on_note: Callable[[str], None] = lambda text: None,
) -> Path:
    """Writes the report of a study whose jobs are done.

    Files: `report.html`, which holds everything; `report.md`; `survival`,
    `tcr`, `place_recognition` and `poses`, and with costs `costs`, each as
    .csv (all numbers), .md and .tex;
    `metrics.csv`, the metrics of other benchmarks; `why.csv`, the reasons
    for wrong best places; `queries.csv` and
    `queries_unchanged.csv`, every query of the pairs and of their controls;
    and what is missing in the folder `figures`.

    Args:
        recordings: as in `plan_study`.
        output: likewise.
        methods: likewise.
        pages: recording -> address of its 3-D page, relative to the report,
            for those that have one.
        protocol: likewise.
        with_costs: likewise.
        reference: likewise.
        on_note: gets a note on each city without a pair to compare; the report
            has these notes too.

    Returns:
        The path of `report.html`.

    Raises:
        InputError: a job has not been done, or a file cannot be written.
    """
    files = StudyFiles(output)
    chosen = choose_methods() if methods is None else methods
    make_folder(files.figures)
    collected = _Collected()
    cities = group_cities(recordings, reference)
    for city in cities:
        _collect(city, files, chosen, protocol, collected)
    notes = []
    if protocol.exclude_recent is None:
        notes = nothing_to_compare(cities)
    for note in notes:
        on_note(note)
    pairs = [pair for city in cities for pair in city.recognition_pairs()]
    if collected.recognitions:
        covered = any(map(reference.covers, collected.recognitions))
        shown = auc_illustration(
            files.figures, reference.title if covered else ""
        )
        draw_auc_over_change(
            collected.recognitions,
            symmetric_changes(collected.changes),
            shown.stem,
            reference,
        )
        collected.illustrations.insert(0, shown)
    if any(one.unchanged is not None for one in collected.survivals):
        shown = survival_illustration(files.figures)
        draw_survival(collected.survivals, shown.stem)
        collected.illustrations.insert(0, shown)
    costs = read_part(files.costs) if with_costs and pairs else []
    return _write_all(collected, output, pages or {}, costs, reference, notes)


def _collect(
    city: City,
    files: StudyFiles,
    methods: Sequence[MethodChoice],
    protocol: RetrievalProtocol,
    collected: _Collected,
) -> None:
    for earlier, later in city.change_pairs():
        change = read_part(files.change(earlier.name, later.name))
        collected.changes.append(change)
    survivals, closures = [], []
    pairs = city.recognition_pairs(
        with_itself=protocol.exclude_recent is not None
    )
    for pair in pairs:
        control = city.unchanged_pair(*pair)
        for method in methods:
            changed = _read_recognition(pair, method, files)
            if pair[0] is pair[1]:
                if changed is not None:
                    closures.append(changed)
                continue
            assert changed is not None  # Only loops may be missing.
            unchanged = None
            if control is not None:
                unchanged = _read_recognition(control, method, files)
            survivals.append(Survival.of(changed, unchanged))
        names = pair[0].name, pair[1].name
        evidence = read_part(files.recognition(*names).evidence)
        if evidence is not None:
            collected.evidence[names] = evidence
        for drive in (*pair, *(control or ())):
            if drive.name in collected.tracks:
                continue
            survey = read_part(files.survey(drive.name).drive)
            collected.tracks[drive.name] = DriveTrack(
                survey.stamps_ns, survey.X_WS
            )
    compared = [*(one.changed for one in survivals), *closures]
    if compared:
        stem = files.figures / curves_stem(city)
        draw_pr_curves(city.name, compared, stem)
    collected.survivals += survivals
    collected.recognitions += compared
    collected.drives.update(read_part(files.page_drives(city.name)))
    collected.illustrations += illustrations(city, files.figures)


def _read_recognition(
    pair: tuple[RecordingInfo, RecordingInfo],
    method: MethodChoice,
    files: StudyFiles,
) -> RecognitionResult | None:
    """Returns a result; None for a drive that closes no loop."""
    database, query = pair
    return read_part(
        files.recognition(database.name, query.name).result(method)
    )


def _write_all(
    collected: _Collected,
    output: Path,
    pages: Mapping[str, str],
    costs: Sequence[Cost],
    reference: Reference,
    notes: Sequence[str],
) -> Path:
    changes, recognitions = collected.changes, collected.recognitions
    judgements = reference.judge(recognitions, changes)
    change_numbers = change_table(changes, reference)
    change = change_numbers.without_empty("paper")
    recognition = recognition_tables(recognitions, changes, reference)
    audit = audit_table(recognitions, reference)
    survival = survival_table(collected.survivals)
    poses, cost = pose_table(recognitions), cost_table(costs)
    _write_queries(collected, output)
    _write(output / "metrics.csv", metric_numbers(recognitions).to_csv())
    evidence = collected.evidence
    _write(output / "why.csv", fault_numbers(recognitions, evidence).to_csv())
    why = fault_table(recognitions, evidence)
    written = [
        ("survival", [survival], survival_numbers(collected.survivals)),
        ("tcr", [change], change_numbers),
        ("place_recognition", recognition, audit),
        ("poses", [poses], pose_numbers(recognitions)),
    ]
    if costs:
        written.append(("costs", [cost], cost_numbers(costs)))
    for name, shown, numbers in written:
        _write(output / f"{name}.csv", numbers.to_csv())
        _write(output / f"{name}.md", "\n".join(map(_captioned, shown)))
        _write(output / f"{name}.tex", "\n".join(t.to_latex() for t in shown))
    path = output / "report.html"
    page.write_page(
        path,
        page.PageContent(
            notes=notes,
            judgements=judgements,
            beside=reference.title
            if any(map(reference.covers, recognitions))
            else "",
            changes=changes,
            change=change,
            recognition=recognition,
            audit=audit,
            why=why,
            evidence=evidence,
            poses=poses,
            costs=cost,
            illustrations=collected.illustrations,
            recognitions=recognitions,
            survivals=collected.survivals,
            drives=collected.drives,
            pages=pages,
        ),
    )
    _write(
        output / "report.md",
        _to_markdown(
            notes,
            survival_summary(collected.survivals),
            survival,
            judgements,
            change,
            recognition,
            audit,
            why,
            poses,
            cost,
            collected.illustrations,
        ),
    )
    return path


def _write_queries(collected: _Collected, output: Path) -> None:
    pairs = [(one.pair, one) for one in collected.recognitions]
    controls = [
        (one.pair, one.unchanged)
        for one in collected.survivals
        if one.unchanged is not None
    ]
    for name, results in (("queries", pairs), ("queries_unchanged", controls)):
        evidence = collected.evidence if name == "queries" else {}
        table = query_table(results, collected.tracks, evidence)
        _write(output / f"{name}.csv", table.to_csv())


def _to_markdown(
    notes: Sequence[str],
    summary: str,
    survival: Table,
    judgements: Sequence[Judgement],
    change: Table,
    recognition: list[Table],
    audit: Table,
    why: Table,
    poses: Table,
    cost: Table,
    shown: list[Illustration],
) -> str:
    parts = ["# Structural change and place recognition\n"]
    parts += [f"{escape_markdown(note)}\n" for note in notes]
    if survival.rows:
        parts.append("## Which method survives the change?\n")
        parts += [f"{escape_markdown(summary)}\n", _captioned(survival)]
    for judgement in judgements:
        parts.append(f"## {judgement.heading}\n")
        parts += [
            f"- **{escape_markdown(one.claim)}** This {one.verdict}."
            f" {escape_markdown(one.evidence)}"
            for one in judgement.findings
        ]
        parts.append("")
    if change.rows:
        parts += ["## Table I: temporal change ratio\n", _captioned(change)]
    if audit.rows:
        parts.append("## Table II: place recognition\n")
        parts += [_captioned(table) for table in recognition]
        parts += ["## Why best places are wrong\n", _captioned(why)]
        parts += ["## Pose, not only place\n", _captioned(poses)]
        parts += ["## All numbers\n", _captioned(audit)]
    if cost.rows:
        parts += ["## What the methods cost\n", _captioned(cost)]
    parts.append("## Figures\n")
    for one in shown:
        name = quote(one.stem.name)
        title = escape_markdown(one.title)
        parts.append(f"![{title}](figures/{name}.png)\n\n{title}\n")
    return "\n".join(parts)


def _captioned(table: Table) -> str:
    return f"{escape_markdown(table.caption)}\n\n{table.to_markdown()}"


def _write(path: Path, text: str) -> None:
    with completing(path) as part:
        part.write_text(text, encoding="utf-8")
