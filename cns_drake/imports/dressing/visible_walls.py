"""The walls that drives through an imported city see, and their distance."""

from __future__ import annotations

from collections.abc import Sequence

from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
import numpy as np
from scipy.spatial import KDTree
import shapely
from shapely.geometry import LineString

from cns_drake.imports.dressing.wall_panels import Panel
from cns_drake.imports.drives.search import WaypointDrive
from cns_drake.imports.ground import Ground

# Distance of the places on drives from which walls are looked at [m].
_SPACING = 4.0
# Height of the eyes above the ground [m].
_EYES = 2.0
# A wall is looked at from this many nearest places, and this many others.
_NEAREST, _OTHERS = 8, 24
# A wall is visible if a probe is: at these parts of its length and height, this
# far in front, and a little below its top [m].
_PARTS = np.array([(x, z) for x in (0.04, 0.5, 0.96) for z in (0.3, 1.0)])
_BEFORE, _BELOW_TOP = 0.3, 0.3


class DriveViews:
    """Places on drives from which a city is seen."""

    def __init__(
        self,
        drives: Sequence[WaypointDrive],
        ground: Ground,
        solids: np.ndarray,
    ):
        """Prepares the views.

        Args:
            drives: at least one.
            ground: below them.
            solids: (M, 3, 3) triangles that hide other things at all stages
                [m].
        """
        paths = [LineString(drive.path) for drive in drives]
        self._xy = shapely.get_coordinates(shapely.segmentize(paths, _SPACING))
        z = ground.height(self._xy) + _EYES
        self._eyes = np.column_stack([self._xy, z])
        self._tree = KDTree(self._xy)
        self._scene = None
        # Embree computes in float32, about the middle of the views.
        self._middle = np.array([*self._xy.mean(axis=0), 0.0])
        if len(solids):
            self._scene = EmbreeScene()
            TriangleMesh(self._scene, (solids - self._middle).astype("f4"))

    def are_near(self, limits: np.ndarray, distance: float) -> np.ndarray:
        """Returns which (N,) boxes have a place nearby.

        Args:
            limits: (N, 2, 2) least and greatest x and y [m].
            distance: from a place to the circle about a box, at most [m].
        """
        middles = limits.mean(axis=1)
        reach = np.linalg.norm(limits[:, 1] - middles, axis=1)
        return np.asarray(self._tree.query(middles)[0] <= reach + distance)

    def distances(self, panels: Sequence[Panel], most: float) -> np.ndarray:
        """Returns panels' distances (N,) from the nearest viewing place [m].

        The distance is infinite if no place within `most` sees the panel.

        Args:
            panels: N walls.
            most: the greatest distance [m].
        """
        pairs = [self._looks(panel, most) for panel in panels]
        counts = [len(distance) for _, distance in pairs]
        if not sum(counts):
            return np.full(len(panels), np.inf)
        number = np.repeat(np.arange(len(panels)), counts)
        place = np.concatenate([some for some, _ in pairs])
        distance = np.concatenate([some for _, some in pairs])
        probes = np.stack([_probes(panel) for panel in panels])
        is_seen = self._is_seen(probes[number], self._eyes[place])
        found = np.full(len(panels), np.inf)
        np.minimum.at(found, number[is_seen], distance[is_seen])
        return found

    def _looks(
        self, panel: Panel, most: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Returns places (K,) in front of a panel, and distances (K,) [m]."""
        middle = panel.origin[:2] + panel.along * panel.length / 2.0
        near = self._tree.query_ball_point(middle, most + panel.length / 2.0)
        index = np.array(near, dtype=int)
        from_start = self._xy[index] - panel.origin[:2]
        out = from_start @ panel.outward
        x = from_start @ panel.along
        aside = np.maximum(np.maximum(-x, x - panel.length), 0.0)
        distance = np.hypot(out, aside)
        usable = np.flatnonzero((out > 0.0) & (distance <= most))
        usable = usable[np.argsort(distance[usable], kind="stable")]
        step = max(1, (len(usable) - _NEAREST) // _OTHERS)
        usable = np.append(usable[:_NEAREST], usable[_NEAREST::step])
        return index[usable], distance[usable]

    def _is_seen(self, probes: np.ndarray, eyes: np.ndarray) -> np.ndarray:
        """Returns (K,) bool: whether eyes (K, 3) see probes (K, P, 3)."""
        if self._scene is None:
            return np.ones(len(eyes), dtype=bool)
        starts = np.repeat(eyes - self._middle, probes.shape[1], axis=0)
        ways = (probes - self._middle).reshape(-1, 3) - starts
        hits = self._scene.run(
            starts.astype("f4"),
            ways.astype("f4"),
            np.ones(len(ways), dtype="f4"),
            query="OCCLUDED",
        )
        return np.asarray((hits < 0).reshape(len(eyes), -1).any(axis=1))


def _probes(panel: Panel) -> np.ndarray:
    """Returns places (P, 3) before a panel [m]."""
    top = max(panel.height - _BELOW_TOP, panel.height / 2.0)
    return panel.place(_PARTS[:, 0] * panel.length, _PARTS[:, 1] * top, _BEFORE)
