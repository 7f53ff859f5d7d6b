"""CPU time of methods, by the number of places they choose from."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from cns_drake.base.jobs.step import Reporter
from cns_drake.studies.tasks.task import Jobs, Pair, Task
from evaluation.recognition.costs import cpu_ms, query_ms
from evaluation.recognition.place_outcome import Number
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.measurements import TIMED, crowded
from evaluation.study.parts import Part

_COST = 30.0


class CostTask(Task):
    """What a query costs, and a database made of descriptions."""

    name = "cost"
    asks = True

    def measure(self, pair: Pair, jobs: Jobs) -> Part:
        needs: list[str] = []
        database, query = (
            jobs.described(drive, role, pair.protocol, needs, kept=True)
            for drive, role in pair.roles
        )
        assert isinstance(database, tuple)
        assert isinstance(query, tuple)
        arguments = (
            *(database[1:], query[1:], jobs.elsewhere(pair, needs)),
            *(pair.distractors, jobs.methods),
        )
        part = jobs.files.part("cost", pair.name)
        return jobs.add(part, measure_costs, arguments, needs, _COST)

    def numbers(self, found: Any, before: Any | None) -> Iterator[Number]:
        for method, (places, values) in found.items():
            for name, value in values.items():
                yield Number(method, False, name, value, n=places)


def measure_costs(
    reporter: Reporter,
    database: tuple[Part, ...],
    query: tuple[Part, ...],
    distractors: tuple[tuple[Part, ...], ...],
    num_distractors: int,
    methods: tuple[MethodChoice, ...],
) -> dict[str, tuple[int, dict[str, float]]]:
    """Returns key of a method -> number of places, and times [ms].

    `query_ms` is the median CPU time of some queries, `build_ms` that of a
    database from descriptions.

    Args:
        reporter: reports progress.
        database, query: described drives, one part for each method.
        distractors: described drives through other cities.
        num_distractors: number of their places.
        methods: methods to measure.
    """
    found = {}
    for k, choice in enumerate(reporter.track(methods, "", len(methods))):
        method = choice.make()
        mapped = database[k].read()[1]
        places = crowded(mapped, distractors, k, num_distractors)[0].places
        asked = query[k].read()[1].queries
        found[choice.key] = (
            len(places.frames),
            {
                "build_ms": cpu_ms(method.build_database, places.descriptors),
                "query_ms": query_ms(
                    method, places, asked, TIMED + 1, with_pose=False
                ),
            },
        )
    return found
