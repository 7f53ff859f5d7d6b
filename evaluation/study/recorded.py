"""Pairs of recordings, which a study compares as they are."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, NamedTuple

from cns_drake.base.jobs.fingerprint import fingerprint
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.results.table import OWN
from evaluation.study.collection import City
from evaluation.study.engine import MeasuredPair
from evaluation.study.tasks.task import NamedDrive, Pair


class RecordedCondition(NamedTuple):
    """A condition that recordings allow.

    Attributes:
        factors: name -> value of each factor of the condition.
        stage: `own`: each drive through its own stage; `last`: the control, in
            which both drives lead through the stage of the query.
        is_baseline: whether other conditions are compared with this one.
        protocol: protocol of place recognition.
    """

    factors: Mapping[str, Any]
    stage: str
    is_baseline: bool
    protocol: RetrievalProtocol


def recorded_comparisons(
    city: City,
    conditions: Iterable[RecordedCondition],
    seed: int,
    on_note: Callable[[str], None],
    *,
    both_ways: bool = False,
) -> Iterator[MeasuredPair]:
    """Yields the comparisons of a map's recordings in all conditions.

    Args:
        city: the recordings.
        conditions: the conditions.
        seed: seed of the experiment.
        on_note: is called with a note on each pair without a control.
        both_ways: whether the two drives of a map are compared both ways.
    """
    conditions = list(conditions)
    pairs = city.recognition_pairs() if both_ways else city.change_pairs()
    for pair in pairs:
        control = city.unchanged_pair(*pair)
        for condition in conditions:
            drives = pair if condition.stage == OWN else control
            if drives is None:
                on_note(
                    f"{city.name}: no drive on the route of {pair[0].name} in"
                    f" the stage of {pair[1].name}"
                )
                continue
            database, query = (
                NamedDrive(one.name, one.source) for one in drives
            )
            # Queries are scored once for all radii.
            asked = condition.protocol.to_json() | {"radius": None}
            yield MeasuredPair(
                city.name,
                (pair[0].name, pair[1].name),
                condition.factors,
                seed,
                condition.is_baseline,
                Pair(
                    f"{database.name} {query.name} {fingerprint(asked)[:8]}",
                    database,
                    query,
                    database,
                    condition.protocol,
                ),
                condition.protocol,
            )
