"""Straight pieces of kerb along a drive, and objects placed along them."""

import math

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw

from cns_drake.transient.surroundings import FARTHEST, Surroundings
from evaluation.base import length_of
from worlds.shapes import GroundFrame, GroundSurface, Model

# Distance between points along a kerb [m].
_SPACING = 1.0
# A stretch is not used if its length is more than this times its chord.
_MOST_BENT = 1.05


class KerbStretch(GroundFrame):
    """A straight piece of kerb.

    The frame of a stretch has its origin at the middle of the piece. Its x axis
    runs along the kerb, and its y axis points away from the carriageway.

    Attributes:
        name: name of the stretch, unique in the world.
        cause: field of the scenario's section `transient` that asks for objects
            along the stretch.
        length: distance between the two ends [m].
    """

    def __init__(
        self,
        cause: str,
        cell: tuple[int, int],
        points: np.ndarray,
        outward: np.ndarray,
    ):
        """Determines the frame of a stretch.

        Args:
            cause: see the attribute.
            cell: indices (x, y) of the cell with this stretch.
            points: (N, 2) points along the kerb in W [m].
            outward: (2,) direction away from the carriageway.
        """
        super().__init__(
            middle=(points[0] + points[-1]) / 2,
            yaw=math.atan2(outward[1], outward[0]) - np.pi / 2,
        )
        self.name = f"{cause}_{cell[0]:+d}_{cell[1]:+d}"
        self.cause = cause
        self.length = math.hypot(*(points[-1] - points[0]))

    def put(
        self,
        around: Surroundings,
        suffix: str,
        semantic_class: str,
        model: Model,
        x: float,
        y: float,
        turn: float = 0.0,
        length: float = 0.0,
    ) -> None:
        """Adds an object at a place, with both ends on the ground.

        If there is no ground, the object is left out.

        Args:
            around: surroundings of the drive, to which the object is added.
            suffix: end of the object's name.
            semantic_class: class of the object.
            model: shape of the object.
            x, y: place of the object in the frame of the stretch [m].
            turn: heading of the object relative to the kerb [rad].
            length: distance between the two ends of the object [m]; an object
                of length 0 stands upright.
        """
        yaw = self.yaw + turn
        middle = self.place(x, y)
        along = np.array([math.cos(yaw), math.sin(yaw)]) * length / 2
        ends = np.array([middle, middle - along, middle + along])
        z = around.ground.heights(ends, of_road=y < 0.0)
        height = float(z[0])
        if length == 0.0:
            foot = self.footprint(model, x, y, turn)
            height = around.ground.lowest(foot, height)
        if not np.isfinite(height):  # There is no ground beside the road.
            height = self._road_height(around.ground, x)
        if not np.isfinite(height):  # Both are in gaps of the ground.
            return
        pitch = 0.0
        if length > 0.0 and np.isfinite(z).all():
            pitch = -math.atan2(z[2] - z[1], length)
        around.editing.add(
            f"{self.name}_{suffix}",
            semantic_class,
            model,
            RigidTransform(RollPitchYaw(0.0, pitch, yaw), [*middle, height]),
            self.cause,
        )

    def _road_height(self, ground: GroundSurface, x: float) -> float:
        """Returns the height of the carriageway beside the kerb [m], or NaN."""
        edge = self.place(x, -0.1)[None]
        return float(ground.heights(edge, of_road=True)[0])


def straight_kerbs(
    around: Surroundings, cause: str, cell: float, shortest: float
) -> list[KerbStretch]:
    """Returns the longest straight piece of kerb in each cell near a drive.

    Pieces are at most 30 m from the drive. If there are none, a note says so.

    Args:
        around: surroundings of the drive.
        cause: field of the scenario's section `transient` that asks for objects
            along the kerbs.
        cell: size of the square cells of a grid in W [m].
        shortest: least length of a piece [m].
    """
    best: dict[tuple[int, int], KerbStretch] = {}
    for kerb in around.ground.kerbs(_SPACING):
        cells = np.floor(kerb.points / cell).astype(int)
        cuts = np.flatnonzero(np.diff(cells, axis=0).any(axis=1)) + 1
        for run in np.split(np.arange(len(cells)), cuts):
            points = kerb.points[run]
            if len(run) < 2:
                continue
            walked = length_of(points)
            x, y = (int(value) for value in cells[run[0]])
            outward = kerb.outwards[run].mean(axis=0)
            stretch = KerbStretch(cause, (x, y), points, outward)
            longest = best[x, y].length if (x, y) in best else 0.0
            if (
                stretch.length >= shortest
                and stretch.length > longest
                and walked <= _MOST_BENT * stretch.length
            ):
                best[x, y] = stretch
    found = [
        stretch
        for _, stretch in sorted(best.items())
        if around.drive.distances(stretch.middle[None])[0] < FARTHEST
    ]
    if not found:
        around.editing.note(
            f"{cause}: no structure of class road along the drive"
        )
    return found
