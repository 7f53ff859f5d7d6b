"""The task `seen`: which changes of a city the drives of a database see."""

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass
import math
from typing import Any, ClassVar, NamedTuple

import numpy as np

from cns_drake.simulation import SimulatedDrive, SimulationSource
from cns_drake.studies.pairs.map_upkeep import plain_source
from evaluation.base import (
    Key,
    Reporter,
    Store,
    doing,
    exclusive,
    is_there,
    read_records,
    track,
    whole_number,
)
from evaluation.drives import sample_frames
from evaluation.study import DataOf, Pair, Task, check_positive
from worlds.ageing import HISTORY_NAME, PUT_UP, TAKEN_DOWN

# Events in which a structure appears under its own name; in all others, the
# successor appears.
_APPEARS = ("built", PUT_UP)
# Events in which a structure disappears.
_DISAPPEARS = (
    "demolished",
    "felled",
    "furniture",
    "removed",
    "replaced",
    TAKEN_DOWN,
)


@dataclass(frozen=True)
class Sighting:
    """The structures from which a drive gets returns, by name.

    Attributes:
        present: structures that stand in the drive's own world.
        returned: structures from which the drive gets returns.
        before: structures from which the drive would get returns in the city of
            the database's first drive.
    """

    present: list[str]
    returned: list[str]
    before: list[str]


@dataclass(frozen=True)
class Noticed:
    """Structures that changed; whether and when drives notice each change.

    Attributes:
        names: the S structures that changed, in order.
        is_noticed: (S,) bool, whether a drive notices the change.
        delay: (S,) years from the change to the first drive that notices it;
            NaN for a change that no drive notices, or whose year is unknown.
    """

    names: list[str]
    is_noticed: np.ndarray
    delay: np.ndarray

    def chosen(self, rows: np.ndarray) -> "Noticed":
        """Returns some of the structures, by a mask (S,) bool."""
        names = [self.names[k] for k in np.flatnonzero(rows)]
        return Noticed(names, self.is_noticed[rows], self.delay[rows])

    @property
    def changed(self) -> int:
        """Number of the structures that changed."""
        return len(self.names)

    @property
    def seen(self) -> float:
        """Share of the changes that a drive notices; NaN without a change."""
        return float(self.is_noticed.mean()) if self.names else math.nan

    @property
    def num_delays(self) -> int:
        """Number of the changes whose delay is known."""
        return int((~np.isnan(self.delay)).sum())

    @property
    def delay_median(self) -> float:
        """Median of the known delays [years]; NaN without one."""
        return self._delay(50.0)

    @property
    def delay_95(self) -> float:
        """95 % quantile of the known delays [years]; NaN without one."""
        return self._delay(95.0)

    def _delay(self, percentage: float) -> float:
        if not self.num_delays:
            return math.nan
        return float(np.nanpercentile(self.delay, percentage))


class Sightings(NamedTuple):
    """Which changes are noticed, from which the metrics of `seen` follow.

    Attributes:
        all: all changes.
        by_query: the changes that the query drive notices, too.
    """

    all: Noticed
    by_query: Noticed


def noticed_changes(
    drives: Sequence[tuple[int, Sighting]],
    query: Sighting,
    came: Mapping[str, int],
    went: Mapping[str, int],
) -> Noticed:
    """Returns which changes between the first drive and the query are noticed.

    If a structure appeared, the change is noticed by the first drive that gets
    returns from the structure. If a structure disappeared, the change is
    noticed by the first later drive that would have got returns from the
    structure in the city of the first drive.

    Args:
        drives: year and sighting of each drive, from older to newer.
        query: sighting of the query.
        came: structure -> year in which it appeared.
        went: structure -> year in which it disappeared.
    """
    first = set(drives[0][1].present)
    last = set(query.present)
    names = sorted(first ^ last)
    delay = np.full(len(names), math.nan)
    is_noticed = np.zeros(len(names), bool)
    sets = [
        (year, set(o.present), set(o.returned), set(o.before))
        for year, o in drives
    ]
    for k, name in enumerate(names):
        if name in last:
            years = [year for year, _, seen, _ in sets if name in seen]
            changed = came.get(name, math.nan)
        else:
            years = [
                year
                for year, present, _, seen in sets
                if name in seen and name not in present
            ]
            changed = went.get(name, math.nan)
        if years:
            is_noticed[k] = True
            delay[k] = min(years) - changed
    return Noticed(names, is_noticed, delay)


