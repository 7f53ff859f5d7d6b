"""Place recognition, and the poses that come with it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from cns_drake.studies.tasks.task import Answers, Jobs, Pair, Task
from evaluation.recognition.place_outcome import (
    Number,
    PlaceOutcome,
    place_numbers,
    pose_numbers,
)
from evaluation.study.measurements import measure_places
from evaluation.study.parts import Part

# Expected seconds to describe a pair and to compare it by all methods.
_COST = 60.0

Outcomes = Sequence[PlaceOutcome]


class PlaceTask(Task):
    """Which place of the database a query shows."""

    name = "place"
    asks = True

    def measure(self, pair: Pair, jobs: Jobs) -> Part:
        needs: list[str] = []
        arguments = (
            jobs.described(pair.database, "places", pair.protocol, needs),
            jobs.described(pair.query, "queries", pair.protocol, needs),
            jobs.elsewhere(pair, needs),
            pair.distractors,
            jobs.methods,
            pair.protocol,
        )
        part = jobs.files.part("place", pair.name)
        return jobs.add(part, measure_places, arguments, needs, _COST)

    def numbers(
        self, found: Outcomes, before: Outcomes | None
    ) -> Iterator[Number]:
        for now in found:
            yield from place_numbers(now, _same(before, now))

    def answers(self, found: Outcomes) -> Iterator[Answers]:
        for now in found:
            yield Answers(now.method, now.is_gated, now.columns())


class PoseTask(PlaceTask):
    """Where a query lies, by the method's own pose beside its best place."""

    name = "pose"

    def numbers(
        self, found: Outcomes, before: Outcomes | None
    ) -> Iterator[Number]:
        for now in found:
            yield from pose_numbers(now, _same(before, now))

    def answers(self, found: Outcomes) -> Iterator[Answers]:
        # Those of `place` have the errors of poses.
        yield from ()


def _same(before: Outcomes | None, now: PlaceOutcome) -> PlaceOutcome | None:
    """Returns the outcome of the same method and gate."""
    for one in before or ():
        if (one.method, one.is_gated) == (now.method, now.is_gated):
            return one
    return None
