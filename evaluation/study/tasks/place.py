"""The tasks `place`, `pose` and `cost`, on place recognition."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from cns_drake.base import Job, Reporter, Step, track
from evaluation.recognition import (
    NUM_TRIALS,
    Number,
    PlaceOutcome,
    QueryCost,
    measure_search,
    numbers_of,
)
from evaluation.study.parts import MakePart, Part
from evaluation.study.place_measurements import (
    PlaceComparison,
    ScansOf,
    measure_places,
    shown_overlaps,
)
from evaluation.study.tasks.jobs import STARTING_COST, Jobs, num_described
from evaluation.study.tasks.pair import Pair, Result
from evaluation.study.tasks.task import Answered, Task

# Expected time to find what the matches of a query show [s].
_OVERLAP_COST = 0.2

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
        if not any(pair.has_method(one.name) for one in jobs.methods):
            return ()
        needs: list[str] = []
        compared = _comparison(pair, jobs, needs, kept=pair.is_composed)
        num_queries = num_described(pair.query, "queries", pair.protocol)
        cost = _search_cost(pair, jobs, num_queries)
        cost += _OVERLAP_COST * num_queries
        # The task `place` reads the same files. Each method has a file, so that
        # another method leaves it as it is.
        parts = tuple(
            jobs.files.part("place", pair.key, one.key)
            for one in compared.methods
        )
        sides = compared.database, compared.query
        if all(isinstance(one, tuple) for one in sides):
            overlaps = jobs.files.part("overlaps", pair.key)
            shown = MakePart(
                overlaps,
                shown_overlaps,
                (ScansOf(compared),),
                PlaceTask.version,
            )
            compared = compared._replace(overlaps=overlaps)
            step = _Steps(overlaps.path, (shown, *_by_method(parts, compared)))
        else:
            for (drive, role), side in zip(pair.roles, sides, strict=True):
                if not isinstance(side, tuple):
                    cost += jobs.reading_cost(drive, role, pair.protocol)
                    cost += jobs.description_cost(drive, role, pair.protocol)
            step = _AtOnce(parts[0].path, _by_method(parts, compared), compared)
        name = f"place {pair.key}"
        jobs.jobs[name] = Job(name, step, tuple(needs), cost, pair.title)
        return parts

    def found(self, pair: Pair, results: Sequence[Result]) -> Outcomes:
        radius = pair.protocol.radius
        return [
            one
            for part in results
            for one in part.read()
            if one.radius == radius
        ]

    def numbers(
        self, found: Outcomes, before: Outcomes | None
    ) -> Iterator[Number]:
        for now in found:
            method = self.baselines.get(now.method, now.method)
            then = _outcome_of(before, method, now.is_verified)
            yield from now.numbers(self.name, then)


def _by_method(
    parts: Sequence[Part], compared: PlaceComparison
) -> tuple[MakePart, ...]:
    """Returns a step for each method, which writes its outcomes to a file."""
    return tuple(
        MakePart(
            part,
            measure_places,
            (compared.by_methods([k]),),
            PlaceTask.version,
        )
        for k, part in enumerate(parts)
    )


@dataclass(frozen=True)
class _Steps(Step):
    """Several steps that run in order, except steps that are already done.

    Attributes:
        place: the file or folder that only one process at a time may write; see
            `Step.output`.
        steps: the steps, in an order in which each step finds its inputs.
    """

    place: Path
    steps: tuple[Step, ...]

    @property
    def output(self) -> Path:
        return self.place

    def is_done(self) -> bool:
        return all(step.is_done() for step in self.steps)

    def run(self, reporter: Reporter) -> None:
        for step in self.steps:
            if not step.is_done():
                step.run(reporter)


@dataclass(frozen=True)
class _AtOnce(_Steps):
    """The steps of `_by_method`, for which a drive is read once.

    Attributes:
        compared: the comparison by all methods.
    """

    steps: tuple[MakePart, ...]
    compared: PlaceComparison

    def run(self, reporter: Reporter) -> None:
        left = [k for k, one in enumerate(self.steps) if not one.is_done()]
        inputs = [self.steps[k].inputs() for k in left]
        found = measure_places(reporter, self.compared.by_methods(left))
        for k, made_of in zip(left, inputs, strict=True):
            method = self.compared.methods[k].key
            of_method = [one for one in found if one.method == method]
            self.steps[k].part.write(made_of, of_method)


class PlaceTask(PoseTask):
    """Measures how well methods find a query's place in the database."""

    name = "place"

    def answers(self, found: Outcomes) -> Iterator[Answered]:
        for now in found:
            yield now.method, now.is_verified, now.columns


class CostTask(Task):
    """Measures what a database costs: its memory, and the time of a query."""

    name = "cost"
    asks = True

    def measure(self, pair: Pair, jobs: Jobs) -> tuple[Result, ...]:
        needs: list[str] = []
        compared = _comparison(pair, jobs, needs, kept=True)
        part = jobs.files.part("cost", pair.key)
        cost = _search_cost(pair, jobs, NUM_TRIALS)
        found = jobs.add(
            part,
            measure_costs,
            (compared,),
            needs,
            cost,
            self.version,
            pair.title,
        )
        return (found,)

    def numbers(self, found: Any, before: Any | None) -> Iterator[Number]:
        for method, cost in found.items():
            yield from numbers_of(self.name, cost, method=method)


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
        jobs.distractor_places(pair, needs),
        pair.distractors,
        tuple(jobs.beside(pair, needs)),
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


def measure_costs(
    reporter: Reporter, compared: PlaceComparison
) -> dict[str, QueryCost]:
    """Returns the cost of searching a database, by the key of each method.

    Args:
        reporter: reports progress.
        compared: the drives, which are in files, and the methods to measure.
    """
    (_, *database), (_, *query) = compared.stored
    found = {}
    methods = compared.methods
    for k, choice in enumerate(
        track(methods, "measuring methods", len(methods), "methods")
    ):
        method = choice.make()
        searched = compared.searched(k, database[k], method)
        asked = query[k].read()
        found[choice.key] = measure_search(
            method, searched.described.places, asked
        )
    return found


def _outcome_of(
    before: Outcomes | None, method: str, is_verified: bool
) -> PlaceOutcome | None:
    """Returns the outcome of a method, with or without verification."""
    for one in before or ():
        if (one.method, one.is_verified) == (method, is_verified):
            return one
    return None