class SeenTask(Task):
    """Measures which changes of a city the drives of a database notice.

    The changes are the structures that came or went between the oldest drive of
    the database and the query. Metrics whose names end in `_here` count only
    structures whose change the query drive notices, too.
    """

    name = "seen"
    defaults: ClassVar[Mapping[str, Any]] = {"spacing": 5.0}

    def check(self, name: str, value: Any, where: str) -> None:
        check_positive(value, where)

    def keys(self, pair: Pair) -> list[Key]:
        """Returns the keys of all sightings, and of the city's events."""
        if pair.query.years is None:
            return []
        first, *_ = drives = (*pair.database, pair.query)
        found = [
            Key(
                self.name,
                {
                    "drive": plain_source(one.source).identity(),
                    "first": plain_source(first.source).identity(),
                    "spacing": float(self.settings["spacing"]),
                },
                self.version,
            )
            for one in drives
        ]
        made_of = {"city": plain_source(pair.query.source).identity()}
        return [*found, Key("events", made_of, self.version)]

    def measure(
        self,
        pairs: Sequence[Pair],
        data_of: DataOf,
        store: Store,
        reporter: Reporter,
    ) -> None:
        pair = pairs[0]
        *sightings, events = self.keys(pair)
        first, *_ = sources = [
            plain_source(one.source) for one in (*pair.database, pair.query)
        ]
        for source, key in zip(sources, sightings, strict=True):
            # Several pairs have the drive.
            with exclusive(store.part(key).path, lambda: doing("waiting")):
                if not store.has(key):
                    spacing = float(self.settings["spacing"])
                    found = sight_structures(source, first, spacing)
                    store.write(key, found)
        store.write(events, changes_until(sources[-1]))

    def found(self, pair: Pair, store: Store) -> Sightings:
        *sightings, years = map(store.read, self.keys(pair))
        dated = [
            (one.years or 0, sighting)
            for one, sighting in zip(pair.database, sightings[:-1], strict=True)
        ]
        query = sightings[-1]
        every, by_query = (
            noticed_changes(some, query, *years)
            for some in (dated, [dated[0], (pair.query.years or 0, query)])
        )
        return Sightings(every, every.chosen(by_query.is_noticed))


def sight_structures(
    source: SimulationSource,
    first: SimulationSource,
    spacing: float,
) -> Sighting:
    """Returns the structures from which a drive gets returns.

    Args:
        source: the drive.
        first: the oldest drive of the database. The city of this drive is the
            city before all changes.
        spacing: distance driven between two scans that count [m].
    """
    drive = source()
    back = SimulationSource(source.scenario.in_city_of(first.scenario))
    returned = _seen_names(drive, spacing)
    before = returned
    if back.scenario != source.scenario:
        before = _seen_names(back(), spacing)
    return Sighting(sorted(drive.structures), sorted(returned), sorted(before))


def _seen_names(drive: SimulatedDrive, spacing: float) -> Set[str]:
    """Returns the names of the structures from which a drive gets returns."""
    frames = sample_frames(drive.X_WS[:, :3, 3], spacing).tolist()
    numbers: set[int] = set()
    for frame in track(
        frames, f"looking from {drive.name}", len(frames), "scans"
    ):
        numbers |= set(np.unique(drive.scan(frame)["instance"]).tolist())
    known = drive.instances
    names = {str(known[k]["name"]) for k in numbers if k in known}
    return names & set(drive.structures)


def changes_until(
    query: SimulationSource,
) -> tuple[dict[str, int], dict[str, int]]:
    """Returns when structures of an aged city appeared and disappeared.

    Args:
        query: the query, in the aged city.

    Returns:
        Structure -> the first year in which the structure appears; structure ->
        the first year in which the structure disappears. Both mappings are
        empty without a history.

    Raises:
        InputError: the history cannot be read.
    """
    came: dict[str, int] = {}
    went: dict[str, int] = {}
    path = query.scenario.folder.path / HISTORY_NAME
    if not is_there(path):
        return came, went
    columns = ("year", "event", "structure", "successor")
    for line, row in read_records(path, columns):
        year = whole_number(row["year"], f"{path}: line {line}: year")
        if row["successor"]:
            came.setdefault(row["successor"], year)
        elif row["event"] in _APPEARS:
            came.setdefault(row["structure"], year)
        if row["event"] in _DISAPPEARS:
            went.setdefault(row["structure"], year)
    return came, went
