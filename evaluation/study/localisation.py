"""Localisation of many pairs of drives, such as the rungs of a ladder."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cns_drake.base import points as clouds
from cns_drake.base.files import make_folder
from cns_drake.base.jobs.cluster import Cluster
from cns_drake.base.jobs.running import Job, run_jobs
from cns_drake.base.jobs.step import Reporter
from evaluation.localisation.estimators import (
    KISS_MATCHER,
    METHODS,
    LocalisationMap,
    default_settings,
    make_estimator,
    make_map,
)
from evaluation.localisation.localise import (
    COLUMNS,
    Localiser,
    Starts,
    mapped_frames,
    query_frames,
    way_axes,
)
from evaluation.report.compared import ComparedPair, write_compared
from evaluation.report.localisation import LocalisedRow, draw_localised
from evaluation.report.tables import Columns, keyed
from evaluation.study.parts import MakePart, Part, StudyFiles
from evaluation.study.surveys import DriveSource

# Near starts measure accuracy, far ones the basin [m, deg].
STARTS = (Starts(0.5, 2.0), Starts(2.0, 10.0))
FAR_STARTS = STARTS[1:]
# Those of the wheel that this package needs.
SHIPPED = tuple(name for name in METHODS if name != KISS_MATCHER)
_COST = 60.0


def localise_pairs(
    pairs: Sequence[ComparedPair],
    output: Path,
    cluster: Cluster,
    methods: Sequence[str] = SHIPPED,
    spacing: float = 10.0,
) -> Path:
    """Localises the queries of pairs, by each method and from each start.

    Writes `localisation.csv`, a row for each pair, method and start,
    `localisation_queries.csv`, one for each query of them, and a figure.
    Finished pairs are not repeated.

    Args:
        pairs: the pairs; in a map, the first is the one without a change.
        output: the folder for everything.
        cluster: where the work is done.
        methods: see `make_estimator`.
        spacing: between two queries [m].

    Returns:
        The path of `localisation.csv`.

    Raises:
        InputError: the folder cannot be made, or a step failed.
    """
    # Own methods are known by their place and their content.
    named = tuple(
        Path(name).absolute() if name.endswith(".py") else name
        for name in methods
    )
    texts = tuple(
        one.read_bytes().hex() if isinstance(one, Path) else "" for one in named
    )
    found = measure_pairs(
        pairs,
        output,
        cluster,
        measure_localisation,
        (named, texts, STARTS, spacing),
        StudyFiles.localised,
    )
    rows = [
        LocalisedRow(pair, Path(str(method)).stem, starts, queries)
        for pair, of_pair in zip(pairs, found, strict=True)
        for method, starts, queries in _by_method(of_pair, named)
    ]
    start: Columns[LocalisedRow] = {
        "start": lambda row: row.starts.radius,
        "start_turn_deg": lambda row: row.starts.turn_deg,
    }
    # Time differs from run to run.
    summary: Columns[LocalisedRow] = keyed(
        {name: name for name in rows[0].summary if name != "seconds_mean"},
        lambda row, name: row.summary[name],
    )
    queries: Columns[LocalisedRow] = keyed(
        {name: name for name in COLUMNS if name != "seconds"},
        lambda row, name: row.rows[name].tolist(),
    )
    strength: Columns[LocalisedRow] = {
        "strength": lambda row: row.rung.strength
    }
    table = output / "localisation.csv"
    write_compared(table, rows, {**start, **summary, **strength})
    write_compared(
        output / "localisation_queries.csv", rows, {**start, **queries}
    )
    draw_localised(rows, output / "localisation")
    return table


def measure_pairs(
    pairs: Sequence[ComparedPair],
    output: Path,
    cluster: Cluster,
    function: Callable[..., Any],
    arguments: tuple[object, ...],
    file: Callable[[StudyFiles, str], Part],
) -> list[Any]:
    """Returns what a function finds for each pair, once it is measured.

    Args:
        pairs: the pairs.
        output: the folder for everything; it is made.
        cluster: where the work is done.
        function: takes a `Reporter`, the sources of a pair, and the arguments.
        arguments: further ones, see `MakePart`.
        file: gives the file of the pair of a name.

    Raises:
        InputError: the folder cannot be made, or a step failed.
    """
    make_folder(output)
    files = StudyFiles(output.absolute())
    parts = [file(files, pair.name) for pair in pairs]
    jobs = [
        Job(
            f"compare {pair.name}",
            MakePart(part, function, (*pair.sources, *arguments)),
            cost=_COST,
        )
        for pair, part in zip(pairs, parts, strict=True)
    ]
    run_jobs(jobs, cluster)
    return [part.read() for part in parts]


def _by_method(
    found: list[np.ndarray], methods: tuple[str | Path, ...]
) -> list[tuple[str | Path, Starts, np.ndarray]]:
    keys = [(method, starts) for method in methods for starts in STARTS]
    return [(*key, rows) for key, rows in zip(keys, found, strict=True)]


def measure_localisation(
    reporter: Reporter,
    database: DriveSource,
    query: DriveSource,
    methods: tuple[str | Path, ...],
    texts: tuple[str, ...],
    starts: tuple[Starts, ...],
    spacing: float,
) -> list[np.ndarray]:
    """Localises the queries of a pair of drives in one world.

    Each scan is read once, since a drive may be made while it is read.

    Args:
        reporter: takes the progress.
        database: the drive of the map.
        query: the drive of the queries.
        methods: names, or Python files.
        texts: the content of these files.
        starts: draws of starts.
        spacing: between two queries [m].

    Returns:
        (K,) of `QUERY` for each method and start, the starts of a method side
        by side.
    """
    del texts
    mapped, asked = database(), query()
    maps: dict[tuple[float, int], LocalisationMap] = {}
    localisers = []
    for method in methods:
        settings = default_settings(str(method))
        key = settings.voxel, settings.neighbours
        if key not in maps:
            # The drive is opened anew for each other map.
            source = mapped if not maps else database()
            maps[key] = make_map(source, settings, reporter.track)
        estimator = make_estimator(str(method), settings)
        localisers.append(Localiser(maps[key], estimator, settings))
    is_mapped = mapped_frames(mapped, localisers[0].surroundings, asked)
    frames = query_frames(asked, is_mapped, spacing)
    X_WS = asked.X_WS
    R_WT = way_axes(X_WS[:, :3, 3], X_WS)
    found: list[list[np.ndarray]] = [
        [] for _ in range(len(methods) * len(starts))
    ]
    for frame in reporter.track(frames, "localising", len(frames)):
        scan = clouds.from_xyz(clouds.xyz(asked.scan(frame)))
        ends = iter(found)
        for localiser in localisers:
            for draw in starts:
                row, _ = localiser.query(
                    frame,
                    int(asked.stamps_ns[frame]),
                    scan,
                    X_WS[frame],
                    R_WT[frame],
                    *draw.draw(frame),
                )
                next(ends).append(row)
    return [np.array(rows) for rows in found]
