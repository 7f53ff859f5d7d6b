"""The part of a report that one city makes."""

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import partial

from cns_drake.base.jobs.running import Job
from cns_drake.drives.same_world import check_same_world
from evaluation.recognition.describing import Role
from evaluation.recognition.place_outcome import PlaceOutcome
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.report.contents import Report
from evaluation.report.curve_figures import draw_pr_curves
from evaluation.report.reference import Reference
from evaluation.report.tables.queries import DriveTrack
from evaluation.results.keys import LAST, OWN, STAGE
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.engine import Engine
from evaluation.study.extraction_jobs import ExtractionJobs
from evaluation.study.feature_extraction import Further
from evaluation.study.recordings.map_drives import MapDrives, Recordings
from evaluation.study.recordings.recorded_pairs import (
    RecordedCondition,
    recorded_pairs,
)
from evaluation.study.report_jobs import figures
from evaluation.study.report_jobs.fault_evidence import explain_faults
from evaluation.study.report_jobs.repeats import Repeat, repeats_of
from evaluation.study.storage.parts import MakePart, Part
from evaluation.study.storage.study_files import StudyFiles
from evaluation.study.tasks.pair import Pair, Result

# Expected time to compare two drives by a method [s].
_RECOGNITION_COST = 3.5
# The seed of the experiment.
_SEED = 1


class CityReport:
    """The part of a report that one city makes.

    Attributes:
        jobs: name -> job. The jobs are the jobs of the engine, and jobs for the
            page, which draw figures, explain wrong answers and repeat published
            runs.
    """

    def __init__(
        self,
        city: MapDrives,
        engine: Engine,
        published: Engine,
        files: StudyFiles,
        methods: tuple[MethodChoice, ...],
        protocol: RetrievalProtocol,
        reference: Reference,
    ):
        """Adds the pairs of a city to the engines of the report.

        Args:
            city: the drives of the city.
            engine: measures the pairs of the experiment.
            published: measures second runs, by the protocol of published
                numbers.
            files: the paths of all files of the report.
            methods: methods to run.
            protocol: protocol of place recognition.
            reference: published numbers to compare with.
        """
        self._city = city
        self._files = files
        self._methods = methods
        self._protocol = protocol
        self._with_itself = protocol.exclude_recent is not None
        self._pairs = city.recognition_pairs(with_itself=self._with_itself)
        self._repeats = {
            (one.name, other.name): repeats_of(
                (city.name, one.stage, other.stage),
                methods,
                protocol,
                reference,
            )
            for one, other in city.recognition_pairs()
        }
        self._sessions = list(self._pairs_of_sessions())
        measured = self._measured_pairs()
        # Names of the drives and their condition -> the pair.
        self._measured = {
            (*one.names, one.factors[STAGE]): one for one in measured
        }
        planned = engine.add(
            measured,
            make_jobs=partial(
                ExtractionJobs, further=self._further_descriptors()
            ),
        )
        assert isinstance(planned, ExtractionJobs)
        self._drawing, drawing_job = figures.city_job(city, files, planned)
        self._changes, change_jobs = self._drawn_changes(planned)
        evidence_jobs = map(self._evidence_job, self._pairs)
        # The jobs of `planned` come first: jobs of the page add what they need
        # to them.
        self.jobs = dict(planned.jobs)
        for job in (drawing_job, *change_jobs, *evidence_jobs):
            self.jobs[job.name] = job
        self._repeated = self._add_second_runs(published)

    def _measured_pairs(self) -> list[Pair]:
        """Returns the pairs that the experiment measures, with controls."""
        pairs = recorded_pairs(
            self._city,
            [
                RecordedCondition({STAGE: LAST}, LAST, True, self._protocol),
                RecordedCondition({STAGE: OWN}, OWN, False, self._protocol),
            ],
            _SEED,
            # The page says which pairs have no control.
            lambda text: None,
            both_ways=True,
            with_itself=self._with_itself,
        )
        return [*pairs, *(together for _, together in self._sessions)]

    def _drawn_changes(
        self, planned: ExtractionJobs
    ) -> tuple[list[Part], list[Job]]:
        """Returns the files of drawn changes, and the jobs that make them."""
        changes, jobs = [], []
        for pair in self._city.change_pairs():
            parts = tuple(
                part
                for stage in (OWN, LAST)
                if (one := self._measured_or_control(pair, stage)) is not None
                for part in one.parts["change"]
                if isinstance(part, Part)
            )
            change, job = figures.change_job(
                self._city, pair, parts, self._files, planned
            )
            changes.append(change)
            jobs.append(job)
        return changes, jobs

    def _add_second_runs(
        self, published: Engine
    ) -> dict[tuple[str, str], list[Pair]]:
        """Adds second runs; returns them by the names of their drives."""
        repeated: dict[tuple[str, str], list[Pair]] = {}
        for pair in self._pairs:
            own = self._measured_or_control(pair)
            assert own is not None
            for again in self._repeats.get(own.names, ()):
                one = again.of(own)
                added = published.add([one], make_jobs=again.jobs)
                self.jobs |= added.jobs
                repeated.setdefault(own.names, []).append(one)
        return repeated

    def _measured_or_control(
        self, pair: Recordings, stage: str = OWN
    ) -> Pair | None:
        """Returns a pair as it is measured, or (stage `last`) its control."""
        return self._measured.get((pair[0].name, pair[1].name, stage))

    def _pairs_of_sessions(self) -> Iterator[tuple[Recordings, Pair]]:
        """Yields two pairs for each earlier stage with several drives.

        The database of the first pair is the first of these drives; the
        database of the second pair contains the places of all these drives. The
        query is the drive through the last stage.

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
                {STAGE: OWN}, OWN, False, self._protocol, drives
            )
            names = "+".join(one.name for one in drives)
            for pair in recorded_pairs(
                self._city, [condition], _SEED, lambda text: None
            ):
                yield single, replace(pair, names=(names, pair.query.name))

    def _further_descriptors(self) -> dict[str, tuple[Further, ...]]:
        """Returns the descriptors that second runs need, by drive."""
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
                self._methods,
                own.parts["place"],
                self._protocol,
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
        names = {one.key: one.name for one in self._methods}
        stages = pair[0].stage, pair[1].stage
        return [
            replace(
                one, method=names[one.method], pair=(self._city.name, *stages)
            )
            for part in parts
            for one in part.read()
            if one.is_gated == self._protocol.gate
            and one.outcomes.has_match.any()
        ]

    def collect(self, report: Report, on_note: Callable[[str], None]) -> None:
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
                    f" {self._protocol.radius:g} m of a place of"
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
                report.tracks[name] = DriveTrack(drive.stamps_ns, drive.X_WS)
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
