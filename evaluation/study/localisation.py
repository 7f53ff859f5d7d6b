"""Tasks with a map for many pairs of drives, such as the rungs of a ladder."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cns_drake.base import points as clouds
from cns_drake.base.drives.drive import Drive
from cns_drake.base.files import make_folder, read_bytes
from cns_drake.base.jobs.cluster import Cluster
from cns_drake.base.jobs.running import Job, run_jobs
from cns_drake.base.jobs.step import Reporter
from evaluation.localisation import estimators, localise
from evaluation.localisation.localise import Starts
from evaluation.report import ladder
from evaluation.report.tables import Table
from evaluation.study.parts import MakePart, StudyFiles
from evaluation.study.surveys import DriveSource

# Near starts measure accuracy, far ones the basin [m, deg].
STARTS = (Starts(0.5, 2.0), Starts(2.0, 10.0))
FAR_STARTS = STARTS[1:]
# Those of the wheel that this package needs.
SHIPPED = tuple(
    name for name in estimators.METHODS if name != estimators.KISS_MATCHER
)


@dataclass(frozen=True)
class ComparedPair:
    """Two drives that are compared; that of the map is the database."""

    rung: ladder.LadderRung
    sources: tuple[Callable[[], Drive], Callable[[], Drive]]
    seed: int = 1

    @property
    def keys(self) -> dict[str, object]:
        """The first columns of a row."""
        return {
            str(name): get(self) for name, get in ladder.RUNG_COLUMNS.items()
        }

    @property
    def name(self) -> str:
        """Its drives, cause, level and seed, which no other pair has."""
        return " ".join(map(str, (*self.keys.values(), self.seed)))


def localise_pairs(
    pairs: Sequence[ComparedPair],
    output: Path,
    cluster: Cluster,
    methods: Sequence[str] = SHIPPED,
    spacing: float = 10.0,
) -> Path:
    """Localises the queries of pairs, by each method and from each start.

    Writes `localisation.csv`, a row for each pair, method and start,
    `localisation_queries.csv`, one for each query of them, and a figure: the
    share of right ends, and the median error at the strongest level [cm].
    Finished pairs are not repeated. In a map, the first pair is the one without
    a change; queries have a spacing [m]. For methods see `make_estimator`.

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
        read_bytes(one).hex() if isinstance(one, Path) else "" for one in named
    )
    found = measure_pairs(
        pairs,
        output,
        cluster,
        measure_localisation,
        (named, texts, STARTS, spacing),
        "localised",
    )
    summaries, queries, cells = [], [], []
    for pair, of_pair in zip(pairs, found, strict=True):
        draws = [
            (Path(str(one)).stem, start) for one in named for start in STARTS
        ]
        for (method, start), rows in zip(draws, of_pair, strict=True):
            numbers = localise.Localisation(rows).to_json()
            # Time differs from run to run.
            del numbers["seconds_mean"]
            keys = {
                **pair.keys,
                "method": method,
                "start": start.radius,
                "start_turn_deg": start.turn_deg,
            }
            summaries.append(
                {**keys, **numbers, "strength": pair.rung.strength}
            )
            named_columns = {
                name: rows[name].tolist()
                for name in localise.COLUMNS
                if name != "seconds"
            }
            queries.append({**keys, **named_columns})
            error = numbers["translation_median"]
            cells.append(
                ladder.CauseCell(
                    pair.rung.map_name,
                    f"start {start.radius:g} m, {start.turn_deg:g} deg",
                    method,
                    pair.rung.cause,
                    pair.rung.level,
                    float(numbers["success_03m_1deg"] or 0.0),
                    "–" if error is None else _centimetres(error),
                )
            )
    table = output / "localisation.csv"
    Table.of_rows(summaries).write_csv(table)
    Table.of_rows(queries).write_csv(output / "localisation_queries.csv")
    meaning = "part within 0.3 m and 1 deg; numbers: cm"
    ladder.draw_cells(cells, meaning, output / "localisation")
    return table


def _centimetres(error: float) -> str:
    return f"{100.0 * error:.1f}" if error < 0.1 else f"{100.0 * error:.0f}"


def measure_pairs(
    pairs: Sequence[ComparedPair],
    output: Path,
    cluster: Cluster,
    function: Callable[..., Any],
    arguments: tuple[object, ...],
    kind: str,
) -> list[Any]:
    """Returns what a function finds for each pair, once it is measured.

    The function takes a `Reporter`, the sources of a pair, and the arguments
    (see `MakePart`). Everything is in the output folder, which is made; for
    kinds see `StudyFiles.part`.

    Raises:
        InputError: the folder cannot be made, or a step failed.
    """
    make_folder(output)
    files = StudyFiles(output.absolute())
    parts = [files.part(kind, pair.name) for pair in pairs]
    jobs = [
        Job(
            f"compare {pair.name}",
            MakePart(part, function, (*pair.sources, *arguments)),
        )
        for pair, part in zip(pairs, parts, strict=True)
    ]
    run_jobs(jobs, cluster)
    return [part.read() for part in parts]


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

    Each scan is read once, since a drive may be made while it is read. Methods
    are names, or Python files, whose texts make them other inputs. The spacing
    is between two queries [m].

    Returns:
        (K,) of `QUERY` for each method and start, the starts of a method side
        by side.
    """
    del texts
    mapped, asked = database(), query()
    maps: dict[tuple[float, int], estimators.LocalisationMap] = {}
    localisers = []
    for method in methods:
        settings = estimators.default_settings(str(method))
        key = settings.voxel, settings.neighbours
        if key not in maps:
            # The drive is opened anew for each other map.
            source = mapped if not maps else database()
            maps[key] = estimators.make_map(source, settings, reporter.track)
        estimator = estimators.make_estimator(str(method), settings)
        localisers.append(localise.Localiser(maps[key], estimator, settings))
    is_mapped = localise.mapped_frames(
        mapped, localisers[0].surroundings, asked
    )
    frames = localise.query_frames(asked, is_mapped, spacing)
    X_WS = asked.X_WS
    R_WT = localise.way_axes(X_WS[:, :3, 3], X_WS)
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
