"""The site of a building: its ground, and the walls against neighbours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from shapely.geometry import Polygon

from worlds.shapes import outlines

# Numbers of the front corners of a rectangular site.
FRONT_LEFT = 0
FRONT_RIGHT = 1


@dataclass(frozen=True)
class Site:
    """The ground of a building, a simple polygon in the building's frame S [m].

    Edges are numbered counter-clockwise from the front, which is edge 0. The
    front is the edge between the first two corners; in a rectangle along the
    axes, the edge of least y.

    Attributes:
        footprint: the polygon.
        name: name of the building, with which the names of its meshes begin.
        blind_edges: numbers of the edges whose walls are built against a
            neighbour.
    """

    footprint: Polygon
    name: str
    blind_edges: frozenset[int] = frozenset()

    @property
    def outline(self) -> np.ndarray:
        """Corners (N, 2) of the footprint, counter-clockwise [m].

        The first two corners are the ends of the front. If the footprint is a
        rectangle, its corners are rounded inwards to whole centimetres.
        """
        exterior = self.footprint.exterior
        points = np.array(exterior.coords[:-1], dtype=float)
        if not exterior.is_ccw:
            # After the reversal the former first edge runs from 1 to 0.
            points = np.roll(points[::-1], 2, axis=0)
        if self.is_rectangle:
            # The corner from which the edge of least y starts: the lowest,
            # leftmost one.
            start = int(np.lexsort((points[:, 0], points[:, 1]))[0])
            points = np.roll(points, -start, axis=0)
            # Whole centimetres make the text of the meshes shorter. They are
            # rounded inwards, so that they never lie outside the footprint.
            low, high = points[0], points[2]
            low = np.ceil(np.round(100.0 * low, 3)) / 100.0
            high = np.floor(np.round(100.0 * high, 3)) / 100.0
            points = outlines.rectangle(*low, *high)
        return points

    @property
    def width(self) -> float:
        """Length of a rectangular site along its front [m]."""
        x0, _, x1, _ = self.bounds
        return x1 - x0

    @property
    def depth(self) -> float:
        """Length of a rectangular site from front to back [m]."""
        _, y0, _, y1 = self.bounds
        return y1 - y0

    @property
    def open_length(self) -> float:
        """Total length of all walls except blind ones [m]."""
        outline = self.outline
        ends = np.roll(outline, -1, axis=0)
        lengths = np.linalg.norm(ends - outline, axis=1)
        open_edges = (
            k for k in range(len(lengths)) if k not in self.blind_edges
        )
        return float(sum(lengths[k] for k in open_edges))

    @property
    def free_corners(self) -> list[int]:
        """The front corners of a rectangle that no blind wall touches."""
        edges_at = {FRONT_LEFT: {3, 0}, FRONT_RIGHT: {0, 1}}
        return [k for k, e in edges_at.items() if not e & self.blind_edges]

    def blind_edges_of_unit(self, number: int, count: int) -> frozenset[int]:
        """Returns the blind edges of one of several units side by side.

        Edges between two units are blind. The left edge of the first unit, and
        the right edge of the last unit, are blind if the same edge of the site
        is blind. The result is a set of edge numbers: 3 is the left edge, and 1
        the right edge.

        Args:
            number: number of the unit, counted from 0 on the left.
            count: number of all units in the row.
        """
        outer = {3: number == 0, 1: number + 1 == count}
        return frozenset(
            edge
            for edge, is_end in outer.items()
            if not is_end or edge in self.blind_edges
        )

    def detached(self, gap: float) -> Site:
        """Returns the site with its blind edges moved inwards by `gap` [m].

        The resulting site has no blind edges. If `gap` is at least the overhang
        of a building, the building touches no neighbour.
        """
        outline = self.outline
        gaps = [gap * (k in self.blind_edges) for k in range(len(outline))]
        return Site(Polygon(outlines.inset(outline, gaps)), self.name)

    @property
    def is_rectangle(self) -> bool:
        """Whether the footprint is a rectangle along the x and y axis."""
        box = self.footprint.envelope
        return bool(
            len(self.footprint.exterior.coords) == 5
            and self.footprint.area > 0.999 * box.area
        )

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Least x and y, and greatest x and y, of a rectangular footprint [m].

        Raises:
            ValueError: the footprint is not a rectangle along the x and y axis
                of the building's frame.
        """
        if not self.is_rectangle:
            raise ValueError(f"{self.name} needs a rectangular footprint")
        outline = self.outline
        return (*outline[0].tolist(), *outline[2].tolist())
