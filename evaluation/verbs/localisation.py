"""The verb `localise`: how well scans are localised in a map."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
import math
from pathlib import Path
from typing import Any

import numpy as np

from evaluation.alignment import When, WorldVerdict, open_pair
from evaluation.base import InputError, json_values, note
from evaluation.drives import Drive, Reading
from evaluation.localisation import (
    FEWEST_POINTS,
    NOT_LOCALISED,
    OneScan,
    Starts,
    default_settings,
    is_right,
    localisation_columns,
    localised,
    make_estimator,
    measure_localisation,
)
from evaluation.recognition import RANDOM_YAW_PROTOCOL, numbers_of
from evaluation.results import Answers, QueryRows, Results
from evaluation.study import LocaliseTask
from evaluation.verbs.measured import (
    Measured,
    map_of,
    noting,
    pair_key,
    rows_of,
)

# Drift of the odometry by default, as a share of the distance.
_USUAL_DRIFT = 0.01
# The poses decide if this part of the scans is localised, and lies ...
_MOSTLY = 0.5
# ... this far [m] ...
_MOVED = 0.25
# ... or turned [deg] from the poses, in the median.
_TURNED_DEG = 0.25


@dataclass(frozen=True, eq=False)
class Localisation(Measured):
    """How well scans are localised in a map.

    Attributes:
        method: name of the registration method.
        map_name: name of the map's drive or file.
        query_name: name of the queries' drive or file.
        starts: the initial guesses.
        odometry_drift: drift of the odometry with which the drive was tracked;
            None if single scans were localised.
        rows: (K,) results of single queries, records of
            `evaluation.localisation.QUERY`, or of a tracked drive.
    """

    method: str
    map_name: str
    query_name: str
    starts: Starts
    odometry_drift: float | None
    rows: np.ndarray

    def to_json(self) -> dict[str, Any]:
        """Returns what `cns-eval localise --json` prints."""
        values = {
            "method": self.method,
            "map": self.map_name,
            "query": self.query_name,
            "start": self.starts.radius,
            "start_turn_deg": self.starts.turn_deg,
            "seed": self.starts.seed,
            "world": self.world.to_json(),
            **self.metrics,
            "seconds_mean": float(self.rows["seconds"].mean()),
        }
        if self.odometry_drift is not None:
            values["odometry_drift"] = self.odometry_drift
        return json_values(values)


def localise(
    place: Drive | Path | str,
    query: Drive | Path | str,
    method: Path | str,
    *,
    start: float = 0.5,
    start_turn: float = 2.0,
    seed: int = 0,
    settings: Mapping[str, Any] | None = None,
    query_spacing: float | None = None,
    track: bool = False,
    odometry_drift: float | None = None,
    align: When = "auto",
    lidar: str | Sequence[str] | None = None,
    odometry: str | Sequence[str] | None = None,
    poses: Path | Sequence[Path] | None = None,
    columns: int | Sequence[int] | None = None,
    pose_gap: float | None = None,
    processes: int = 1,
    on_note: Callable[[str], None] = note,
) -> Localisation:
    """Localises scans in a map from wrong poses, as `cns-eval localise` does.

    Args:
        place: the map: a drive, open or as a path, or the path of a cloud.
        query: the drive whose scans are localised; a cloud counts as one scan.
        method: registration method, or a Python file with one of your own.
        start: distance of the initial guess from the ground truth [m].
        start_turn: angle between the initial guess and the ground truth [deg].
        seed: seed of the random directions of the initial guesses.
        settings: name -> value of each parameter of the method that differs
            from its default.
        query_spacing: distance that the car drives between two queries [m]; by
            default 10. Not with `track`.
        track: whether to track the whole drive.
        odometry_drift: drift of the odometry with which the drive is tracked,
            as a share of the distance; by default 0.01. Only with `track`.
        align: whether to align the drives: `auto` (unless something says
            that they share a world), `always` or `never`.
        lidar: name of the LiDAR, for recordings with several LiDARs; like the
            next three, one value for all drives, or a list with one for each.
        odometry: topic of the poses, for recordings with several.
        poses: file with the poses of the LiDAR, see `open_drive`.
        columns: number of columns of `.bin` files.
        pose_gap: see `open_drive`.
        processes: number of processes that localise single scans.
        on_note: is called with notes for the user.

    Raises:
        InputError: something cannot be read or used, or no scan can be
            localised.

    Example:
        from evaluation import localise

        found = localise("cns/01", "cns/02", "gicp", start=1.0)
        print(found.metrics["success_2m_5deg"])
    """
    _check(query_spacing, odometry_drift, track=track)
    if track and odometry_drift is None:
        odometry_drift = _USUAL_DRIFT
    spacing = query_spacing or RANDOM_YAW_PROTOCOL.query_spacing
    starts = Starts(start, start_turn, seed)  # It checks them.
    # Faults are told before the slow work.
    values = tuple((settings or {}).items())
    chosen = default_settings(str(method)).with_values(values, str(method))
    make_estimator(str(method), chosen)
    readings = Reading.each(
        2,
        lidar=lidar,
        odometry=odometry,
        poses=poses,
        columns=columns,
        pose_gap=pose_gap,
    )
    opened = open_pair((place, query), readings, align, on_note)
    source, asked = opened.drives
    # A point cloud is a drive of one scan.
    if isinstance(asked, Drive):
        drive = asked
    else:
        drive = OneScan(asked, readings[1].columns)
        for text in drive.notes:
            on_note(text)
    notes: list[str] = []
    found = measure_localisation(
        noting(notes.append),
        lambda: source,
        lambda: drive,
        (
            Path(method).absolute()
            if str(method).endswith(".py")
            else str(method),
        ),
        (starts,),
        spacing,
        values,
        odometry_drift,
        processes,
        readings[0].columns,
    )
    if not found:
        raise InputError(notes[-1].removesuffix(NOT_LOCALISED))
    (rows,) = found
    if all(map(math.isnan, rows["unmapped"])):
        raise InputError(
            f"{drive.name}: no scan has {FEWEST_POINTS} points in"
            f" different voxels of {chosen.scan_voxel:g} m"
        )
    for text in notes:
        on_note(text)
    name = Path(method).stem
    task = LocaliseTask(
        {
            "starts": [[start, start_turn]],
            "seed": seed,
            "estimator": dict(values),
            "odometry_drift": odometry_drift,
            **({"spacing": query_spacing} if query_spacing else {}),
        },
        "localise",
    )
    key = pair_key(
        "localise",
        map_of(drive),
        (source.name, drive.name),
        task.name,
        settings=task.changed_settings,
    )
    numbers = [*numbers_of(task.name, localised(rows), method=name)]
    answers = Answers(
        **key, method=name, verified=False, columns=localisation_columns(rows)
    )
    world = _with_offset(opened.world, rows, on_note)
    return Localisation(
        {one.metric: one for one in numbers},
        Results.of(rows_of(numbers, key, world)),
        QueryRows.of([answers]),
        world,
        name,
        source.name,
        drive.name,
        starts,
        odometry_drift,
        rows,
    )


def _with_offset(
    world: WorldVerdict, rows: np.ndarray, on_note: Callable[[str], None]
) -> WorldVerdict:
    """Adds to the verdict how far poses lie from registration, if far.

    Args:
        rows: the results, see `Localisation`.
        on_note: is called with what is added.
    """
    right = is_right(rows)
    if not right.any() and world.doubt:
        on_note(f"no scan is localised{world.doubt}")
    if right.mean() < _MOSTLY:
        return world
    off, turn_deg = (
        float(np.median(rows[name][right]))
        for name in ("translation_error", "rotation_error_deg")
    )
    if off < _MOVED and turn_deg < _TURNED_DEG:
        return world
    text = (
        "the recorded poses decide: scans that are registered to the map lie"
        f" {off:.2f} m and {turn_deg:.2f} deg from them, in the median"
    )
    on_note(text)
    return replace(world, why=f"{world.why}; {text}")


def _check(
    query_spacing: float | None, odometry_drift: float | None, *, track: bool
) -> None:
    """Checks which options are given together, and their ranges."""
    if track and query_spacing is not None:
        raise InputError("--query-spacing: not together with --track")
    if not track and odometry_drift is not None:
        raise InputError("--odometry-drift: only together with --track")
    if query_spacing is not None and not 0.0 < query_spacing < math.inf:
        raise InputError(f"--query-spacing: {query_spacing:g} is not above 0")
    if odometry_drift is not None and not 0.0 <= odometry_drift <= 1.0:
        raise InputError(
            f"--odometry-drift: {odometry_drift:g} is not from 0 to 1"
        )
