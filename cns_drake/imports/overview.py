"""Draws an imported city from above, as a base for routes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
import numpy as np

from cns_drake.imports.foreign_city import Imported
from cns_drake.imports.free_space import CELL, FreeSpace
from cns_drake.imports.waypoint_drives import WaypointDrive
from cns_drake.scene.semantics import CLASS_RGB

_DPI = 130
_INCHES = 9.0
_ROUTE_COLOURS = ("#d7191c", "#2c7bb6")


def draw_overview(
    path: Path,
    structures: Sequence[Imported],
    space: FreeSpace | None,
    drives: Sequence[WaypointDrive],
) -> None:
    """Draws structures, the room for a car, and the drives [m].

    Args:
        path: the picture to write.
        structures: of the whole city.
        space: the room for a car, if it is to be drawn.
        drives: the drives that were found.
    """
    corners = np.concatenate(
        [one.triangles.reshape(-1, 3) for one in structures]
    )
    low, high = corners[:, :2].min(axis=0), corners[:, :2].max(axis=0)
    if space is not None:
        low = space.low
        high = low + CELL * np.array(space.clearance.shape[::-1])
    size = _INCHES * (high - low) / (high - low).max()
    figure = Figure(
        figsize=(size[0] + 0.8, size[1] + 0.6), layout="constrained"
    )
    axes = figure.subplots()
    for is_ground in (True, False):
        alike: dict[tuple[float, float, float], list[np.ndarray]] = {}
        for one in structures:
            if one.is_ground == is_ground and one.kind != "TINRelief":
                alike.setdefault(_colour(one), []).append(one.triangles)
        for colour, triangles in alike.items():
            # An array, which the library takes faster than a list, is none of
            # what its hints allow.
            corners_xy: Any = np.concatenate(triangles)[:, :, :2]
            axes.add_collection(
                PolyCollection(
                    corners_xy,
                    facecolors=[colour],
                    # Without this, fine lines show between triangles.
                    edgecolors="face",
                    linewidths=0.3,
                )
            )
    extent = (low[0], high[0], low[1], high[1])
    if space is not None:
        room = np.where(space.clearance >= space.least, 1.0, np.nan)
        axes.imshow(
            room,
            origin="lower",
            extent=extent,
            cmap="summer",
            alpha=0.35,
            vmax=1.2,
        )
    for drive, line in zip(drives, _ROUTE_COLOURS, strict=False):
        axes.plot(*drive.path.T, color=line, linewidth=2.0)
        axes.plot(*drive.path[0], "o", color=line)
        axes.plot(*drive.path[-1], "s", color=line)
    axes.set(xlim=extent[:2], ylim=extent[2:], xlabel="x [m]", ylabel="y [m]")
    axes.set_aspect("equal")
    axes.grid(alpha=0.3)
    figure.savefig(path, dpi=_DPI, metadata={"Software": None})


def _colour(one: Imported) -> tuple[float, float, float]:
    part = one.structure.model.parts[0]
    if one.structure.semantic_class == "vegetation":
        return CLASS_RGB["vegetation"]
    return part.rgb or CLASS_RGB[one.structure.semantic_class]
