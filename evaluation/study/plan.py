"""The whole benchmark: its jobs, and the report made from their files."""

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

from cns_drake.base.errors import InputError
from cns_drake.base.files import make_folder
from cns_drake.base.jobs.cluster import Cluster
from cns_drake.base.jobs.processes import nothing_left
from cns_drake.base.jobs.running import Job, run_jobs
from cns_drake.base.jobs.step import Steps
from cns_drake.base.progress import doing
from cns_drake.base.version import __version__
from evaluation.recognition.description import Role
from evaluation.recognition.place_outcome import PlaceOutcome
from evaluation.recognition.protocol import FAIR_PROTOCOL, RetrievalProtocol
from evaluation.report import page, result_tables
from evaluation.report.curve_figures import draw_pr_curves
from evaluation.report.reference import NO_REFERENCE, Reference
from evaluation.results.table import LAST, OWN, SETTINGS, STAGE, Results
from evaluation.study import figures, measurements
from evaluation.study.chosen_methods import MethodChoice, choose_methods
from evaluation.study.collection import (
    City,
    Pair,
    RecordingInfo,
    Run,
    find_recordings,
    group_cities,
    nothing_to_compare,
)
from evaluation.study.engine import Engine, MeasuredPair, made_tasks
from evaluation.study.fault_evidence import explain_faults
from evaluation.study.parts import MakePart, Part, StudyFiles
from evaluation.study.recorded import RecordedCondition, recorded_comparisons
from evaluation.study.surveys import Further, Survey
from evaluation.study.tasks.change import ChangeTask, surveyed_change
from evaluation.study.tasks.place import PlaceTask, PoseTask
from evaluation.study.tasks.task import Pair as ComparedPair
from evaluation.study.tasks.task import Task

# Expected seconds: for the maps of a drive of 3000 scans, for its places or
# queries, to draw a city or a change, and to compare two drives by a method.
_MAP_COST = 19.0
_ROLE_COST = 10.0
_DRAWING_COST = 5.0
_RECOGNITION_COST = 3.5
# The experiment whose rows a report writes, its tasks and its seed.
_EXPERIMENT = "stages"
_TASKS: Mapping[str, type[Task]] = {
    task.name: task for task in (PlaceTask, PoseTask, ChangeTask)
}
_SEED = 1


