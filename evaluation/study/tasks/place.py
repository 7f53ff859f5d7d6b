"""The tasks `place`, `pose` and `cost`, on place recognition."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
import math
from typing import Any

from cns_drake.base.jobs.running import Job
from cns_drake.base.jobs.step import Reporter, Steps
from cns_drake.base.progress import track
from evaluation.recognition.costs import NUM_TRIALS, QueryCost, measure_search
from evaluation.recognition.kept_places import KEEP_ALL
from evaluation.recognition.place_numbers import place_numbers, pose_numbers
from evaluation.recognition.place_outcome import PlaceOutcome
from evaluation.recognition.result_number import Number
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.databases import searched_database
from evaluation.study.place_measurements import (
    measure_method,
    measure_places,
    shown_overlaps,
)
from evaluation.study.storage.parts import MakePart, Part
from evaluation.study.tasks.jobs import Jobs, num_described
from evaluation.study.tasks.pair import Pair, Result
from evaluation.study.tasks.task import Answered, Task

# Expected time to start a job [s].
_STARTING_COST = 2.0
# Expected time of a method to answer a query, with geometric verification, and
# to compare it with one more place [s].
_QUERY_COST = 0.045
_PLACE_COST = 3e-5
# Expected time to find what the matches of a query show [s].
_OVERLAP_COST = 0.2

Outcomes = Sequence[PlaceOutcome]


class PoseTask(Task):
    """Measures the errors of pose estimates.

    A method estimates the pose of each query relative to its top-ranked place.
    """

    name = "pose"
    asks = True
    _numbers = staticmethod(pose_numbers)

    def measure(self, pair: Pair, jobs: Jobs) -> tuple[Result, ...]:
        needs: list[str] = []
        radii = tuple(sorted(jobs.radii[pair.key]))
        protocol = replace(pair.protocol, radius=radii[0])
        database, query = (
            jobs.described(
                drive, role, pair.protocol, needs, kept=pair.is_composed
            )
            for drive, role in pair.roles
        )
        others = jobs.distractor_places(pair, needs)
        beside = jobs.beside(pair, needs)
        num_queries = num_described(pair.query, "queries", pair.protocol)
        # The task `place` reads the same files.
        if not (isinstance(database, tuple) and isinstance(query, tuple)):
            part = jobs.files.part("place", pair.key)
            arguments = (
                database,
                query,
                others,
                pair.distractors,
                jobs.methods,
                protocol,
                radii,
                pair.overlaps,
                jobs.leaves_out_slow,
            )
            cost = _search_cost(pair, jobs, num_queries)
            cost += _OVERLAP_COST * num_queries
            for (drive, role), found in zip(
                pair.roles, (database, query), strict=True
            ):
                if not isinstance(found, tuple):
                    cost += jobs.description_cost(drive, role, pair.protocol)
            return (jobs.add(part, measure_places, arguments, needs, cost),)
        # Each method has a file, so that another method leaves it as it is.
        shown = MakePart(
            jobs.files.part("overlaps", pair.key),
            shown_overlaps,
            (
                (database[0], query[0]),
                (database[1], query[1]),
                jobs.methods[0],
                protocol,
                radii,
                tuple((parts[0], parts[1]) for parts in beside),
                pair.leaves_out_itself,
                pair.keep,
            ),
        )
        steps = [
            MakePart(
                jobs.files.part("place", pair.key, choice.key),
                measure_method,
                (
                    database[k],
                    query[k],
                    tuple(parts[k - 1] for parts in others),
                    pair.distractors,
                    choice,
                    shown.part,
                    protocol,
                    radii,
                    tuple(parts[k] for parts in beside),
                    pair.leaves_out_itself,
                    pair.keep,
                ),
            )
            for k, choice in enumerate(jobs.methods, start=1)
        ]
        name = f"place {pair.key}"
        whole = Steps(shown.part.path, (shown, *steps))
        cost = _search_cost(pair, jobs, num_queries)
        cost += _OVERLAP_COST * num_queries
        jobs.jobs[name] = Job(name, whole, tuple(needs), cost)
        return tuple(one.part for one in steps)

    def found(self, pair: Pair) -> Outcomes:
        radius = pair.protocol.radius
        return [
            one
            for part in pair.parts[self.name]
            for one in part.read()
            if one.radius == radius
        ]

    def numbers(
        self, found: Outcomes, before: Outcomes | None
    ) -> Iterator[Number]:
        for now in found:
            yield from self._numbers(now, _same_settings_outcome(before, now))


class PlaceTask(PoseTask):
    """Measures how well methods find a query's place in the database."""

    name = "place"
    _numbers = staticmethod(place_numbers)

    def answers(self, found: Outcomes) -> Iterator[Answered]:
        for now in found:
            yield now.method, now.is_gated, now.columns


