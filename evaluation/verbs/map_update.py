"""The verb `map-update`: how well changes between two maps are labelled."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from evaluation.alignment import When, WorldVerdict, open_pair
from evaluation.base import (
    InputError,
    Reporter,
    json_values,
    no_such,
    note,
    one_line,
    poses,
)
from evaluation.map_update import (
    BASELINES,
    GIVEN,
    PairLabels,
    SessionDrive,
    SessionPair,
    read_pair,
    score_methods,
)
from evaluation.recognition import numbers_of
from evaluation.results import QueryRows, Results
from evaluation.verbs.measured import Measured, pair_key, rows_of


@dataclass(frozen=True, eq=False)
class MapUpdate(Measured):
    """How well the changes between two maps are labelled.

    Attributes:
        method: name of the change detector, or `labels`.
        scores: all scores, also by class and by distance, ready for JSON.
        labels: the labels of both maps.
    """

    method: str
    scores: dict[str, Any]
    labels: PairLabels

    def to_json(self) -> dict[str, Any]:
        """Returns what `cns-eval map-update --json` prints."""
        return json_values(
            {
                "method": self.method,
                "world": self.world.to_json(),
                **self.scores,
                **self.metrics,
            }
        )


def update_map(
    folder: Path | str,
    *,
    baseline: str = "free-space",
    labels: tuple[Path, Path] | None = None,
    align: When = "auto",
    on_note: Callable[[str], None] = note,
) -> MapUpdate:
    """Scores labels of the changes between two maps, as `map-update` does.

    Args:
        folder: folder with the maps and their ground truth.
        baseline: change detector that labels the maps: `free-space`, `distance`
            or `m3c2`.
        labels: files with labels of your own, of the older and of the newer
            map, which are scored instead.
        align: whether to align the maps by their scans: `always`; or `auto` or
            `never`, since the maps of a folder share a world.
        on_note: is called with notes for the user.

    Raises:
        InputError: the folder or a file cannot be read, or the detector cannot
            run.

    Example:
        from evaluation import update_map

        print(update_map("maps", baseline="distance").metrics["miou"])
    """
    if baseline not in BASELINES:
        fault = no_such("baseline", baseline, BASELINES)
        raise InputError(f"baseline: {fault}")
    folder = Path(folder)
    sessions, world = _in_one_world(read_pair(folder), align, on_note)
    method = baseline if labels is None else GIVEN
    methods = (baseline,) if labels is None else ()
    found = score_methods(Reporter(), folder, methods, labels or (), sessions)[
        method
    ]
    numbers = [*numbers_of("map", found, method=method)]
    key = pair_key(
        "map-update",
        one_line(folder.resolve().name),
        (sessions.A.folder.name, sessions.B.folder.name),
        "map",
    )
    return MapUpdate(
        {one.metric: one for one in numbers},
        Results.of(rows_of(numbers, key, world)),
        QueryRows.of(()),
        world,
        method,
        found.scores,
        found.labels,
    )


# Greatest distance by which an alignment may bend a map's path [m].
_BEND = 0.05


def _in_one_world(
    pair: SessionPair, align: When, on_note: Callable[[str], None]
) -> tuple[SessionPair, WorldVerdict]:
    """Returns the maps in one world, and the verdict."""
    if align != "always":
        why = "the maps of a folder share a world, by its form"
        on_note(f"world: {why}")
        return pair, WorldVerdict(True, False, why)
    drives = [SessionDrive(one) for one in pair]
    opened = open_pair(drives, when=align, on_note=on_note)
    found = []
    for session, drive in zip(pair, opened.drives, strict=True):
        assert not isinstance(drive, Path)
        X_VW = drive.X_WS[0] @ poses.inverse(session.X_WS[0])
        off = (X_VW @ session.X_WS - drive.X_WS)[:, :3, 3]
        bend = float(np.linalg.norm(off, axis=1).max())
        if bend > _BEND:
            raise InputError(
                f"{session.folder}: the alignment bends the path by"
                f" {bend:.2f} m, and a finished map cannot follow; align the"
                " drives, and make their maps again"
            )
        points = poses.transform(X_VW, session.points)
        found.append(replace(session, points=points, X_WS=drive.X_WS))
    return SessionPair(*found), opened.world
