"""What drives see of a city: which walls are near, and which visible."""

from collections.abc import Sequence

from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
import numpy as np
from scipy.spatial import KDTree
import shapely
from shapely.geometry import LineString

from cns_drake.imports.dressing.wall_panels import Panel
from cns_drake.imports.drives.steerable_drives import WaypointRoute
from cns_drake.imports.ground import Ground

# Distance between the places on drives from which walls are looked at [m].
_SPACING = 4.0
# Height of the eyes above the ground [m].
_EYES = 2.0
# A wall is looked at from this many of the nearest places.
_NEAREST = 8
# A wall is also looked at from about this many other places.
_OTHERS = 24
# Probes of a wall are at these parts of its length and height. The wall is
# visible if one of its probes is visible.
_PROBES = np.array([(x, z) for x in (0.04, 0.5, 0.96) for z in (0.3, 1.0)])
# Probes are this far in front of the wall [m].
_BEFORE = 0.3
# The highest probes are this far below the top of the wall [m].
_BELOW_TOP = 0.3


class DriveViews:
    """Viewpoints along drives, to find out which walls are visible."""

    def __init__(
        self,
        drives: Sequence[WaypointRoute],
        ground: Ground,
        solids: np.ndarray,
    ):
        """Takes viewpoints along the drives, of which there is at least one.

        `solids` (M, 3, 3) are the triangles that occlude walls in all stages
        [m].
        """
        paths = [LineString(drive.path) for drive in drives]
        self._xy = shapely.get_coordinates(shapely.segmentize(paths, _SPACING))
        z = ground.height(self._xy) + _EYES
        self._eyes = np.column_stack([self._xy, z])
        self._tree = KDTree(self._xy)
        self._scene = None
        # Embree computes in float32, so coordinates are relative to the middle
        # of the places.
        self._middle = np.array([*self._xy.mean(axis=0), 0.0])
        if len(solids):
            self._scene = EmbreeScene()
            TriangleMesh(self._scene, (solids - self._middle).astype("f4"))

    def are_near(self, limits: np.ndarray, distance: float) -> np.ndarray:
        """Returns (N,) bool: whether boxes are near a drive.

        `limits` (N, 2, 2) contains the least and the greatest x and y of each
        box [m]. A box counts as near if the circle around it is at most
        `distance` [m] from a viewpoint.
        """
        middles = limits.mean(axis=1)
        reach = np.linalg.norm(limits[:, 1] - middles, axis=1)
        return np.asarray(self._tree.query(middles)[0] <= reach + distance)

    def distances(self, panels: Sequence[Panel], most: float) -> np.ndarray:
        """Returns the distance from which drives see each wall, (N,) [m].

        This is the distance from the wall to the nearest viewpoint on a drive
        from which the wall is visible; infinite without such a viewpoint.

        Args:
            panels: the N walls.
            most: greatest distance at which a viewpoint counts [m].
        """
        facing = [self._facing_places(panel, most) for panel in panels]
        counts = [len(distances) for _, distances in facing]
        if not sum(counts):
            return np.full(len(panels), np.inf)
        number = np.repeat(np.arange(len(panels)), counts)
        place = np.concatenate([places for places, _ in facing])
        distance = np.concatenate([distances for _, distances in facing])
        probes = []
        for panel in panels:
            top = max(panel.height - _BELOW_TOP, panel.height / 2.0)
            x, z = _PROBES.T * [[panel.length], [top]]
            probes.append(panel.place(x, z, _BEFORE))
        is_seen = self._is_seen(np.stack(probes)[number], self._eyes[place])
        nearest = np.full(len(panels), np.inf)
        np.minimum.at(nearest, number[is_seen], distance[is_seen])
        return nearest

    def _facing_places(
        self, panel: Panel, most: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Returns the places that face a panel, and their distances.

        The result is two arrays (K,): numbers of places at most `most` from the
        panel, and their distances from the panel [m]. The nearest places are
        all included, of the others only some.
        """
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
        """Returns (K,) bool: whether eyes see any of their probes.

        `eyes` (K, 3) and `probes` (K, P, 3) are places in W [m].
        """
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
