"""The maps of an experiment, with the drives that are compared on each map."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cns_drake.scenarios import OffsetConfig, Scenario, load_scenario, make_maps
from cns_drake.studies.maps.frozen_redraws import redraw_frozen
from cns_drake.studies.maps.made_maps import made_map_step
from evaluation.base import InputError, errors_at, natural_key
from evaluation.results import FROZEN_REDRAW
from evaluation.study import ExperimentRun, MadeMap
from worlds.maps import MapFolder, recordable_map, recordable_maps, shipped_maps

if TYPE_CHECKING:
    from evaluation.study import MapDrives


@dataclass(frozen=True)
class MapPairs:
    """The pairs of drives of one map, before a condition changes them.

    Attributes:
        map_name: name of the map.
        factors: values of factors that only this map has.
        pairs: the pairs of drives: database and query. Empty for recordings.
        city: the recordings of the map; None if its drives are simulated.
    """

    map_name: str
    factors: Mapping[str, Any]
    pairs: Sequence[tuple[Scenario, Scenario]] = ()
    city: MapDrives | None = None


def pairs_by_map(
    run: ExperimentRun,
    maps: Sequence[str],
    recorded: Callable[[Path], Iterable[MapDrives]] | None = None,
) -> Iterator[MapPairs]:
    """Yields the pairs of all maps; makes aged and imported maps.

    Args:
        run: the experiment, and where it runs.
        maps: names or folders of maps that replace the experiment's maps.
        recorded: reads the maps of a folder of recordings; None if only drives
            that can be simulated are of use.

    Raises:
        InputError: a map cannot be used, or two maps or drives have the same
            name.
    """
    made = {
        one.name: one
        for one in run.experiment.maps or ()
        if isinstance(one, MadeMap)
    }
    wanted: Sequence[str | MadeMap] = [made.get(one, one) for one in maps]
    if not maps:
        wanted = run.experiment.maps or recordable_maps()
    place = "" if maps else f"{run.source}: maps"
    known: set[str] = set()
    for one in wanted:
        # A wrong name is found before any map is made.
        if run.experiment.frozen_redraws and (
            isinstance(one, MadeMap) or one not in shipped_maps()
        ):
            raise InputError(
                f"{run.source}: {FROZEN_REDRAW}:"
                f" {getattr(one, 'name', one)}: no shipped map"
            )
        if isinstance(one, str) and not Path(one).is_dir():
            with errors_at(place) if place else nullcontext():
                recordable_map(one)
    for one in wanted:
        for some in _pairs_of(run, one, place, recorded):
            names = {one.name for pair in some.pairs for one in pair}
            if some.city is not None:
                names = {one.name for one in some.city.recordings}
            if not some.factors:
                names.add(some.map_name)
            for name in sorted(names & known):
                raise InputError(
                    f"{getattr(one, 'name', one)}: another map, or a drive"
                    f" of one, has the name {name}, too"
                )
            known |= names
            yield some


def _pairs_of(
    run: ExperimentRun,
    one: str | MadeMap,
    place: str,
    recorded: Callable[[Path], Iterable[MapDrives]] | None,
) -> Iterator[MapPairs]:
    """Yields the pairs of a map; `place` is the field for errors, or ""."""
    kind = run.experiment.drives
    if isinstance(one, MadeMap):
        folder = run.output / "cities" / one.name
        with errors_at(f"{run.source}: maps"):
            step = made_map_step(one, run.experiment, folder, shipped_maps())
        make_maps([step], folder.parent, run.cluster)
        yield MapPairs(one.name, {}, _drive_pairs(folder, kind))
        return
    path = shipped_maps().get(one, Path(one))
    versions = run.experiment.frozen_redraws
    if versions:
        cities = redraw_frozen(
            [one],
            versions,
            run.output / "cities",
            run.cluster,
            run.source,
        )
        for number, folder in zip(sorted(versions), cities, strict=True):
            yield MapPairs(
                one, {FROZEN_REDRAW: number}, _drive_pairs(folder, kind)
            )
        return
    if path.is_dir() and not MapFolder(path).drives():
        with errors_at(place) if place else nullcontext():
            if recorded is None:
                raise InputError(f"{path}: no drive that can be simulated")
            found = recorded(path)
        for city in found:
            yield MapPairs(city.name, {}, city=city)
        return
    yield MapPairs(path.name, {}, _drive_pairs(recordable_map(one), kind))


# The LiDARs of the database pass this far from the query's, because no two
# drives stop at exactly the same places [m].
_BESIDE = OffsetConfig(ahead=1.25, left=0.5)


def database_drive(query: Scenario) -> Scenario:
    """Returns the drive of a database along the route of a query drive."""
    return query.replaced(name=f"{query.name}_database", offset=_BESIDE)


def _drive_pairs(folder: Path, kind: str) -> list[tuple[Scenario, Scenario]]:
    """Returns the pairs of drives of a map: database and query.

    Args:
        folder: folder of the map.
        kind: which drives are compared, see `Experiment.drives`.
    """
    map_folder = MapFolder(folder)
    files = map_folder.recordable_drives()
    if kind == "first-and-last":
        stages = list(map_folder.stages())
        # In an imported city with several stages, the other drive of the
        # last stage follows the same route as the first drive.
        last = (map_folder.other_drives() or files)[-1]
        return [
            (
                load_scenario(files[0]).replaced(stage=stages[0]),
                load_scenario(last).replaced(stage=stages[-1]),
            )
        ]
    drives = [load_scenario(path) for path in files]
    if kind == "same-route":
        query = drives[-1]
        return [(database_drive(query), query)]
    query = max(drives, key=lambda drive: natural_key(drive.stage or ""))
    pairs = [(one, query) for one in drives if one is not query]
    if kind == "both-ways" and len(drives) == 2:
        pairs += [(query, one) for one, _ in pairs]
    return pairs
