"""Pairs of recordings, which a study compares as they were recorded."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from evaluation.base import InputError, natural_key, no_such, repeated
from evaluation.recognition import KEEP_ALL, RetrievalProtocol, checked_keep
from evaluation.results import CAUSE, LAST, OWN, STAGE
from evaluation.study.experiments.experiment import Condition
from evaluation.study.experiments.factors import SESSIONS, SIDES
from evaluation.study.pair import Pair
from evaluation.study.recordings.map_drives import MapDrives, RecordingInfo

# Clocks of recordings that begin at 0 say nothing about their order: the first
# stamps of others are years after 1970 [ns].
_DATED_NS = 10**17
# Fields of a database of several recordings.
_OF_RECORDINGS = (f"database.{SESSIONS}", "database.keep")


def recorded_pairs(
    city: MapDrives,
    conditions: Iterable[tuple[Condition, RetrievalProtocol]],
    seed: int,
    source: str,
    on_note: Callable[[str], None],
    *,
    both_ways: bool = False,
    with_itself: bool = False,
) -> Iterator[Pair]:
    """Yields the pairs of a map's recordings in all conditions.

    In the stage `own`, each recording is of its own stage; in the stage `last`,
    the control, both are of the stage of the query.

    Args:
        city: the recordings.
        conditions: the conditions, with their protocols.
        seed: seed of the experiment.
        source: file of the experiment, for errors.
        on_note: is called with a note on each pair without a control.
        both_ways: whether the two recordings of a pair are compared both ways.
        with_itself: whether each recording is compared with itself, too.

    Raises:
        InputError: a condition varies what recordings do not allow, or names a
            recording that is missing.
    """
    conditions = list(conditions)
    for one, _ in conditions:
        _check_recordable(city, one, source)
    pairs = city.recognition_pairs() if both_ways else city.change_pairs()
    if with_itself:
        pairs += [(one, one) for one in city.stages.values()]
    plain = []
    for one, protocol in conditions:
        if SESSIONS in one.changes.get("database", {}):
            yield _composed_pair(city, one, protocol, seed, source)
        else:
            plain.append((one, protocol, _stage(one)))
    for pair in pairs if plain else ():
        control = city.unchanged_pair(*pair)
        is_wanted = any(stage != OWN for *_, stage in plain)
        if control is None and is_wanted and pair[0] is not pair[1]:
            on_note(
                f"{city.name}: no drive on the route of {pair[0].name} in"
                f" the stage of {pair[1].name}"
            )
        for condition, protocol, stage in plain:
            recordings = pair if stage == OWN else control
            if recordings is None:
                continue
            database, query = (one.drive for one in recordings)
            yield Pair(
                map_name=city.name,
                names=(pair[0].name, pair[1].name),
                factors=condition.factors,
                seed=seed,
                baseline=condition.baseline,
                stated=protocol,
                database=(database,),
                query=query,
                protocol=protocol,
                world=city.world,
            )


def _stage(condition: Condition) -> Any:
    return condition.changes.get("both", {}).get("stage", OWN)


def _check_recordable(
    city: MapDrives, condition: Condition, source: str
) -> None:
    """Checks that a condition varies only the stage, as recordings require."""
    sides = {n: condition.changes.get(n, {}) for n in SIDES}
    given = [f"{side}.{name}" for side in sides for name in sides[side]]
    if SESSIONS in sides["database"]:
        given = [one for one in given if one not in _OF_RECORDINGS]
        if sides["both"]:
            raise InputError(
                f"{source}: {STAGE}: databases of several"
                " recordings have no control"
            )
    elif "keep" in sides["database"]:
        raise InputError(
            f"{source}: database.keep: of recordings, it selects places of"
            f" database.{SESSIONS}; name them, too"
        )
    given += [CAUSE] if condition.causes else []
    for name in given:
        if name != STAGE:
            name = next(
                (n for n in condition.factors if n.startswith(name)),
                name,
            )
            raise InputError(
                f"{source}: {name}: the recordings of {city.name}"
                " are as they are; simulated drives alone can vary it"
            )
    stage = _stage(condition)
    if stage not in (OWN, LAST):
        raise InputError(
            f"{source}: {STAGE}: {stage!r}: recordings have {OWN} and {LAST}"
        )


def _chosen_recordings(
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
            fault = no_such("recording", name, sorted(known))
            raise InputError(f"{where}: {city.name}: {fault}")
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


def _composed_pair(
    city: MapDrives,
    condition: Condition,
    protocol: RetrievalProtocol,
    seed: int,
    source: str,
) -> Pair:
    """Returns the pair of a database of several recordings and the query."""
    fields, query = condition.changes["database"], city.last
    names, where = fields[SESSIONS], f"{source}: database.{SESSIONS}"
    is_list = isinstance(names, list) and bool(names)
    if not (is_list and all(isinstance(one, str) for one in names)):
        raise InputError(f"{where}: not a list of names of recordings")
    database = _chosen_recordings(city, names, where)
    keep = checked_keep(
        fields.get("keep", KEEP_ALL), f"{source}: database.keep"
    )
    return Pair(
        map_name=city.name,
        names=(city.name, query.name),
        factors=condition.factors,
        seed=seed,
        baseline=condition.baseline,
        stated=protocol,
        database=tuple(one.drive for one in database),
        query=query.drive,
        protocol=protocol,
        keep=keep,
        world=city.world,
    )