class CostTask(Task):
    """Measures what a database costs: its memory, and the time of a query."""

    name = "cost"
    asks = True

    def measure(self, pair: Pair, jobs: Jobs) -> tuple[Result, ...]:
        needs: list[str] = []
        database, query = (
            jobs.described(drive, role, pair.protocol, needs, kept=True)
            for drive, role in pair.roles
        )
        assert isinstance(database, tuple)
        assert isinstance(query, tuple)
        arguments = (
            database[1:],
            query[1:],
            jobs.distractor_places(pair, needs),
            pair.distractors,
            jobs.methods,
            tuple(parts[1:] for parts in jobs.beside(pair, needs)),
            pair.keep,
            pair.protocol.place_spacing,
        )
        part = jobs.files.part("cost", pair.key)
        cost = _search_cost(pair, jobs, NUM_TRIALS)
        return (jobs.add(part, measure_costs, arguments, needs, cost),)

    def numbers(self, found: Any, before: Any | None) -> Iterator[Number]:
        for method, cost in found.items():
            for name, value in (
                ("build_time", 1e-3 * cost.build_ms),
                ("query_time", 1e-3 * cost.query_ms),
                ("memory", float(cost.memory)),
            ):
                yield Number(method, False, name, value, n=cost.places)


def _search_cost(pair: Pair, jobs: Jobs, num_queries: float) -> float:
    """Returns the expected time of queries by all methods [s]."""
    own, others = (
        sum(num_described(one, "places", pair.protocol) for one in drives)
        for drives in ((pair.database, *pair.beside), jobs.distractors)
    )
    num_places = own + min(pair.distractors, others)
    each = len(jobs.methods) * (_QUERY_COST + _PLACE_COST * num_places)
    return _STARTING_COST + num_queries * each


def measure_costs(
    reporter: Reporter,
    database: tuple[Part, ...],
    query: tuple[Part, ...],
    distractors: tuple[tuple[Part, ...], ...],
    num_distractors: int,
    methods: tuple[MethodChoice, ...],
    beside: tuple[tuple[Part, ...], ...] = (),
    keep: str | int = KEEP_ALL,
    cell: float = math.inf,
) -> dict[str, QueryCost]:
    """Returns the cost of searching a database, by the key of each method.

    Args:
        reporter: reports progress.
        database, query: files with the descriptors of places and of queries,
            one file for each method.
        distractors: for each drive through another city, files with the
            descriptors of its places, one file for each method.
        num_distractors: number of places of the drives through other cities
            that are added to the database.
        methods: methods to measure.
        beside: for each further drive in the same world, files with the
            descriptors of its places, one file for each method.
        keep, cell: which places in this world are kept, see
            `evaluation.recognition.kept_places.kept_places`.
    """
    found = {}
    for k, choice in enumerate(
        track(methods, "measuring methods", len(methods), "methods")
    ):
        method = choice.make()
        others = [parts[k] for parts in distractors]
        near = [parts[k] for parts in beside]
        searched = searched_database(
            database[k],
            others,
            num_distractors,
            near,
            keep,
            cell,
            divides=method.divides,
        )
        asked = query[k].read()[1]
        found[choice.key] = measure_search(
            method, searched.described.places, asked
        )
    return found


def _same_settings_outcome(
    before: Outcomes | None, now: PlaceOutcome
) -> PlaceOutcome | None:
    """Returns the baseline's outcome with `now`'s method and verification."""
    for one in before or ():
        if (one.method, one.is_gated) == (now.method, now.is_gated):
            return one
    return None
