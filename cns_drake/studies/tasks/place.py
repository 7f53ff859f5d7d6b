"""Place recognition, and the poses that come with it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from cns_drake.studies.tasks.task import Answers, Jobs, Number, Pair, Task
from evaluation.recognition.place_outcome import PlaceOutcome, place_numbers
from evaluation.recognition.pose_errors import pose_numbers, pose_success
from evaluation.recognition.survival import kept_share
from evaluation.study.parts import Part
from evaluation.study.place_outcomes import measure_places

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
            for name, value, interval in place_numbers(now, _same(before, now)):
                number = len(now.outcomes)
                yield Number(
                    now.method, now.is_gated, name, value, interval, number
                )

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
            values = pose_numbers(now.pose_errors, now.outcomes)
            with_match = int(now.outcomes.has_match.sum())
            then = _same(before, now)
            if values and then is not None:
                was = pose_success(then.pose_errors, then.outcomes)
                share = kept_share(values["pose_success"], was)
                values["kept"] = float(share)
            for name, one in values.items():
                yield Number(now.method, now.is_gated, name, one, n=with_match)

    def answers(self, found: Outcomes) -> Iterator[Answers]:
        # Those of `place` have the errors of poses.
        yield from ()


def _same(before: Outcomes | None, now: PlaceOutcome) -> PlaceOutcome | None:
    """Returns the outcome of the same method and gate."""
    for one in before or ():
        if (one.method, one.is_gated) == (now.method, now.is_gated):
            return one
    return None
