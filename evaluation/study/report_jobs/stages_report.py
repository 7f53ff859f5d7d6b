"""A report: the experiment `stages` on recordings, and what its page shows."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from cns_drake.base.errors import InputError
from cns_drake.base.files import make_folder
from cns_drake.base.jobs.cluster import Cluster
from cns_drake.base.jobs.running import Job, run_jobs
from cns_drake.base.progress import doing
from cns_drake.base.version import __version__
from evaluation.recognition.protocol import FAIR_PROTOCOL, RetrievalProtocol
from evaluation.report.charts import draw_charts
from evaluation.report.contents import Report
from evaluation.report.page import write_report
from evaluation.report.reference import NO_REFERENCE, Reference
from evaluation.report.tables.differences import method_differences
from evaluation.results.table import Results
from evaluation.study.chosen_methods import MethodChoice, choose_methods
from evaluation.study.engine import Engine, made_tasks
from evaluation.study.recordings.map_drives import (
    MapDrives,
    RecordingInfo,
    Recordings,
    drives_by_map,
    nothing_to_compare,
)
from evaluation.study.recordings.recording_search import find_recordings
from evaluation.study.removed_descriptors import (
    remove_descriptors,
    renew_removed_descriptors,
)
from evaluation.study.report_jobs.city_report import CityReport
from evaluation.study.report_jobs.method_costs import measure_method_costs
from evaluation.study.storage.parts import MakePart
from evaluation.study.storage.study_files import StudyFiles
from evaluation.study.tasks.change import ChangeTask
from evaluation.study.tasks.place import PlaceTask, PoseTask
from evaluation.study.tasks.task import Task

# Expected time to measure costs [s].
_COSTS_COST = 5.0
# The experiment whose rows a report writes, and its tasks.
_EXPERIMENT = "stages"
# Table of the results by the protocol of published numbers.
_SECOND_RUNS = "published_protocol.csv"
_TASKS: Mapping[str, type[Task]] = {
    task.name: task for task in (PlaceTask, PoseTask, ChangeTask)
}


@dataclass(frozen=True)
class _Plan:
    """What a report measures.

    Attributes:
        engine: the engine of the experiment `stages`, with all pairs.
        published: the engine of the second runs, by the protocol of published
            numbers.
        cities: the parts of the report, one for each city.
    """

    engine: Engine
    published: Engine
    cities: list[CityReport]


@dataclass(frozen=True)
class StagesReport:
    """A report on recordings, which need not exist yet.

    The report is the experiment `stages` on these recordings: the experiment's
    engine measures all pairs of drives, and writes `results.csv` and
    `queries.csv`. The page, the figures and the wide tables are made from the
    same files.

    A recording can serve as a control: its drive goes through one stage of a
    map, on the route of the drive through another stage. A comparison of the
    control with the usual drive through the same stage shows only the effect of
    the route.

    Attributes:
        recordings: the recordings. A recording that does not exist yet is made
            by the jobs that its attribute `needs` names.
        output: folder of the report.
        methods: methods to run; by default the methods of this package.
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

    @property
    def files(self) -> StudyFiles:
        """The paths of all files."""
        return StudyFiles(self.output.absolute())

    @cached_property
    def _plan(self) -> _Plan:
        output = self.output.absolute()
        engine = Engine(
            _EXPERIMENT,
            made_tasks({name: {} for name in _TASKS}, _TASKS, _EXPERIMENT),
            {one.key: (one, one.columns) for one in self.methods},
            output,
        )
        published = Engine(
            _EXPERIMENT,
            made_tasks({PlaceTask.name: {}}, _TASKS, _EXPERIMENT),
            engine.methods,
            output,
        )
        cities = [
            CityReport(
                city,
                engine,
                published,
                self.files,
                self.methods,
                self.protocol,
                self.reference,
            )
            for city in self.cities
        ]
        return _Plan(engine, published, cities)

    def jobs(self) -> list[Job]:
        """Returns the jobs whose results `assemble` puts into a report.

        For a city with one stage, only its route is drawn. If new results need
        descriptors that an earlier report removed (see `assemble`), the jobs
        compute these again.

        Raises:
            InputError: see `cities`.
        """
        jobs = [job for one in self._plan.cities for job in one.jobs.values()]
        if (pair := self._costed_pair) is not None:
            needs = tuple(job.name for job in jobs)
            jobs.append(self._cost_job(pair, needs))
        renew_removed_descriptors(jobs)
        return jobs

    @property
    def _costed_pair(self) -> Recordings | None:
        """The pair on which costs are measured; None without such a pair."""
        if not self.with_costs:
            return None
        pairs = (
            pair for city in self.cities for pair in city.recognition_pairs()
        )
        return next(pairs, None)

    def _cost_job(self, pair: Recordings, needs: tuple[str, ...]) -> Job:
        """Returns the job that measures costs, after all other jobs."""
        places, queries = (self.files.features(one.name) for one in pair)
        described = tuple(
            (files.scans, *(files.described(one.key) for one in self.methods))
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
        - `results.csv`, `queries.csv`: the results and the answers to queries;
          both tables are the tables of the experiment `stages`.
        - `published_protocol.csv`: the results of second runs, by the protocol
          of published numbers; written only if there are second runs.
        - `figures`: a folder with figures. Figures that exist are kept.

        If `with_tables` is true, wide tables are written as well. The wide
        tables are views of the same results:

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
        report = Report(pages=pages or {}, reference=self.reference)
        report.made_by = [
            f"cns-drake {__version__}",
            *(one.key for one in self.methods if one.settings),
            f"protocol: {self.protocol.to_text()}",
        ]
        results, _ = self._plan.engine.write_tables()
        self._write_second_runs()
        report.results = self._shown_rows(results)
        for one in self._plan.cities:
            one.collect(report, on_note)
        if self.protocol.exclude_recent is None:
            report.notes = nothing_to_compare(self.cities)
        for note in report.notes:
            on_note(note)
        report.differences = method_differences(report.recognitions)
        for illustration in draw_charts(report, folder):
            report.illustrations.insert(0, illustration)
        if self._costed_pair is not None:
            report.costs = self.files.part("costs", "costs").read()
        written = write_report(report, self.output, with_tables=with_tables)
        for one in self._plan.cities:
            remove_descriptors(one.jobs.values())
        return written

    def _write_second_runs(self) -> None:
        """Writes the results of second runs, and removes outdated results.

        Raises:
            InputError: the file cannot be written.
        """
        path = self.output / _SECOND_RUNS
        results, _ = self._plan.published.tables()
        if results.rows:
            results.write_csv(path)
        else:
            path.unlink(missing_ok=True)

    def _shown_rows(self, results: Results) -> Results:
        """Returns the rows of a table that the report shows.

        These are rows whose database is a single recording, other than the
        query. For all tasks except `change`, these are rows with geometric
        verification if the protocol has it, and otherwise rows without.
        """
        names = {one.name for one in self.recordings}
        shown = (
            row
            for row in results.rows
            if row.database in names
            and row.database != row.query
            and (row.task == "change" or row.gate == self.protocol.gate)
        )
        return Results(results.factors, tuple(shown))


def report_on_recordings(
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
