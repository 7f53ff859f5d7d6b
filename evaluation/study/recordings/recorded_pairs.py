"""Pairs of recordings, which a study compares as they were recorded."""

from collections.abc import (
    Callable,
    Collection,
    Iterable,
    Iterator,
    Mapping,
    Sequence,
)
from typing import Any, NamedTuple

from cns_drake.base import (
    InputError,
    did_you_mean,
    fingerprint,
    natural_key,
    repeated,
)
from evaluation.recognition import KEEP_ALL, RetrievalProtocol
from evaluation.results import OWN
from evaluation.study.recordings.map_drives import MapDrives, RecordingInfo
from evaluation.study.tasks.pair import Pair

# Clocks of recordings that begin at 0 say nothing about their order: the first
# stamps of others are years after 1970 [ns].
_DATED_NS = 10**17


class RecordedCondition(NamedTuple):
    """A condition that recordings allow.

    Attributes:
        factors: name -> value of each factor of the condition.
        stage: `own` if each recording is of its own stage; `last` for the
            control, in which both recordings are of the stage of the query.
        baseline: the factors of the condition with which this one is compared.
        protocol: protocol of place recognition.
        database: the recordings of the database, if there are several.
        keep: which places of these recordings are kept, see
            `evaluation.recognition.place_selection.kept_places`.
        methods: names of the methods that are measured; None for all methods
            of the study.
    """

    factors: Mapping[str, Any]
    stage: str
    baseline: Mapping[str, Any]
    protocol: RetrievalProtocol
    database: tuple[RecordingInfo, ...] = ()
    keep: str | int = KEEP_ALL
    methods: Collection[str] | None = None


def recorded_pairs(
    city: MapDrives,
    conditions: Iterable[RecordedCondition],
    seed: int,
    on_note: Callable[[str], None],
    *,
    both_ways: bool = False,
    with_itself: bool = False,
) -> Iterator[Pair]:
    """Yields the pairs of a map's recordings in all conditions.

    Args:
        city: the recordings.
        conditions: the conditions.
        seed: seed of the experiment.
        on_note: is called with a note on each pair without a control.
        both_ways: whether the two recordings of a pair are compared both ways.
        with_itself: whether each recording is compared with itself, too.
    """
    conditions = list(conditions)
    pairs = city.recognition_pairs() if both_ways else city.change_pairs()
    if with_itself:
        pairs += [(one, one) for one in city.stages.values()]
    composed = [one for one in conditions if one.database]
    if composed:
        conditions = [one for one in conditions if not one.database]
        yield from _composed_pairs(city, composed, seed)
    for pair in pairs if conditions else ():
        control = city.unchanged_pair(*pair)
        is_wanted = any(one.stage != OWN for one in conditions)
        if control is None and is_wanted and pair[0] is not pair[1]:
            on_note(
                f"{city.name}: no drive on the route of {pair[0].name} in"
                f" the stage of {pair[1].name}"
            )
        for condition in conditions:
            recordings = pair if condition.stage == OWN else control
            if recordings is None:
                continue
            database, query = (one.named for one in recordings)
            # Queries are scored once for all radii.
            asked = condition.protocol.to_json() | {"radius": None}
            yield Pair(
                map_name=city.name,
                names=(pair[0].name, pair[1].name),
                factors=condition.factors,
                seed=seed,
                baseline=condition.baseline,
                stated=condition.protocol,
                key=f"{database.name} {query.name} {fingerprint(asked)[:8]}",
                database=database,
                query=query,
                protocol=condition.protocol,
                methods=condition.methods,
            )


def chosen_recordings(
    city: MapDrives, names: Sequence[str], where: str
) -> tuple[RecordingInfo, ...]:
    """Returns the recordings of a database, from older to newer.

    Args:
        city: all recordings of the map; the query is the recording of the last
            stage.
        names: names of the recordings.
        where: file and field of the names, for errors.

    Raises:
        InputError: a recording is unknown, is named twice, is the query, or
            is later than the query.
    """
    known = {one.name: one for one in city.recordings}
    for name in repeated(names):
        raise InputError(f"{where}: {name}: the same drive twice")
    query = city.last
    placed = query.source()
    for name in names:
        if name not in known:
            raise InputError(
                f"{where}: {city.name} has no recording {name!r} (there are:"
                f" {', '.join(sorted(known))}){did_you_mean(name, known)}"
            )
        if name == query.name:
            raise InputError(f"{where}: {name}: this drive is the query")
        recording = known[name].source()
        start_ns, query_start_ns = recording.stamps_ns[0], placed.stamps_ns[0]
        is_dated = start_ns > _DATED_NS and query_start_ns > _DATED_NS
        if is_dated and start_ns > query_start_ns:
            raise InputError(
                f"{where}: {name}: this drive is later than the query"
                f" {query.name}"
            )
    return tuple(
        sorted(
            (known[name] for name in names),
            key=lambda one: natural_key(one.stage),
        )
    )


def _composed_pairs(
    city: MapDrives, conditions: Iterable[RecordedCondition], seed: int
) -> Iterator[Pair]:
    """Yields the pairs of databases of several recordings and the query."""
    query = city.last
    for one in conditions:
        named = [recording.named for recording in one.database]
        digest = fingerprint(
            {
                **one.protocol.to_json(),
                "radius": None,
                "drives": [recording.name for recording in named],
                "keep": one.keep,
            }
        )[:8]
        yield Pair(
            map_name=city.name,
            names=(city.name, query.name),
            factors=one.factors,
            seed=seed,
            baseline=one.baseline,
            stated=one.protocol,
            key=f"{named[0].name} {query.name} {digest}",
            database=named[0],
            query=query.named,
            protocol=one.protocol,
            beside=tuple(named[1:]),
            keep=one.keep,
        )
