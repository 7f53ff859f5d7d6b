"""The task `localise`: scans are localised in a map of the database."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
import tempfile
from typing import Any, ClassVar

import numpy as np

from evaluation.base import (
    Cluster,
    InputError,
    Job,
    MakePart,
    Part,
    Reporter,
    read_bytes,
    run_jobs,
)
from evaluation.drives import NOT_FINITE, CountedDrive, Drive, JoinedSource
from evaluation.localisation import (
    KISS_MATCHER,
    METHODS,
    QUERY,
    LocalisationMap,
    Localiser,
    Settings,
    Starts,
    default_settings,
    localisation_columns,
    localise,
    localised,
    make_estimator,
    make_map,
    map_of,
    mapped_frames,
    note_sparse,
    query_frames,
    read_queries,
    track_drive,
)
from evaluation.recognition import KEEP_ALL, Number, numbers_of
from evaluation.study.tasks.jobs import OPENING_COST, Jobs
from evaluation.study.tasks.pair import Pair, Result
from evaluation.study.tasks.task import Answered, Task, check_positive

# The methods that need no optional package.
SHIPPED = tuple(name for name in METHODS if name != KISS_MATCHER)
# Expected time to localise the queries of a usual drive [s].
_QUERIES_COST = 5.0
# Expected time to add a usual drive to the map [s].
_MAP_COST = 15.0
# The end of a note on a drive without a query near the map.
NOT_LOCALISED = ": not localised"


class LocaliseTask(Task):
    """Measures how well scans are aligned to a map from wrong initial poses.

    With the setting `odometry_drift`, whole drives are tracked; without this
    setting, single scans are aligned. The setting `estimator` contains settings
    of all registration methods.
    """

    name = "localise"
    defaults: ClassVar[Mapping[str, Any]] = {
        "methods": list(SHIPPED),
        "starts": [[2.0, 10.0]],
        "spacing": None,
        "seed": 0,
        "odometry_drift": None,
        "estimator": {},
    }

    def check(self, name: str, value: Any, where: str) -> None:
        if name in ("seed", "odometry_drift", "estimator"):
            _check(name, value, where)
        elif name == "spacing":
            check_positive(value, where)
        elif name == "methods":
            for one in value:
                known = str(one) in METHODS
                if not known and not Path(str(one)).is_file():
                    raise InputError(
                        f"{where}: {one!r} is neither"
                        f" {', '.join(METHODS)} nor a file"
                    )
        else:
            try:
                radii = [one.radius for one in self._starts(value)]
            except (TypeError, ValueError):
                radii = []
            except InputError as error:
                _, _, fault = str(error).partition(": ")
                raise InputError(f"{where}: {fault}") from None
            if not radii:
                raise InputError(
                    f"{where}: {value!r} is no list of [metres, degrees]"
                )
            if len(set(radii)) < len(radii):
                raise InputError(f"{where}: two starts at one distance")

    def _starts(self, values: Any) -> tuple[Starts, ...]:
        seed = self.settings["seed"]
        return tuple(Starts(float(r), float(turn), seed) for r, turn in values)

    def measure(self, pair: Pair, jobs: Jobs) -> tuple[Result, ...]:
        # Estimators of the user are identified by path and content.
        named = tuple(
            Path(one).absolute() if one.endswith(".py") else one
            for one in self.settings["methods"]
        )
        texts = tuple(
            read_bytes(one).hex() if isinstance(one, Path) else ""
            for one in named
        )
        starts = self._starts(self.settings["starts"])
        part = jobs.files.part("localise", pair.key)
        spacing = self.settings["spacing"] or pair.protocol.query_spacing
        drives = pair.database, *pair.beside
        database = pair.database.source
        openings = 2
        if pair.is_composed:
            sources = tuple(one.source for one in drives)
            database = JoinedSource(sources, pair.keep)
            # A joined drive opens its drives for their poses, then for scans.
            openings = 1 + 2 * len(drives)
        arguments = (
            database,
            pair.query.source,
            named,
            texts,
            starts,
            spacing,
            tuple(self.settings["estimator"].items()),
            self.settings["odometry_drift"],
        )
        cost = openings * OPENING_COST + _QUERIES_COST * pair.query.share
        cost += sum(_MAP_COST * one.share for one in drives)
        needs = [need for one in (*drives, pair.query) for need in one.needs]
        found = jobs.add(
            part,
            measure_localisation,
            arguments,
            needs,
            cost,
            self.version,
            pair.title,
        )
        return (found,)

    def _named_results(
        self, found: Sequence[np.ndarray]
    ) -> Iterator[tuple[str, Any]]:
        """Yields name and localised queries per method and initial error."""
        starts = self.settings["starts"]
        rows = iter(found)
        if not found:
            return
        for method in self.settings["methods"]:
            stem = Path(method).stem if method.endswith(".py") else method
            for radius, _ in starts:
                far = f" from {radius:g} m" if len(starts) > 1 else ""
                yield f"{stem}{far}", next(rows)

    def numbers(self, found: Any, before: Any | None) -> Iterator[Number]:
        then = dict(self._named_results(before or ()))
        for method, rows in self._named_results(found):
            base = then.get(method)
            yield from numbers_of(
                self.name,
                localised(rows),
                None if base is None else localised(base),
                method=method,
            )

    def answers(self, found: Any) -> Iterator[Answered]:
        for method, rows in self._named_results(found):
            yield method, False, localisation_columns(rows)


def _check(name: str, value: Any, where: str) -> None:
    """Checks a setting that has no list of values."""
    if name == "estimator":
        fits, wanted = isinstance(value, dict), "a mapping of settings"
    elif name == "seed":
        fits = type(value) is int and value >= 0
        wanted = "a whole number from 0 on"
    else:
        is_number = type(value) in (int, float)
        fits = value is None or (is_number and 0.0 <= value <= 1.0)
        wanted = "a share from 0 to 1"
    if not fits:
        raise InputError(f"{where}: {value!r} is not {wanted}")


def measure_localisation(
    reporter: Reporter,
    database: Callable[[], Drive | Path],
    query: Callable[[], Drive],
    methods: tuple[str | Path, ...],
    texts: tuple[str, ...],
    starts: tuple[Starts, ...],
    spacing: float,
    values: tuple[tuple[str, Any], ...] = (),
    odometry_drift: float | None = None,
    processes: int = 1,
    columns: int | None = None,
) -> list[np.ndarray]:
    """Localises the queries of a pair of drives in one world.

    Each scan is read only once, because a drive may be simulated while it is
    read.

    Args:
        reporter: reports progress.
        database: opens the drive of the map, or returns the file of its points.
        query: opens the drive whose scans are localised.
        methods: names of registration methods, or Python files with your own.
        texts: contents of the Python files, and "" for names of shipped
            methods. Results are computed again if a text changes.
        starts: how the random initial poses of the scans are sampled, one entry
            for each size of their errors.
        spacing: distance between two queries [m].
        values: settings of the methods that differ from their defaults.
        odometry_drift: drift of the odometry with which the drive is tracked,
            see `evaluation.localisation.track_drive`; None to localise single
            scans, `spacing` apart.
        processes: number of processes that localise single scans.
        columns: number of columns of a `.bin` file of points.

    Returns:
        An array for each pair of a method and an entry of `starts`. The arrays
        of the first method come first, in the order of `starts`. Each array
        contains one record of `evaluation.localisation.QUERY` per
        query, or one record of `TRACKED` per tracked scan. If no query is near
        the map, the list is empty.
    """
    mapped = database()
    asked = CountedDrive(query())
    keep = database.keep if isinstance(database, JoinedSource) else KEEP_ALL
    made: list[LocalisationMap] = []

    def make(settings: Settings) -> LocalisationMap:
        # The drive is opened anew for each other map.
        source = database() if made else mapped
        made.append(make_map(source, settings, columns, reporter.note, keep))
        return made[-1]

    localisers = _localisers(methods, values, make)
    try:
        is_mapped = mapped_frames(mapped, localisers[0].surroundings, asked)
    except InputError as error:
        reporter.note(f"{error}{NOT_LOCALISED}")
        return []
    if odometry_drift is None:
        frames = query_frames(asked, is_mapped, spacing)
        if min(processes, len(frames)) == 1:
            queries = read_queries(asked, frames)
            found = localise(
                localisers, queries, starts, asked.name, len(frames)
            )
        else:
            found = _localised_in_jobs(
                asked, frames, made, (methods, values, starts), processes
            )
    else:
        found = []
        for one in localisers:
            for draw in starts:
                # A drive may be simulated while it is read: each track opens
                # it.
                asked = CountedDrive(query())
                found.append(
                    track_drive(one, asked, is_mapped, draw, odometry_drift)
                )
    if asked.num_ignored:
        reporter.note(f"{asked.name}: {asked.num_ignored} {NOT_FINITE}")
    note_sparse(asked.name, found[0], reporter.note)
    return found


def _localisers(
    methods: Sequence[str | Path],
    values: tuple[tuple[str, Any], ...],
    make: Callable[[Settings], LocalisationMap],
) -> list[Localiser]:
    """Returns a localiser for each method.

    Args:
        methods, values: see `measure_localisation`.
        make: makes the map of some settings; it is called once for all methods
            with the same map.
    """
    maps: dict[tuple[float, int], LocalisationMap] = {}
    found = []
    for method in map(str, methods):
        settings = default_settings(method).with_values(values, method)
        estimator = make_estimator(method, settings)
        key = settings.voxel, settings.neighbours
        if key not in maps:
            maps[key] = make(settings)
        found.append(Localiser(maps[key], estimator, settings))
    return found


def _localised_in_jobs(
    drive: Drive,
    frames: Sequence[int],
    maps: Sequence[LocalisationMap],
    how: tuple[Any, ...],
    processes: int,
) -> list[np.ndarray]:
    """Localises scans as `localise` does, in several processes.

    The drive can be of a kind that no other process can open, so its scans and
    the points of the maps are passed on in files.

    Args:
        drive: the drive.
        frames: frames of the scans.
        maps: the maps, in the order in which `_localisers` asks for them.
        how: the last arguments of `localise_queries`.
        processes: number of processes.
    """
    number = min(processes, len(frames))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        points = Part(folder / "maps.data")
        points.write({}, [(one.name, one.surface.points) for one in maps])
        parts = []
        jobs = []
        for k in range(number):
            queries = Part(folder / f"queries {k}.data")
            queries.write({}, [*read_queries(drive, frames[k::number])])
            parts.append(Part(folder / f"results {k}.data"))
            arguments = drive.name, queries, points, *how
            step = MakePart(parts[-1], localise_queries, arguments)
            label = f"scans {k + 1} of {number}"
            jobs.append(Job(f"localise {drive.name}, {label}", step))
        run_jobs(jobs, Cluster(number), resumes=False)
        done = [one.read() for one in parts]
    found = []
    for some in zip(*done, strict=True):
        rows = np.empty(len(frames), QUERY)
        for k, one in enumerate(some):
            rows[k::number] = one
        found.append(rows)
    return found


def localise_queries(
    reporter: Reporter,
    name: str,
    queries: Part,
    maps: Part,
    methods: tuple[str | Path, ...],
    values: tuple[tuple[str, Any], ...],
    starts: tuple[Starts, ...],
) -> list[np.ndarray]:
    """Localises scans in maps that are in files; see `localise`.

    Args:
        reporter: unused.
        name: name of the scans' drive.
        queries: file with the scans, a list of `Query`.
        maps: file with a list of maps, each as its name and points (M, 3) in W.
        methods, values, starts: see `measure_localisation`.
    """
    asked = queries.read()
    clouds = iter(maps.read())

    def make(settings: Settings) -> LocalisationMap:
        map_name, points = next(clouds)
        return map_of(points, map_name, settings.neighbours)

    localisers = _localisers(methods, values, make)
    return localise(localisers, asked, starts, name, len(asked))
