"""The figures of a study and its report, from the results of its jobs."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from cns_drake.base.files import make_folder
from evaluation.change.drive_change import symmetric_changes
from evaluation.recognition.protocol import FAIR_PROTOCOL, RetrievalProtocol
from evaluation.recognition.survival import Survival
from evaluation.report.curve_figures import draw_auc_over_change, draw_pr_curves
from evaluation.report.page import Report, write_report
from evaluation.report.reference import NO_REFERENCE, Reference
from evaluation.report.result_tables import (
    DriveTrack,
    beaten,
    method_differences,
)
from evaluation.report.survival import draw_survival
from evaluation.study.chosen_methods import MethodChoice, choose_methods
from evaluation.study.collection import (
    City,
    RecordingInfo,
    group_cities,
    nothing_to_compare,
)
from evaluation.study.figures import (
    auc_illustration,
    curves_stem,
    illustrations,
    survival_illustration,
)
from evaluation.study.parts import StudyFiles


def assemble(
    recordings: Iterable[RecordingInfo],
    output: Path,
    methods: Sequence[MethodChoice] | None = None,
    pages: Mapping[str, str] | None = None,
    *,
    protocol: RetrievalProtocol = FAIR_PROTOCOL,
    with_costs: bool = False,
    reference: Reference = NO_REFERENCE,
    on_note: Callable[[str], None] = lambda text: None,
) -> Path:
    """Writes the report of a study whose jobs are done.

    Files: `report.html`, which holds everything; `report.md`; `survival`,
    `tcr`, `place_recognition` and `poses`, and with costs `costs`, each as
    .csv (all numbers), .md and .tex;
    `metrics.csv`, the metrics of other benchmarks; `differences.csv`, the
    differences between methods; `why.csv`, the reasons
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
    report = Report(pages=pages or {}, reference=reference)
    cities = group_cities(recordings, reference)
    for city in cities:
        _collect(city, files, chosen, protocol, report)
    if protocol.exclude_recent is None:
        report.notes = nothing_to_compare(cities)
    for note in report.notes:
        on_note(note)
    report.differences = method_differences(report.recognitions)
    if report.recognitions:
        title = reference.title if report.compared else ""
        shown = auc_illustration(files.figures, title)
        changes = symmetric_changes(report.changes)
        draw_auc_over_change(
            report.recognitions,
            changes,
            shown.stem,
            reference if report.compared else NO_REFERENCE,
        )
        report.illustrations.insert(0, shown)
    if any(one.unchanged is not None for one in report.survivals):
        shown = survival_illustration(files.figures)
        behind = beaten(report.differences)
        draw_survival(report.survivals, shown.stem, behind)
        report.illustrations.insert(0, shown)
    if with_costs and any(city.recognition_pairs() for city in cities):
        report.costs = files.costs.read()
    return write_report(report, output)


def _collect(
    city: City,
    files: StudyFiles,
    methods: Sequence[MethodChoice],
    protocol: RetrievalProtocol,
    report: Report,
) -> None:
    for earlier, later in city.change_pairs():
        change = files.change(earlier.name, later.name).read()
        report.changes.append(change)
    survivals, closures = [], []
    pairs = city.recognition_pairs(
        with_itself=protocol.exclude_recent is not None
    )
    for pair in pairs:
        control = city.unchanged_pair(*pair)
        results = files.recognition(*(one.name for one in pair))
        beside = None
        if control is not None:
            beside = files.recognition(*(one.name for one in control))
        for method in methods:
            changed = results.result(method.name).read()
            if pair[0] is pair[1]:
                if changed is not None:
                    closures.append(changed)
                continue
            unchanged = None
            if beside is not None:
                unchanged = beside.result(method.name).read()
            survivals.append(Survival.of(changed, unchanged))
        for again in city.repetitions(pair, methods, protocol):
            report.repeated.append(results.result(again.key).read())
        evidence = results.evidence.read()
        if evidence is not None:
            report.evidence[pair[0].name, pair[1].name] = evidence
        for drive in (*pair, *(control or ())):
            if drive.name in report.tracks:
                continue
            survey = files.survey(drive.name).drive.read()
            report.tracks[drive.name] = DriveTrack(
                survey.stamps_ns, survey.X_WS
            )
    compared = [*(one.changed for one in survivals), *closures]
    if compared:
        stem = files.figures / curves_stem(city)
        draw_pr_curves(city.name, compared, stem)
    report.survivals += survivals
    report.recognitions += compared
    report.drives.update(files.page_drives(city.name).read())
    report.illustrations += illustrations(city, files.figures)
