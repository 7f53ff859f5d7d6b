"""A report: the experiment `stages` on recordings, and what its page shows."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path

from cns_drake.base.drives.drive import check_same_world
from cns_drake.base.errors import InputError
from cns_drake.base.files import make_folder
from cns_drake.base.jobs.cluster import Cluster
from cns_drake.base.jobs.running import Job, run_jobs
from cns_drake.base.progress import doing
from cns_drake.base.version import __version__
from evaluation.recognition.description import Role
from evaluation.recognition.place_outcome import PlaceOutcome
from evaluation.recognition.protocol import FAIR_PROTOCOL, RetrievalProtocol
from evaluation.report import page, result_tables
from evaluation.report.curve_figures import draw_pr_curves
from evaluation.report.reference import NO_REFERENCE, Reference
from evaluation.results.table import LAST, OWN, STAGE, Results
from evaluation.study import figures
from evaluation.study.chosen_methods import MethodChoice, choose_methods
from evaluation.study.collection import (
    MapDrives,
    RecordingInfo,
    Recordings,
    drives_by_map,
    find_recordings,
    nothing_to_compare,
)
from evaluation.study.engine import Engine, made_tasks
from evaluation.study.fault_evidence import explain_faults
from evaluation.study.feature_extraction import Further
from evaluation.study.method_costs import measure_method_costs
from evaluation.study.parts import MakePart, Part
from evaluation.study.recorded import (
    ExtractionJobs,
    RecordedCondition,
    recorded_comparisons,
)
from evaluation.study.removed_descriptors import (
    remove_descriptors,
    renew_removed_descriptors,
)
from evaluation.study.repeats import Repeat, repeats_of
from evaluation.study.study_files import StudyFiles
from evaluation.study.tasks.change import ChangeTask
from evaluation.study.tasks.place import PlaceTask, PoseTask
from evaluation.study.tasks.task import Pair, Result, Task

# Expected time to measure costs [s].
_COSTS_COST = 5.0
# Expected time to compare two drives by a method [s].
_RECOGNITION_COST = 3.5
# The experiment whose rows a report writes, its tasks and its seed.
_EXPERIMENT = "stages"
_TASKS: Mapping[str, type[Task]] = {
    task.name: task for task in (PlaceTask, PoseTask, ChangeTask)
}
_SEED = 1


@dataclass(frozen=True)
class StagesReport:
    """A report on recordings, which need not exist yet.

    The report is the experiment `stages` on these recordings: the experiment's
    engine measures all pairs of drives, and writes `results.csv` and
    `queries.csv`. The page, the figures and the wide tables are made from the
    same files.

    A recording can serve as a control: its drive goes through one stage of a
    map, on the route of the drive through another stage. Comparing the control
    with the usual drive through the same stage shows the effect of the route
    only.

    Attributes:
        recordings: the recordings. A recording that does not exist yet is made
            by the jobs that its attribute `needs` names.
        output: folder of the report.
        methods: methods to run; by default those of this package.
        protocol: protocol of place recognition.
        with_costs: whether times and memory are measured, after all other jobs.
        reference: published numbers to compare with.
    """

    recordings: Sequence[RecordingInfo]
    output: Path
    methods: tuple[MethodChoice, ...] = field(default_factory=choose_methods)
    protocol: RetrievalProtocol = FAIR_PROTOCOL
    with_costs: bool = False
    reference: Reference = NO_REFERENCE

    @cached_property
    def cities(self) -> list[MapDrives]:
        """The recordings of the study, grouped by map.

        Raises:
            InputError: two recordings have the same map and stage.
        """
        return drives_by_map(self.recordings)

    @cached_property
    def engine(self) -> Engine:
        """The engine of the experiment `stages`."""
        return Engine(
            _EXPERIMENT,
            made_tasks({name: {} for name in _TASKS}, _TASKS, _EXPERIMENT),
            {one.key: (one, one.columns) for one in self.methods},
            self.output.absolute(),
        )

    @cached_property
    def published(self) -> Engine:
        """The engine of second runs, by the protocol of published numbers.

        The tables contain only the pairs of `stages`, not those of this engine.
        """
        return Engine(
            self.reference.title,
            made_tasks({PlaceTask.name: {}}, _TASKS, _EXPERIMENT),
            self.engine.methods,
            self.engine.output,
        )

    @property
    def files(self) -> StudyFiles:
        """The paths of all files."""
        return StudyFiles(self.output.absolute())

    @cached_property
    def _cities(self) -> list[_CityReport]:
        return [_CityReport(self, city) for city in self.cities]

    def jobs(self) -> list[Job]:
        """Returns the jobs whose results `assemble` puts into a report.

        For a city with one stage, only its route is drawn. If new results need
        descriptors that an earlier report removed (see `assemble`), the jobs
        compute these again.

        Raises:
            InputError: see `cities`.
        """
        jobs = [job for one in self._cities for job in one.jobs.values()]
        if self._costed_pairs:
            needs = tuple(job.name for job in jobs)
            jobs.append(self._cost_job(self._costed_pairs[0], needs))
        renew_removed_descriptors(jobs)
        return jobs

    @property
    def _costed_pairs(self) -> list[Recordings]:
        return [
            pair
            for city in self.cities
            for pair in city.recognition_pairs()
            if self.with_costs
        ]

    def _cost_job(self, pair: Recordings, needs: tuple[str, ...]) -> Job:
        """Returns the job that measures costs, after all other jobs."""
        places, queries = (self.files.features(one.name) for one in pair)
        described = tuple(
            tuple(files.described(one.key) for one in self.methods)
            for files in (places, queries)
        )
        source = pair[1].source
        drive = queries.drive
        step = MakePart(
            self.files.part("costs", "costs"),
            measure_method_costs,
            (source, drive, self.methods, described, self.protocol),
        )
        return Job("costs of the methods", step, needs, _COSTS_COST)

    def assemble(
        self,
        pages: Mapping[str, str] | None = None,
        on_note: Callable[[str], None] = lambda text: None,
        *,
        with_tables: bool = False,
    ) -> Path:
        """Writes the report, once all jobs are done.

        The inputs of the report are kept, except descriptors, which take most
        of the space. Descriptors are computed again if new results need them.

        The report consists of these files:

        - `report.html`: the whole report, in one file.
        - `report.md`: the report as Markdown.
        - `results.csv`, `queries.csv`: the results and the answers to queries,
          the same as those of the experiment `stages`.
        - `figures`: a folder with figures. Figures that exist are kept.

        Wide tables follow if they are asked for. The wide tables are views of
        the same results:

        - Tables, each as .csv (with all numbers), .md and .tex: `survival`,
          `tcr`, `place_recognition`, `poses`, and `costs` if costs were
          measured.
        - `metrics.csv`: the metrics of other benchmarks.
        - `differences.csv`: the differences between methods.
        - `why.csv`: the reasons for wrong top-ranked places.
        - `query_details.csv`, `query_details_unchanged.csv`: each query of the
          pairs of drives, and of their controls.

        Args:
            pages: name of a recording -> address of its 3-D page, relative to
                the report. Recordings without a page are left out.
            on_note: is called with a note on each pair without a match, and on
                each city without a pair to compare. The report also contains
                cities without a pair to compare.
            with_tables: whether to write the wide tables.

        Returns:
            The path of `report.html`.

        Raises:
            InputError: a job has not been done, or a file cannot be written.
        """
        doing("writing the report")
        folder = self.files.figures
        make_folder(folder)
        report = page.Report(pages=pages or {}, reference=self.reference)
        report.made_by = [
            f"cns-drake {__version__}",
            *(one.key for one in self.methods if one.settings),
            self.protocol.to_text(),
        ]
        results, _ = self.engine.write_tables()
        single = {one.name for one in self.recordings}
        shown = (
            row
            for row in results.rows
            if row.database in single - {row.query}
            and (row.task == "change" or row.gate == self.protocol.gate)
        )
        report.results = Results(results.factors, tuple(shown))
        for one in self._cities:
            one.collect(report, on_note)
        if self.protocol.exclude_recent is None:
            report.notes = nothing_to_compare(self.cities)
        for note in report.notes:
            on_note(note)
        report.differences = result_tables.method_differences(
            report.recognitions
        )
        for illustration in page.chart_illustrations(report, folder):
            report.illustrations.insert(0, illustration)
        if self._costed_pairs:
            report.costs = self.files.part("costs", "costs").read()
        written = page.write_report(
            report, self.output, with_tables=with_tables
        )
        for one in self._cities:
            remove_descriptors(one.jobs.values())
        return written


class _CityReport:
    """The part of a report that one city makes.

    Attributes:
        jobs: name -> job: those of the engine, and those for the page, which
            draw, explain wrong answers and repeat published runs.
    """

    def __init__(self, study: StagesReport, city: MapDrives):
        """Adds the pairs of the city to the engine of the study."""
        self._study = study
        self._city = city
        self._files = study.files
        protocol = study.protocol
        with_itself = protocol.exclude_recent is not None
        self._pairs = city.recognition_pairs(with_itself=with_itself)
        self._repeats = {
            (one.name, other.name): repeats_of(
                (city.name, one.stage, other.stage),
                study.methods,
                protocol,
                study.reference,
            )
            for one, other in city.recognition_pairs()
        }
        measured = list(
            recorded_comparisons(
                city,
                [
                    RecordedCondition({STAGE: LAST}, LAST, True, protocol),
                    RecordedCondition({STAGE: OWN}, OWN, False, protocol),
                ],
                _SEED,
                # The page says which pairs have no control.
                lambda text: None,
                both_ways=True,
                with_itself=with_itself,
            )
        )
        self._sessions = list(self._pairs_of_sessions())
        measured += [together for _, together in self._sessions]
        self._measured = {
            (*one.names, one.factors[STAGE]): one for one in measured
        }
        planned = study.engine.add(
            measured,
            make_jobs=partial(
                ExtractionJobs, further=self._further_descriptors()
            ),
        )
        assert isinstance(planned, ExtractionJobs)
        self._drawing, job = figures.city_job(city, self._files, planned)
        jobs = [job]
        self._changes = []
        for pair in city.change_pairs():
            parts = tuple(
                part
                for stage in (OWN, LAST)
                if (one := self._measured_or_control(pair, stage)) is not None
                for part in one.parts["change"]
                if isinstance(part, Part)
            )
            change, job = figures.change_job(
                city, pair, parts, self._files, planned
            )
            self._changes.append(change)
            jobs.append(job)
        jobs += map(self._evidence_job, self._pairs)
        self.jobs = {**planned.jobs, **{job.name: job for job in jobs}}
        # Drives -> the pairs of second runs.
        self._repeated: dict[tuple[str, str], list[Pair]] = {}
        for pair in self._pairs:
            own = self._measured_or_control(pair)
            assert own is not None
            for again in self._repeats.get(own.names, ()):
                one = again.of(own)
                added = study.published.add([one], make_jobs=again.jobs)
                self.jobs |= added.jobs
                self._repeated.setdefault(own.names, []).append(one)

    def _measured_or_control(
        self, pair: Recordings, stage: str = OWN
    ) -> Pair | None:
        """Returns a pair as it is measured, or (stage `last`) its control."""
        return self._measured.get((pair[0].name, pair[1].name, stage))

    def _pairs_of_sessions(self) -> Iterator[tuple[Recordings, Pair]]:
        """Yields two pairs for each earlier stage with several drives.

        The database is the first of these drives, and then the places of all of
        them. The query is the drive through the last stage.

        Raises:
            InputError: two of these drives are in different worlds.
        """
        for single in self._city.change_pairs():
            drives = self._city.sessions(single[0].stage)
            if len(drives) == 1:
                continue
            # Recordings that do not exist yet are of one map.
            recorded = [one for one in drives if not one.needs]
            for one in recorded[1:]:
                check_same_world(recorded[0].source(), one.source())
            condition = RecordedCondition(
                {STAGE: OWN}, OWN, False, self._study.protocol, drives
            )
            names = "+".join(one.name for one in drives)
            for pair in recorded_comparisons(
                self._city, [condition], _SEED, lambda text: None
            ):
                yield single, replace(pair, names=(names, pair.query.name))

    def _further_descriptors(self) -> dict[str, tuple[Further, ...]]:
        """Returns drive -> its descriptors that second runs need."""
        roles: dict[str, dict[Repeat, set[Role]]]
        roles = defaultdict(lambda: defaultdict(set))
        for (database, query), repeats in self._repeats.items():
            for one in repeats:
                # A drive's places and queries are described together.
                key = replace(one, shares_places=True)
                roles[query][key].add("queries")
                if not one.shares_places:
                    roles[database][key].add("places")
        return {
            drive: tuple(
                (one.method, frozenset(needed), one.protocol)
                for one, needed in some.items()
            )
            for drive, some in roles.items()
        }

    def _evidence(self, pair: Recordings) -> Part:
        """Returns the file with evidence on why top-ranked places are wrong."""
        return self._files.part("why", *(one.name for one in pair))

    def _evidence_job(self, pair: Recordings) -> Job:
        """Returns the job that finds out why answers of a pair are wrong."""
        own = self._measured_or_control(pair)
        assert own is not None
        features = [self._files.features(one.name) for one in pair]
        step = MakePart(
            self._evidence(pair),
            explain_faults,
            (
                (features[0].scans, features[1].scans),
                self._study.methods,
                own.parts["place"],
                self._study.protocol,
            ),
        )
        name = f"explain {own.names[0]} > {own.names[1]}"
        return Job(name, step, (f"place {own.key}",), _RECOGNITION_COST)

    def _outcomes(
        self, pair: Recordings, parts: Iterable[Result]
    ) -> list[PlaceOutcome]:
        """Returns the outcomes that the page shows, with the page's names.

        Methods for which no query has a match are left out.
        """
        names = {one.key: one.name for one in self._study.methods}
        stages = pair[0].stage, pair[1].stage
        return [
            replace(
                one, method=names[one.method], pair=(self._city.name, *stages)
            )
            for part in parts
            for one in part.read()
            if one.is_gated == self._study.protocol.gate
            and one.outcomes.has_match.any()
        ]

    def collect(
        self, report: page.Report, on_note: Callable[[str], None]
    ) -> None:
        """Adds the results of the city to a report.

        Args:
            report: the report.
            on_note: is called with a note on each pair without a match.
        """
        city = self._city
        report.changes += [part.read() for part in self._changes]
        compared = []
        for pair in self._pairs:
            own, control = (
                self._measured_or_control(pair),
                self._measured_or_control(pair, LAST),
            )
            assert own is not None
            found = self._outcomes(pair, own.parts["place"])
            before = {}
            if control is not None:
                beside = self._outcomes(pair, control.parts["place"])
                before = {one.method: one for one in beside}
            compared += found
            if not found:
                # Routes need not meet, nor close a loop.
                on_note(
                    f"{pair[1].name}: no query lies within"
                    f" {self._study.protocol.radius:g} m of a place of"
                    f" {pair[0].name}"
                )
            if pair[0] is not pair[1]:
                report.pairs += [(one, before.get(one.method)) for one in found]
            for one in self._repeated.get(own.names, ()):
                report.repeated += self._outcomes(pair, one.parts["place"])
            evidence = self._evidence(pair).read()
            if evidence is not None and before:
                unchanged = next(iter(before.values())).columns["overlap"]
                evidence = replace(evidence, unchanged=unchanged)
            if evidence is not None:
                report.evidence[own.names] = evidence
            drives = {one.name for one in pair}
            if control is not None:
                drives |= {one.name for one, _ in control.roles}
            for name in sorted(drives - report.tracks.keys()):
                drive = self._files.features(name).drive.read()
                report.tracks[name] = result_tables.DriveTrack(
                    drive.stamps_ns, drive.X_WS
                )
        for pair, together in self._sessions:
            own = self._measured_or_control(pair)
            assert own is not None
            report.sessions += self._outcomes(pair, own.parts["place"])
            number = 1 + len(together.beside)
            stages = f"{pair[0].stage} ({number} drives)", pair[1].stage
            report.sessions += [
                replace(one, pair=(city.name, *stages))
                for one in self._outcomes(pair, together.parts["place"])
            ]
        if compared:
            stem = self._files.figures / figures.curves_stem(city)
            draw_pr_curves(city.name, compared, stem)
        report.recognitions += compared
        report.drives.update(self._drawing.read())
        report.illustrations += figures.illustrations(
            city, self._files.figures, with_curves=bool(compared)
        )


def write_report(
    recordings: Path,
    output: Path,
    cluster: Cluster,
    methods: Iterable[str] = (),
    protocol: RetrievalProtocol = FAIR_PROTOCOL,
    on_note: Callable[[str], None] = lambda text: None,
    *,
    settings: Iterable[str] = (),
    with_costs: bool = False,
    reference_for: Callable[[set[str]], Reference] = lambda maps: NO_REFERENCE,
    lidar: str | None = None,
    columns: int | None = None,
    with_tables: bool = False,
) -> Path:
    """Measures all recordings in a folder, and writes a report on them.

    The files of the report are described in `StagesReport.assemble`. Results of
    an earlier run, finished or not, are used if they belong to the same
    recordings and methods.

    Args:
        recordings: the folder.
        output: folder of the report.
        cluster: runs the jobs.
        methods, settings: names, files and settings of methods, see
            `evaluation.study.chosen_methods.choose_methods`.
        protocol: protocol of place recognition.
        on_note: is called with notes: on how recordings are read or left out,
            on assumptions of methods, and on cities without a pair to compare.
        with_costs: whether times and memory of methods are measured.
        reference_for: function that returns published numbers for the maps of a
            report.
        lidar: name of the LiDAR, for recordings with several LiDARs.
        columns: number of columns of `.bin` files; by default guessed from the
            values.
        with_tables: whether to write the wide tables, too.

    Returns:
        The path of `report.html`.

    Raises:
        InputError: a recording cannot be read, there is nothing to compare and
            maps and stages were guessed, or the output cannot be written.
    """
    chosen = choose_methods(methods, settings)
    found = find_recordings(recordings, on_note, lidar, columns)
    for choice in chosen:
        method = choice.make()
        for note in {method.assumption(one.lidar_field) for one in found}:
            if note is not None:
                on_note(note)
    reference = reference_for({one.map_name for one in found})
    study = StagesReport(found, output, chosen, protocol, with_costs, reference)
    jobs = study.jobs()
    alone = nothing_to_compare(study.cities)
    # A wrong guess must not lead to an empty report.
    if (
        len(alone) == len(study.cities)
        and protocol.exclude_recent is None
        and any(one.is_guessed for one in found)
    ):
        raise InputError(f"{recordings}: {alone[0]}")
    make_folder(output)
    run_jobs(jobs, cluster)
    return study.assemble(on_note=on_note, with_tables=with_tables)
