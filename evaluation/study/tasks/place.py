"""The tasks `place`, `pose` and `cost`, on place recognition."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from evaluation.base import Key, Reporter, Store
from evaluation.recognition import (
    Asked,
    Descriptors,
    MethodChoice,
    Number,
    PlaceComparison,
    PlaceOutcome,
    SearchCost,
    asked_of_places,
    asked_of_queries,
    measure_places,
    numbers_of,
)
from evaluation.study.pair import Pair, StudyDrive
from evaluation.study.tasks.task import Answered, DataOf, Task

# Counts the changes of how answers are found and judged.
ANSWERS_VERSION = 1


class _RecognitionTask(Task):
    """A task on the answers of methods, which are found once for all tasks."""

    is_of_queries = True

    def asks(
        self, pair: Pair, store: Store
    ) -> Iterator[tuple[StudyDrive, Asked]]:
        methods, protocol = self._left([pair], store), pair.protocol
        if not methods:
            return
        for drive in pair.database:
            for one in asked_of_places(methods, protocol):
                yield drive, one
        for one in asked_of_queries(methods, protocol):
            yield pair.query, one
        for drive in pair.distractors:
            for choice in methods:
                yield drive, Descriptors(choice, "places", protocol)

    def measure(
        self,
        pairs: Sequence[Pair],
        data_of: DataOf,
        store: Store,
        reporter: Reporter,
    ) -> None:
        left = self._left(pairs, store)
        pair = pairs[0]
        compared = PlaceComparison(
            tuple(map(data_of, pair.database)),
            data_of(pair.query),
            tuple(left),
            pair.protocol,
            tuple(sorted({one.protocol.radius for one in pairs})),
            pair.keep,
            tuple(map(data_of, pair.distractors)),
            pair.num_distractors,
        )
        measured = measure_places(reporter, compared)
        for choice, (found, cost) in zip(left, measured, strict=True):
            store.write(search_key(pair, choice), cost)
            for one in pairs:
                radius = one.protocol.radius
                answers = [a for a in found if a.protocol.radius == radius]
                store.write(answers_key(one, choice), answers)

    def _left(self, pairs: Sequence[Pair], store: Store) -> list[MethodChoice]:
        """Returns the methods whose answers are not in the store."""
        return [
            one
            for one in self._methods(pairs[0])
            if not all(
                store.has(key)
                for pair in pairs
                for key in (answers_key(pair, one), search_key(pair, one))
            )
        ]

    def _methods(self, pair: Pair) -> list[MethodChoice]:
        return [one for one in self.methods if pair.has_method(one.name)]


def answers_key(pair: Pair, method: MethodChoice) -> Key:
    """Returns the key of a method's `PlaceOutcome`s of a pair."""
    made_of = {**pair.asked(), "method": method.identity()}
    return Key("place", made_of, ANSWERS_VERSION)


def search_key(pair: Pair, method: MethodChoice) -> Key:
    """Returns the key of the `SearchCost` of a method."""
    asked = pair.asked(with_radius=False)
    made_of = {**asked, "method": method.identity()}
    return Key("search", made_of, ANSWERS_VERSION)


class PoseTask(_RecognitionTask):
    """Measures the errors of pose estimates.

    A method estimates the pose of each query relative to its top-ranked place.
    """

    name = "pose"

    def keys(self, pair: Pair) -> list[Key]:
        return [answers_key(pair, one) for one in self._methods(pair)]

    def found(self, pair: Pair, store: Store) -> list[PlaceOutcome]:
        return [one for key in self.keys(pair) for one in store.read(key)]

    def numbers(
        self,
        found: Sequence[PlaceOutcome],
        before: Sequence[PlaceOutcome] | None,
        compared: Mapping[str, str],
    ) -> Iterator[Number]:
        for now in found:
            method = compared.get(now.method, now.method)
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


class PlaceTask(PoseTask):
    """Measures how well methods find a query's place in the database."""

    name = "place"

    def answers(self, found: Sequence[PlaceOutcome]) -> Iterator[Answered]:
        for now in found:
            yield now.method, now.protocol.verified, now.outcomes.columns


class CostTask(_RecognitionTask):
    """Tells what a search costs: its memory, and the time of a query."""

    name = "cost"

    def keys(self, pair: Pair) -> list[Key]:
        return [search_key(pair, one) for one in self._methods(pair)]

    def found(self, pair: Pair, store: Store) -> list[SearchCost]:
        return [store.read(key) for key in self.keys(pair)]

    def numbers(
        self, found: Sequence[SearchCost], before: Any, compared: Any
    ) -> Iterator[Number]:
        for cost in found:
            yield from numbers_of(self.name, cost, method=cost.method)
