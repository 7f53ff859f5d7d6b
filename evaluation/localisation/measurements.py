"""Measures localisation between two drives."""

from collections.abc import Callable, Sequence
from pathlib import Path
import tempfile
from typing import Any

import numpy as np

from evaluation.base import (
    Cluster,
    InputError,
    Job,
    MakePart,
    Part,
    Reporter,
    run_jobs,
)
from evaluation.drives import NOT_FINITE, CountedDrive, Drive, JoinedSource
from evaluation.localisation.estimators import make_estimator
from evaluation.localisation.initial_poses import Starts
from evaluation.localisation.localisation_map import (
    LocalisationMap,
    make_map,
    map_of,
)
from evaluation.localisation.localiser import (
    Localiser,
    localise,
    mapped_frames,
    query_frames,
    read_queries,
)
from evaluation.localisation.results import QUERY, note_sparse
from evaluation.localisation.settings import Settings, default_settings
from evaluation.localisation.tracking import track_drive
from evaluation.recognition import KEEP_ALL

# The end of a note on a drive without a query near the map.
NOT_LOCALISED = ": not localised"


def measure_localisation(
    reporter: Reporter,
    database: Callable[[], Drive | Path],
    query: Callable[[], Drive],
    methods: tuple[str | Path, ...],
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