@dataclass(frozen=True)
class Study:
    """A comparison of recordings, with a report; recordings need not exist yet.

    A recording can serve as a control: its drive goes through one stage of a
    map, on the route of the drive through another stage. Its comparison with
    the usual drive through the same stage shows the effect of the route alone.

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
    def cities(self) -> list[City]:
        """The recordings of the study, grouped by map.

        Raises:
            InputError: two recordings have the same map and stage.
        """
        return group_cities(self.recordings, self.reference)

    @cached_property
    def _files(self) -> StudyFiles:
        return StudyFiles(self.output.absolute())

    def jobs(self) -> list[Job]:
        """Returns the jobs whose results `assemble` puts into a report.

        For a city with one stage, only its route is drawn. Descriptions that
        an earlier report removed (see `assemble`) are made again by the jobs if
        new results need them.

        Raises:
            InputError: see `cities`.
        """
        jobs = [job for city in self.cities for job in self._city_jobs(city)]
        if self._costed_pairs:
            needs = tuple(job.name for job in jobs)
            jobs.append(self._cost_job(self._costed_pairs[0], needs))
        _restore(jobs)
        return jobs

    @property
    def _costed_pairs(self) -> list[Pair]:
        return [
            pair
            for city in self.cities
            for pair in city.recognition_pairs()
            if self.with_costs
        ]

    def assemble(
        self,
        pages: Mapping[str, str] | None = None,
        on_note: Callable[[str], None] = lambda text: None,
        *,
        with_tables: bool = False,
    ) -> Path:
        """Writes the report, once all jobs are done.

        What it was made from stays, except descriptions of places, which take
        most of the space. They are made again if new results need them.

        The report consists of these files:

        - `report.html`: the whole report, in one file.
        - `report.md`: the report as Markdown.
        - `results.csv`, `queries.csv`: the results and the answers to queries,
          the same as those of the experiment `stages`.
        - `figures`: a folder with figures. Figures that exist are kept.

        If they are asked for, wide tables follow. They are views of the same
        results:

        - Tables, each as .csv (with all numbers), .md and .tex: `survival`,
          `tcr`, `place_recognition`, `poses`, and `costs` if costs were
          measured.
        - `metrics.csv`: the metrics of other benchmarks.
        - `differences.csv`: the differences between methods.
        - `why.csv`: the reasons for wrong best places.
        - `query_details.csv`, `query_details_unchanged.csv`: each query of the
          pairs of drives, and of their controls.

        Args:
            pages: name of a recording -> address of its 3-D page, relative to
                the report. Recordings without a page are left out.
            on_note: is called with a note on each city without a pair to
                compare. The report contains these notes, too.
            with_tables: whether to write the wide tables.

        Returns:
            The path of `report.html`.

        Raises:
            InputError: a job has not been done, or a file cannot be written.
        """
        doing("writing the report")
        folder = self._files.figures
        make_folder(folder)
        report = page.Report(pages=pages or {}, reference=self.reference)
        report.made_by = [
            f"cns-drake {__version__}",
            *(one.key for one in self.methods if one.settings),
            self.protocol.to_text(),
        ]
        for city in self.cities:
            self._collect(city, report)
        report.results = self._results()
        if self.protocol.exclude_recent is None:
            report.notes = nothing_to_compare(self.cities)
        for note in report.notes:
            on_note(note)
        report.differences = result_tables.method_differences(
            report.recognitions
        )
        for shown in page.chart_illustrations(report, folder):
            report.illustrations.insert(0, shown)
        if self._costed_pairs:
            report.costs = self._files.part("costs", "costs").read()
        written = page.write_report(
            report, self.output, with_tables=with_tables
        )
        for city in self.cities:
            for job in self._city_jobs(city):
                if isinstance(job.step, Survey):
                    job.step.files.spend()
        return written

    def _results(self) -> Results:
        """Writes the two tables; returns the results that the page shows."""
        columns = {
            one.key: {
                f"{SETTINGS}{one.name}.{name}": value
                for name, value in one.settings
            }
            for one in self.methods
        }
        engine = Engine(
            _EXPERIMENT,
            made_tasks({name: {} for name in _TASKS}, _TASKS, _EXPERIMENT),
            {one.key: (one, columns[one.key]) for one in self.methods},
            self._files.output,
        )
        for city in self.cities:
            engine.measured += self._comparisons(city)
        results, _ = engine.write_tables()
        shown = (
            row
            for row in results.rows
            if row.task == "change" or row.gate == self.protocol.gate
        )
        return Results(results.factors, tuple(shown))

    def _comparisons(self, city: City) -> list[MeasuredPair]:
        """Returns the comparisons of the experiment `stages`."""
        found = recorded_comparisons(
            city,
            [
                RecordedCondition({STAGE: LAST}, LAST, True, self.protocol),
                RecordedCondition({STAGE: OWN}, OWN, False, self.protocol),
            ],
            _SEED,
            # The page says which pairs have no control.
            lambda text: None,
            both_ways=True,
        )
        comparisons = list(found)
        for one in comparisons:
            place = self._outcomes(one.pair)
            change = self._files.part("change", one.pair.name)
            one.parts.update(place=place, pose=place, change=change)
        return comparisons

    def _outcomes(self, pair: ComparedPair) -> Part:
        return self._files.part("place", pair.name)

    def _result(self, pair: Pair, key: str) -> Part:
        """Returns the file with the result of a run, which `key` names."""
        names = (one.name for one in pair)
        return self._files.part("recognition", *names, key)

    def _outcome(
        self, city: City, pair: Pair, measured: Pair, run: Run
    ) -> PlaceOutcome:
        """Returns the outcome of a run, with the names that the page shows."""
        wanted = run.protocol.gate
        outcomes = self._result(measured, run.queries).read()
        (found,) = (one for one in outcomes if one.is_gated == wanted)
        stages = (one.stage for one in pair)
        return replace(found, method=run.method.name, pair=(city.name, *stages))

    def _evidence(self, pair: Pair) -> Part:
        """Returns the file with evidence on why best places are wrong."""
        return self._files.part("why", *(one.name for one in pair))

    def _pairs(self, city: City) -> list[Pair]:
        return city.recognition_pairs(
            with_itself=self.protocol.exclude_recent is not None
        )

    def _city_jobs(self, city: City) -> list[Job]:
        pairs = {
            f"{city.name} {pair[0].stage} > {pair[1].stage}": pair
            for pair in self._pairs(city)
        }
        # Two pairs may share a control.
        controls = {
            f"control {both[0].name} > {both[1].name}": both
            for pair in pairs.values()
            if (both := city.unchanged_pair(*pair)) is not None
        }
        drives = {one.name: one for one in city.stages.values()}
        roles: dict[str, set[Role]] = defaultdict(set)
        for database, query in (*pairs.values(), *controls.values()):
            drives |= {database.name: database, query.name: query}
            roles[database.name].add("places")
            roles[query.name].add("queries")
        explained = {
            one.name for pair in (pairs | controls).values() for one in pair
        }
        jobs = [
            Job(
                f"survey {name}",
                Survey(
                    one.source,
                    frozenset(roles[name]),
                    self.methods,
                    self.protocol,
                    self._files.survey(name),
                    with_scans=name in explained,
                    further=self._further(city, one),
                ),
                one.needs,
                _MAP_COST + _ROLE_COST * len(roles[name]),
            )
            for name, one in drives.items()
        ]
        jobs.append(self._drawing_job(city))
        jobs += [self._change_job(city, pair) for pair in city.change_pairs()]
        jobs += [
            self._recognition_job(city, pair, name, explains=name in pairs)
            for name, pair in (pairs | controls).items()
        ]
        # Two pairs may share a control.
        compared = {one.pair.name: one for one in self._comparisons(city)}
        return jobs + [self._tcr_job(one) for one in compared.values()]

    def _tcr_job(self, one: MeasuredPair) -> Job:
        """Returns the job that measures change, as in the table of results."""
        names = one.pair.database.name, one.pair.query.name
        step = MakePart(
            one.parts["change"],
            surveyed_change,
            tuple(self._files.survey(name).drive for name in names),
        )
        needs = tuple(f"survey {name}" for name in dict.fromkeys(names))
        return Job(f"tcr {one.pair.name}", step, needs, _RECOGNITION_COST)

    def _further(self, city: City, drive: RecordingInfo) -> tuple[Further, ...]:
        """Returns the descriptions of a drive that repeated runs need."""
        roles: dict[tuple[MethodChoice, RetrievalProtocol], set[Role]]
        roles = defaultdict(set)
        for pair in city.recognition_pairs():
            for run in city.runs(pair, self.methods, self.protocol):
                key = run.method, run.protocol
                if run.repeats and pair[1] is drive:
                    roles[key].add("queries")
                if run.repeats and pair[0] is drive and not run.shares_places:
                    roles[key].add("places")
        return tuple(
            (method, frozenset(needed), protocol)
            for (method, protocol), needed in roles.items()
        )

    def _drawing_job(self, city: City) -> Job:
        stages = city.stages.values()
        surveys = [(one, self._files.survey(one.name)) for one in stages]
        stem = self._files.figures / figures.routes_stem(city)
        step = MakePart(
            self._files.part("pages", city.name),
            figures.draw_city,
            (
                city.name,
                tuple(
                    (drive.stage, one.drive, one.fine, drive.source)
                    for drive, one in surveys
                ),
                stem,
            ),
            figures.figure_files(stem),
        )
        return Job(
            f"draw {city.name}", step, _survey_names(stages), _DRAWING_COST
        )

    def _change_job(self, city: City, pair: Pair) -> Job:
        both = city.unchanged_pair(*pair) or ()
        drives = [*pair, *(one for one in both if one not in pair)]
        earlier, later = pair
        surveys = tuple(self._files.survey(one.name) for one in drives)
        stems = tuple(
            self._files.figures / name
            for name in figures.change_stems(city, pair)
        )
        step = MakePart(
            self._files.part("changes", earlier.name, later.name),
            figures.compare_stages,
            (
                city.name,
                (earlier.stage, later.stage),
                tuple(one.drive for one in surveys),
                (surveys[0].fine, surveys[1].fine),
                stems,
            ),
            figures.figure_files(*stems),
        )
        return Job(
            f"change {city.name} {earlier.stage} > {later.stage}",
            step,
            _survey_names(drives),
            _DRAWING_COST,
        )

    def _recognition_job(
        self, city: City, pair: Pair, name: str, *, explains: bool
    ) -> Job:
        """Returns the job that runs the methods on a pair.

        With `explains`, the job also finds why best places are wrong, and
        repeats runs by the protocol of published numbers.
        """
        database, query = pair
        surveys = [self._files.survey(one.name) for one in pair]
        scans = surveys[0].scans, surveys[1].scans

        overlaps = self._files.part("overlaps", *(one.name for one in pair))
        steps = []
        if self.methods:
            first = self.methods[0]
            described = tuple(one.described(first.key) for one in surveys)
            steps.append(
                MakePart(
                    overlaps,
                    measurements.shown_overlaps,
                    (scans, described, first, self.protocol),
                )
            )
        runs = city.runs(pair, self.methods, self.protocol)
        for run in runs:
            if explains or not run.repeats:
                arguments = (
                    (
                        surveys[0].described(run.places),
                        surveys[1].described(run.queries),
                    ),
                    None if run.repeats else overlaps,
                    run.method,
                    run.protocol,
                )
                part = self._result(pair, run.queries)
                steps.append(
                    MakePart(part, measurements.recognise_places, arguments)
                )
        own = tuple(self._result(pair, one.key) for one in self.methods)
        steps += [
            MakePart(part, measurements.outcomes_of, (own,))
            for part in {
                self._outcomes(one.pair)
                for one in self._comparisons(city)
                if (one.pair.database.name, one.pair.query.name)
                == (database.name, query.name)
            }
        ]
        if explains:
            steps.append(
                MakePart(
                    self._evidence(pair),
                    explain_faults,
                    (scans, self.methods, own, overlaps, self.protocol),
                )
            )
        cost = _RECOGNITION_COST * len(steps)
        step = Steps(steps[0].output, tuple(steps))
        return Job(name, step, _survey_names(pair), cost)

    def _cost_job(self, pair: Pair, needs: tuple[str, ...]) -> Job:
        """Returns the job that measures costs, after all other jobs."""
        places, queries = (self._files.survey(one.name) for one in pair)
        described = tuple(
            (places.described(one.key), queries.described(one.key))
            for one in self.methods
        )
        source, drive = pair[1].source, queries.drive
        step = MakePart(
            self._files.part("costs", "costs"),
            measurements.measure_costs,
            (source, drive, self.methods, described, self.protocol),
        )
        return Job("costs of the methods", step, needs, _DRAWING_COST)

    def _collect(self, city: City, report: page.Report) -> None:
        """Adds the results of a city to a report."""
        files = self._files
        for earlier, later in city.change_pairs():
            change = files.part("changes", earlier.name, later.name).read()
            report.changes.append(change)
        compared = []
        for pair in self._pairs(city):
            control = city.unchanged_pair(*pair)
            for run in city.runs(pair, self.methods, self.protocol):
                found = self._outcome(city, pair, pair, run)
                if not found.outcomes.has_match.any():
                    continue
                if run.repeats:
                    report.repeated.append(found)
                    continue
                compared.append(found)
                if pair[0] is not pair[1]:
                    before = None
                    if control is not None:
                        before = self._outcome(city, pair, control, run)
                        if not before.outcomes.has_match.any():
                            before = None
                    report.pairs.append((found, before))
            evidence = self._evidence(pair).read()
            if evidence is not None and control is not None:
                drives = (one.name for one in control)
                unchanged = self._files.part("overlaps", *drives).read()
                evidence = replace(evidence, unchanged=unchanged)
            if evidence is not None:
                report.evidence[pair[0].name, pair[1].name] = evidence
            names = {one.name for one in (*pair, *(control or ()))}
            for name in sorted(names - report.tracks.keys()):
                survey = files.survey(name).drive.read()
                report.tracks[name] = result_tables.DriveTrack(
                    survey.stamps_ns, survey.X_WS
                )
        if compared:
            stem = files.figures / figures.curves_stem(city)
            draw_pr_curves(city.name, compared, stem)
        report.recognitions += compared
        report.drives.update(files.part("pages", city.name).read())
        report.illustrations += figures.illustrations(city, files.figures)


def _restore(jobs: Sequence[Job]) -> None:
    """Has removed descriptions made again that results to come need.

    Args:
        jobs: all jobs of a study, each behind those that it needs.
    """
    names = {job.name for job in jobs}
    # Files that will be written, and folders of surveys of new recordings.
    stale: set[Path] = set()
    needed: list[Part] = []
    for job in jobs:
        if isinstance(job.step, Survey):
            stale.update(part.path for part in job.step.missing())
            if not names.issuperset(job.needs):
                stale.add(job.step.files.folder)
            continue
        steps = job.step.steps if isinstance(job.step, Steps) else [job.step]
        for step in steps:
            if isinstance(step, MakePart):
                inputs = list(step.parts())
                read = {one.path for one in inputs}
                read |= {one.path.parent for one in inputs}
                if not stale.isdisjoint(read) or not nothing_left(step):
                    stale.add(step.part.path)
                    needed += inputs
    for part in needed:
        part.restore()


def _survey_names(recordings: Iterable[RecordingInfo]) -> tuple[str, ...]:
    return tuple(f"survey {recording.name}" for recording in recordings)


def write_report(
    recordings: Path,
    output: Path,
    cluster: Cluster,
    own_methods: Iterable[Path] = (),
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

    The files of the report are described in `Study.assemble`. Results of an
    earlier run, finished or not, are used if they belong to the same recordings
    and methods.

    Args:
        recordings: the folder.
        output: folder of the report.
        cluster: runs the jobs.
        own_methods, settings: files and settings of methods, see
            `evaluation.study.chosen_methods.choose_methods`.
        protocol: protocol of place recognition.
        on_note: is called with notes: on how recordings are read or left out,
            on what methods assume, and on cities without a pair to compare.
        with_costs: whether times and memory of methods are measured.
        reference_for: function that returns published numbers for the maps of a
            report.
        lidar: name of the LiDAR, for recordings with several.
        columns: number of columns of `.bin` files; by default guessed from the
            values.
        with_tables: whether to write the wide tables, too.

    Returns:
        The path of `report.html`.

    Raises:
        InputError: a recording cannot be read, there is nothing to compare and
            maps and stages were guessed, or the output cannot be written.
    """
    methods = choose_methods(own_methods, settings)
    found = find_recordings(recordings, on_note, lidar, columns)
    for choice in methods:
        method = choice.make()
        for note in {method.assumption(one.lidar_field) for one in found}:
            if note is not None:
                on_note(note)
    reference = reference_for({one.map_name for one in found})
    study = Study(found, output, methods, protocol, with_costs, reference)
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
