"""The tasks `place`, `pose` and `cost`, on place recognition."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from evaluation.base import Job, MakePart, Part, Reporter, Step
from evaluation.drives import DriveSource
from evaluation.recognition import (
    FeatureExtraction,
    Number,
    PlaceComparison,
    PlaceOutcome,
    ScansOf,
    SearchCost,
    measure_places,
    numbers_of,
    shown_overlaps,
)
from evaluation.study.study_files import StudyFiles
from evaluation.study.tasks.jobs import STARTING_COST, Jobs, num_described
from evaluation.study.tasks.pair import Pair, Result
from evaluation.study.tasks.task import Answered, Task

# Expected time to find what the matches of a query show [s].
_OVERLAP_COST = 0.007

Outcomes = Sequence[PlaceOutcome]


class PoseTask(Task):
    """Measures the errors of pose estimates.

    A method estimates the pose of each query relative to its top-ranked place.

    Attributes:
        baselines: key of a method -> key of the method with which it is
            compared; a method that is missing is compared with itself.
    """

    baselines: Mapping[str, str] = {}
    name = "pose"
    asks = True

    def measure(self, pair: Pair, jobs: Jobs) -> tuple[Result, ...]:
        return tuple(one.part for one in _steps_by_method(pair, jobs))

    def found(self, pair: Pair, results: Sequence[Result]) -> Outcomes:
        radius = pair.protocol.radius
        return [
            one
            for part in results
            for one in part.read()
            if one.protocol.radius == radius
        ]

    def numbers(
        self, found: Outcomes, before: Outcomes | None
    ) -> Iterator[Number]:
        for now in found:
            method = self.baselines.get(now.method, now.method)
            verified = now.protocol.verified
            then = next(
                (
                    one
                    for one in before or ()
                    if (one.method, one.protocol.verified) == (method, verified)
                ),
                None,
            )
            yield from now.numbers(self.name, then)


def _steps_by_method(pair: Pair, jobs: Jobs) -> tuple[MakePart, ...]:
    """Returns a step for each method, and adds the job that does all of them.

    Several tasks read the files of these steps.
    """
    if not any(pair.has_method(one.name) for one in jobs.methods):
        return ()
    needs: list[str] = []
    compared = _comparison(pair, jobs, needs, kept=pair.is_composed)
    num_queries = num_described(pair.query, "queries", pair.protocol)
    cost = _search_cost(pair, jobs, num_queries)
    cost += _OVERLAP_COST * num_queries
    sides = compared.database, compared.query
    before: tuple[MakePart, ...] = ()
    if all(isinstance(one, tuple) for one in sides):
        overlaps = jobs.files.part("overlaps", pair.key)
        shown = MakePart(
            overlaps,
            shown_overlaps,
            (ScansOf(compared),),
            PlaceTask.version,
        )
        before = (shown,)
        compared = compared._replace(overlaps=overlaps)
    else:
        for (drive, role), side in zip(pair.roles, sides, strict=True):
            if not isinstance(side, tuple):
                cost += jobs.reading_cost(drive, role, pair.protocol)
                cost += jobs.description_cost(drive, role, pair.protocol)
    # Each method has files, so that another method leaves them as they are.
    steps = tuple(
        MakePart(
            jobs.files.part("place", pair.key, one.key),
            measure_places,
            (compared.by_methods([k]),),
            PlaceTask.version,
            (search_cost(jobs.files, pair.key, one.key).path,),
        )
        for k, one in enumerate(compared.methods)
    )
    sources = tuple(drive.source for drive, _ in pair.roles)
    step = _ByMethod(compared, sources, before, steps)
    name = f"place {pair.key}"
    jobs.jobs[name] = Job(name, step, tuple(needs), cost, pair.title)
    return steps


def search_cost(files: StudyFiles, pair: str, method: str) -> Part:
    """Returns the file with the `SearchCost` of a method, by keys."""
    return files.part("cost", pair, method)


@dataclass(frozen=True)
class _ByMethod(Step):
    """Compares two drives by all methods; a drive is read once.

    Attributes:
        compared: the comparison by all methods.
        sources: the drives of the database and of the queries.
        before: steps whose files the comparison needs.
        steps: for each method, the file of its outcomes and their inputs. The
            cost of the search is in a file beside, as it differs from run to
            run.
    """

    compared: PlaceComparison
    sources: tuple[DriveSource, ...]
    before: tuple[MakePart, ...]
    steps: tuple[MakePart, ...]

    @property
    def output(self) -> Path:
        return self.steps[0].output

    def is_done(self) -> bool:
        return (
            all(step.part.path.is_file() for step in self.steps)
            and all(step.is_done() for step in self.before)
            and not any(self._inputs_left())
        )

    def run(self, reporter: Reporter) -> None:
        for step in self.before:
            if not step.is_done():
                step.run(reporter)
        inputs = self._inputs_left()
        left = [k for k, made_of in enumerate(inputs) if made_of]
        measured = measure_places(reporter, self.compared.by_methods(left))
        for k, (found, cost) in zip(left, measured, strict=True):
            (beside,) = self.steps[k].figures
            Part(beside).write(inputs[k], cost)
            self.steps[k].part.write(inputs[k], found)

    def _inputs_left(self) -> list[dict[str, object]]:
        """Returns the inputs of each step, empty if its files are current.

        They do not depend on whether the drives were described before: if
        another pair needs the descriptors, too, they are in files.
        """
        drives = [source.identity() for source in self.sources]
        found = []
        for k, step in enumerate(self.steps):
            compared = self.compared.by_methods([k])._asdict()
            asked = tuple(
                value
                for name, value in compared.items()
                if name not in ("database", "query", "overlaps")
            )
            described = FeatureExtraction.version
            made_of = replace(
                step, arguments=(drives, described, asked)
            ).inputs()
            is_current = step.part.is_current(made_of) and all(
                file.is_file() for file in step.figures
            )
            found.append({} if is_current else made_of)
        return found


class PlaceTask(PoseTask):
    """Measures how well methods find a query's place in the database."""

    name = "place"

    def answers(self, found: Outcomes) -> Iterator[Answered]:
        for now in found:
            yield now.method, now.protocol.verified, now.outcomes.columns


