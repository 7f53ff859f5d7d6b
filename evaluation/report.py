"""The whole benchmark on a folder of recordings: tables, figures, a page."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from evaluation import page
from evaluation.change import ChangeReport, Surveyed, compare
from evaluation.collection import City, Recording, find_cities
from evaluation.curve_figures import draw_auc_over_change, draw_pr_curves
from evaluation.figures import Stage, draw_change, draw_routes
from evaluation.files import completing, make_folder
from evaluation.findings import Finding, findings
from evaluation.methods import known_methods, make_method
from evaluation.page_data import Illustration, PageDrive
from evaluation.place_recognition import PlaceRecognition, judge_retrieval
from evaluation.progress import Track, silent
from evaluation.recording_survey import RecordingSurvey, survey_recording
from evaluation.results import (
    ChangeResult,
    RecognitionResult,
    audit_table,
    change_table,
    recognition_table,
    symmetric_changes,
)
from evaluation.retrieval import DescribedDrive, Role
from evaluation.retrieval import compare as score
from evaluation.sequences import check_same_world
from evaluation.tables import Table
from evaluation.workers import Workers


@dataclass
class _Collected:
    """What the cities contribute, one after the other."""

    changes: list[ChangeResult] = field(default_factory=list)
    recognitions: list[RecognitionResult] = field(default_factory=list)
    illustrations: list[Illustration] = field(default_factory=list)
    drives: dict[str, PageDrive] = field(default_factory=dict)


def write_report(
    recordings: Path, output: Path, track: Track = silent, num_jobs: int = 1
) -> Path:
    """Measures all recordings in a folder; writes tables, figures, a page.

    Files: `report.html`, which holds everything; `report.md`; `tcr` and
    `place_recognition`, each as .csv (all numbers), .md and .tex; and a
    folder `figures`. A city with one stage only gets its route drawn.

    Args:
        recordings: folder of recordings; drives of one map that share stage
            and route with others serve as same-stage controls.
        output: folder to write, made if needed.
        track: reports progress.
        num_jobs: processes that work at the same time.

    Returns:
        The path of `report.md`.

    Raises:
        InputError: if a recording cannot be read, or the output not be
            written.
    """
    cities = find_cities(recordings)
    make_folder(output / "figures")
    collected = _Collected()
    with Workers(num_jobs) as workers:
        for city in cities:
            _work_on(city, workers, output / "figures", track, collected)
    return _write_all(collected, output)


def _work_on(
    city: City,
    workers: Workers,
    folder: Path,
    track: Track,
    collected: _Collected,
) -> None:
    """Adds one city; only then the next one takes memory."""
    for pair in (*city.change_pairs(), *city.recognition_pairs()):
        check_same_world(*(recording.sequence for recording in pair))
    surveys = _survey(city, workers, track)
    reports = _measure_changes(city, surveys)
    stages = {
        stage: Stage(stage, one.fine, one.coarse, one.positions)
        for stage, one in ((s, surveys[r.name]) for s, r in city.stages.items())
    }
    recognitions = _recognise(city, surveys, workers, track)
    collected.changes += reports
    collected.recognitions += recognitions
    for recording in city.stages.values():
        collected.drives[recording.name] = surveys[recording.name].page
    del surveys
    collected.illustrations += _draw(
        city, stages, reports, recognitions, workers, folder, track
    )


def _survey(
    city: City, workers: Workers, track: Track
) -> dict[str, RecordingSurvey]:
    """Returns name -> survey of all drives that are needed."""
    roles: dict[str, set[Role]] = {}
    paths: dict[str, Path] = {}

    def need(recording: Recording, *new: Role) -> None:
        paths[recording.name] = recording.path
        roles.setdefault(recording.name, set()).update(new)

    for recording in city.stages.values():
        need(recording)
    for pair in city.change_pairs():
        control = city.control(*pair)
        if control is not None:
            need(control)
    for database, query in city.recognition_pairs():
        need(database, "places")
        need(query, "queries")
    # Those with most to do first, so that no process ends alone.
    names = sorted(paths, key=lambda name: (-len(roles[name]), name))
    surveys = workers.map(
        survey_recording,
        [(paths[name], roles[name]) for name in names],
        f"surveying {city.name}",
        track,
    )
    return dict(zip(names, surveys, strict=True))


def _measure_changes(
    city: City, surveys: dict[str, RecordingSurvey]
) -> list[ChangeResult]:
    results = []
    for earlier, later in city.change_pairs():
        control = city.control(earlier, later)
        surveyed = [
            Surveyed(
                one.name,
                surveys[one.name].coarse,
                surveys[one.name].positions,
                one.sequence,
            )
            for one in (earlier, later, control)
            if one is not None
        ]
        report: ChangeReport = compare(*surveyed)
        results.append(
            ChangeResult(city.name, (earlier.stage, later.stage), report)
        )
    return results


def _recognise(
    city: City,
    surveys: dict[str, RecordingSurvey],
    workers: Workers,
    track: Track,
) -> list[RecognitionResult]:
    calls, stages = [], []
    for database, query in city.recognition_pairs():
        for name in known_methods():
            calls.append(
                (
                    name,
                    surveys[database.name].described[name],
                    surveys[query.name].described[name],
                )
            )
            stages.append((database.stage, query.stage))
    outcomes = workers.map(
        _run_method, calls, f"recognising places in {city.name}", track
    )
    return [
        RecognitionResult.of(city.name, pair, outcome)
        for pair, outcome in zip(stages, outcomes, strict=True)
    ]


def _run_method(
    name: str, database: DescribedDrive, query: DescribedDrive
) -> PlaceRecognition:
    method = make_method(name, {})
    retrieval = score(method, database, query)
    return judge_retrieval(method, database.name, query.name, retrieval)


def _draw(
    city: City,
    stages: dict[str, Stage],
    changes: list[ChangeResult],
    recognitions: list[RecognitionResult],
    workers: Workers,
    folder: Path,
    track: Track,
) -> list[Illustration]:
    illustrations, calls = [], []

    def add(function, arguments: tuple, stem: str, title: str, kind: str):
        calls.append((function, arguments))
        illustrations.append(Illustration(folder / stem, title, kind))

    routes = f"routes_{city.name}"
    add(
        draw_routes,
        (city.name, list(stages.values()), folder / routes),
        routes,
        f"Routes in {city.name}, from red to blue",
        "webp",
    )
    for result in changes:
        first, last = result.stages
        stems = [
            f"{kind}_{city.name}_{first}_{last}" for kind in ("change", "sets")
        ]
        arguments = (
            city.name,
            stages[first],
            stages[last],
            result.report.change,
            tuple(folder / stem for stem in stems),
        )
        add(
            draw_change,
            arguments,
            stems[0],
            f"What changed in {city.name} between {first} and {last}",
            "webp",
        )
        illustrations.append(
            Illustration(
                folder / stems[1],
                f"Sets H and O of {city.name} {first} and {last}: both orders"
                " and their union",
                "webp",
            )
        )
    if recognitions:
        stem = f"pr_{city.name}"
        add(
            draw_pr_curves,
            (city.name, recognitions, folder / stem),
            stem,
            f"Precision over recall in {city.name}; numbers are AUC",
            "svg",
        )
    workers.map(_call, calls, f"drawing {city.name}", track)
    return illustrations


def _call(function, arguments: tuple) -> None:
    function(*arguments)


def _write_all(collected: _Collected, output: Path) -> Path:
    changes, recognitions = collected.changes, collected.recognitions
    illustrations = list(collected.illustrations)
    tcr = symmetric_changes(changes)
    if recognitions:
        stem = output / "figures" / "auc_over_tcr"
        draw_auc_over_change(recognitions, tcr, stem)
        illustrations.insert(
            0,
            Illustration(
                stem,
                "AUC against TCR_sym with 95 % intervals, and the paper's",
                "svg",
            ),
        )
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
            illustrations=illustrations,
            recognitions=recognitions,
            drives=collected.drives,
        ),
    )
    path = output / "report.md"
    _write(path, _to_markdown(found, change, recognition, audit, illustrations))
    return path


def _to_markdown(
    found: list[Finding],
    change: Table,
    recognition: list[Table],
    audit: Table,
    illustrations: list[Illustration],
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
    for one in illustrations:
        name = one.stem.name
        parts.append(f"![{one.title}](figures/{name}.png)\n\n{one.title}\n")
    return "\n".join(parts)


def _captioned(table: Table) -> str:
    return f"{table.caption}\n\n{table.to_markdown()}"


def _write(path: Path, text: str) -> None:
    with completing(path) as part:
        part.write_text(text, encoding="utf-8")
