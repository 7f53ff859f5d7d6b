"""Tables, figures and a page, of what the jobs of a study left."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from evaluation.change.change_result import (
    ChangeResult,
    symmetric_changes,
)
from evaluation.recognition.recognition_result import RecognitionResult
from evaluation.report import page
from evaluation.report.curve_figures import (
    draw_auc_over_change,
    draw_pr_curves,
)
from evaluation.report.findings import Finding, findings
from evaluation.report.page_data import Illustration, PageDrive
from evaluation.report.result_tables import (
    audit_table,
    change_table,
    recognition_table,
)
from evaluation.report.tables import Table
from evaluation.study.chosen_methods import MethodChoice, choose_methods
from evaluation.study.collection import (
    City,
    RecordingInfo,
    group_cities,
)
from evaluation.study.figure_files import (
    auc_illustration,
    curves_stem,
    illustrations,
)
from evaluation.study.parts import read_part
from evaluation.study.study_layout import StudyFiles
from evaluation.support.files import completing, make_folder


@dataclass
class _Collected:
    """What the cities contribute, one after the other."""

    changes: list[ChangeResult] = field(default_factory=list)
    recognitions: list[RecognitionResult] = field(default_factory=list)
    illustrations: list[Illustration] = field(default_factory=list)
    drives: dict[str, PageDrive] = field(default_factory=dict)


def assemble(
    recordings: Iterable[RecordingInfo],
    output: Path,
    methods: Sequence[MethodChoice] | None = None,
    pages: Mapping[str, str] | None = None,
) -> Path:
    """Writes the report of a study whose jobs are done.

    Files: `report.html`, which holds everything; `report.md`; `tcr` and
    `place_recognition`, each as .csv (all numbers), .md and .tex; and what
    is missing in the folder `figures`.

    Args:
        recordings: as in `plan_study`.
        output: likewise.
        methods: likewise.
        pages: recording -> address, relative to the page, of what shows it
            in 3-D, for those that have one.

    Returns:
        The path of `report.md`.

    Raises:
        InputError: if a job has not been done, or a file cannot be written.
    """
    files = StudyFiles(output)
    chosen = choose_methods() if methods is None else methods
    make_folder(files.figures)
    collected = _Collected()
    for city in group_cities(recordings):
        _collect(city, files, chosen, collected)
    if collected.recognitions:
        shown = auc_illustration(files.figures)
        draw_auc_over_change(
            collected.recognitions,
            symmetric_changes(collected.changes),
            shown.stem,
        )
        collected.illustrations.insert(0, shown)
    return _write_all(collected, output, pages or {})


def _collect(
    city: City,
    files: StudyFiles,
    methods: Sequence[MethodChoice],
    collected: _Collected,
) -> None:
    for earlier, later in city.change_pairs():
        change = read_part(files.change(earlier.name, later.name))
        collected.changes.append(change)
    recognitions = [
        read_part(files.recognition(database.name, query.name, method))
        for database, query in city.recognition_pairs()
        for method in methods
    ]
    if recognitions:
        stem = files.figures / curves_stem(city)
        draw_pr_curves(city.name, recognitions, stem)
    collected.recognitions += recognitions
    collected.drives.update(read_part(files.page_drives(city.name)))
    collected.illustrations += illustrations(city, files.figures)


def _write_all(
    collected: _Collected, output: Path, pages: Mapping[str, str]
) -> Path:
    changes, recognitions = collected.changes, collected.recognitions
    found = findings(recognitions, changes)
    change = change_table(changes)
    recognition = [
        recognition_table(recognitions, changes, mode)
        for mode in (None, "all", "filtered")
    ]
    audit = audit_table(recognitions)
    for name, shown, numbers in (
        ("tcr", [change], change),
        ("place_recognition", recognition, audit),
    ):
        _write(output / f"{name}.csv", numbers.to_csv())
        _write(output / f"{name}.md", "\n".join(map(_captioned, shown)))
        _write(output / f"{name}.tex", "\n".join(t.to_latex() for t in shown))
    page.write_page(
        output / "report.html",
        page.PageContent(
            findings=found,
            changes=changes,
            change=change,
            recognition=recognition,
            audit=audit,
            illustrations=collected.illustrations,
            recognitions=recognitions,
            drives=collected.drives,
            pages=pages,
        ),
    )
    path = output / "report.md"
    _write(
        path,
        _to_markdown(
            found, change, recognition, audit, collected.illustrations
        ),
    )
    return path


def _to_markdown(
    found: list[Finding],
    change: Table,
    recognition: list[Table],
    audit: Table,
    shown: list[Illustration],
) -> str:
    parts = ["# Structural change and place recognition\n"]
    if found:
        parts.append("## The paper's findings\n")
        parts += [
            f"- **{one.claim}** This {one.verdict}. {one.evidence}"
            for one in found
        ]
        parts.append("")
    if change.rows:
        parts += ["## Table I: temporal change ratio\n", _captioned(change)]
    if audit.rows:
        parts.append("## Table II: place recognition\n")
        parts += [_captioned(table) for table in recognition]
        parts += ["## All numbers\n", _captioned(audit)]
    parts.append("## Figures\n")
    for one in shown:
        name = one.stem.name
        parts.append(f"![{one.title}](figures/{name}.png)\n\n{one.title}\n")
    return "\n".join(parts)


def _captioned(table: Table) -> str:
    return f"{table.caption}\n\n{table.to_markdown()}"


def _write(path: Path, text: str) -> None:
    with completing(path) as part:
        part.write_text(text, encoding="utf-8")