class CostTask(Task):
    """Tells what a search costs: its memory, and the time of a query."""

    name = "cost"
    asks = True

    def measure(self, pair: Pair, jobs: Jobs) -> tuple[Result, ...]:
        steps = _steps_by_method(pair, jobs)
        return tuple(Part(file) for one in steps for file in one.figures)

    def found(
        self, pair: Pair, results: Sequence[Result]
    ) -> Sequence[SearchCost]:
        return [part.read() for part in results]

    def numbers(
        self,
        found: Sequence[SearchCost],
        before: Sequence[SearchCost] | None,
    ) -> Iterator[Number]:
        for cost in found:
            yield from numbers_of(self.name, cost, method=cost.method)


def _comparison(
    pair: Pair, jobs: Jobs, needs: list[str], *, kept: bool
) -> PlaceComparison:
    """Returns what is compared for a pair, and adds the jobs it needs.

    Args:
        pair: the pair.
        jobs: the jobs.
        needs: list to which the names of the added jobs are appended.
        kept: whether both drives must be in files.
    """
    database, query = (
        jobs.described(drive, role, pair.protocol, needs, kept=kept)
        for drive, role in pair.roles
    )
    radii = tuple(sorted(jobs.radii[pair.key]))
    by_all = PlaceComparison(
        database,
        query,
        jobs.methods,
        replace(pair.protocol, radius=radii[0]),
        radii,
        tuple(
            tuple(described)
            for _, *described in jobs.further_places(
                jobs.distractors if pair.distractors else (),
                pair.protocol,
                needs,
            )
        ),
        pair.distractors,
        jobs.further_places(pair.beside, pair.protocol, needs),
        pair.keep,
    )
    return by_all.by_methods(
        [k for k, one in enumerate(jobs.methods) if pair.has_method(one.name)]
    )


def _search_cost(pair: Pair, jobs: Jobs, num_queries: float) -> float:
    """Returns the expected time of queries by all methods [s]."""
    own, others = (
        sum(num_described(one, "places", pair.protocol) for one in drives)
        for drives in ((pair.database, *pair.beside), jobs.distractors)
    )
    num_places = own + min(pair.distractors, others)
    methods = [
        choice.make() for choice in jobs.methods if pair.has_method(choice.name)
    ]
    each = sum(one.query_time + one.place_time * num_places for one in methods)
    return STARTING_COST + num_queries * each
