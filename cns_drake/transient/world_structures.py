"""The structures of a loaded world, and the ground below them."""

from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
import hashlib
from typing import NamedTuple, cast

import numpy as np
from pydrake.geometry import Role
from pydrake.math import RigidTransform
import shapely
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

from cns_drake.base.elementary import product
from cns_drake.city.geometry import (
    UpperSides,
    from_above,
    polygons_of,
    turned_up,
    unit_normals,
)
from cns_drake.scene import surfaces
from cns_drake.scene.materials import Material
from cns_drake.scene.perception_geometry import (
    GeometryReader,
    PerceptionGeometry,
    list_geometry,
    structure_name,
)
from cns_drake.scene.world import World

# Classes of the ground on which other objects stand.
GROUND_CLASSES = frozenset(
    {"road", "parking", "sidewalk", "other-ground", "terrain"}
)
# Cars and people can pass below parts that are higher than this above a
# structure's foot [m].
_HEADROOM = 2.2
# Corners of the box around a round shape of unit size.
_BOX = np.array(
    [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float
)


@dataclass(frozen=True)
class LoadedPart:
    """One geometry of a structure that a LiDAR can see.

    Attributes:
        geometry: the geometry G.
        X_WG: its pose in W.
        material: its material.
    """

    geometry: PerceptionGeometry
    X_WG: RigidTransform
    material: Material

    @property
    def name(self) -> str:
        """The part's name within its structure."""
        return self.geometry.part

    @cached_property
    def p_WPs(self) -> np.ndarray:
        """Points (N, 3) in W whose convex hull contains the part [m]."""
        surface = self.geometry.surface
        if isinstance(surface, surfaces.TriangleSurface):
            p_GPs = surface.p_GVset
        elif isinstance(surface, surfaces.EllipsoidSurface):
            p_GPs = _BOX * surface.semi_axes
        elif isinstance(
            surface, surfaces.CylinderSurface | surfaces.CapsuleSurface
        ):
            r = surface.radius
            half = surface.length / 2
            if isinstance(surface, surfaces.CapsuleSurface):
                half += r
            p_GPs = _BOX * (r, r, half)
        else:
            assert isinstance(surface, surfaces.HalfSpaceSurface)
            p_GPs = np.zeros((0, 3))
        R, p = self.X_WG.rotation().matrix(), self.X_WG.translation()
        return product(p_GPs, R.T) + p


@dataclass(frozen=True)
class LoadedStructure:
    """A structure as a LiDAR sees it in a loaded world, as geometries in W.

    (A `cns_drake.city.geometry.Structure` is one that is to be written.)

    Attributes:
        name: name of the structure.
        semantic_class: its class, a key of
            `cns_drake.scene.semantics.CLASS_IDS`.
        parts: its geometries.
    """

    name: str
    semantic_class: str
    parts: tuple[LoadedPart, ...]

    @cached_property
    def p_WPs(self) -> np.ndarray:
        """Points (N, 3) in W whose convex hull contains the structure [m]."""
        return np.concatenate([part.p_WPs for part in self.parts])

    @cached_property
    def bottom(self) -> float:
        """Height of the structure's lowest point in W [m]."""
        return float(self.p_WPs[:, 2].min(initial=np.inf))

    @cached_property
    def top(self) -> float:
        """Height of the structure's highest point in W [m]."""
        return float(self.p_WPs[:, 2].max(initial=self.bottom))

    @cached_property
    def outline(self) -> BaseGeometry:
        """The convex hull of the whole structure, seen from above [m]."""
        return _hull(self.p_WPs)

    @cached_property
    def footprint(self) -> BaseGeometry:
        """The convex hull of the parts near the ground, seen from above [m]."""
        p_WPs = self.p_WPs
        return _hull(p_WPs[p_WPs[:, 2] <= self.bottom + _HEADROOM])


def _hull(p_WPs: np.ndarray) -> BaseGeometry:
    points = shapely.multipoints(p_WPs[:, :2])
    return cast(BaseGeometry, shapely.convex_hull(points))


def read_structures(
    world: World, wanted: Callable[[str], bool] = lambda name: True
) -> dict[str, LoadedStructure]:
    """Returns name -> structure, for the static structures of a world.

    The names are sorted.

    Args:
        world: the world, not yet part of a diagram.
        wanted: returns whether the structure with a name is wanted; by default
            all are.

    Raises:
        InputError: a mesh cannot be read.
    """
    plant = world.plant
    context = plant.CreateDefaultContext()
    X_WFs = {
        frame: plant.GetBodyFromFrameId(frame).EvalPoseInWorld(context)
        for frame in world.anchored_frames()
    }
    X_WFs[world.scene_graph.world_frame_id()] = RigidTransform()
    records = list_geometry(
        world.scene_graph.model_inspector(), Role.kPerception
    )
    found = defaultdict(list)
    for geometry in GeometryReader().read(
        one
        for one in records
        if one.frame_id in X_WFs and wanted(structure_name(one.name))
    ):
        X_WG = X_WFs[geometry.frame_id] @ geometry.X_FG
        entry = world.structures[geometry.structure]
        part = LoadedPart(geometry, X_WG, entry.material(geometry.part))
        found[geometry.structure].append(part)
    return {
        name: LoadedStructure(
            name, world.structures[name].semantic_class, tuple(found[name])
        )
        for name in sorted(found)
    }


class Obstacles:
    """Areas, seen from above, where new objects must not stand."""

    def __init__(self, areas: Iterable[tuple[str, BaseGeometry]]):
        """Collects obstacles.

        Args:
            areas: name and area of each obstacle, seen from above [m].
        """
        pairs = [(n, area) for n, area in areas if not area.is_empty]
        self._names = np.array([name for name, _ in pairs], object)
        self._areas = [area for _, area in pairs]
        self._tree = shapely.STRtree(self._areas)

    def is_free(
        self, area: BaseGeometry, ignored: Collection[str] = ()
    ) -> bool:
        """Returns whether an area touches no obstacle.

        Args:
            area: the area, seen from above [m].
            ignored: names of obstacles that do not count.
        """
        return not self._met(area, ignored)

    def distance(
        self, area: BaseGeometry, within: BaseGeometry, ignored: Collection[str]
    ) -> float:
        """Returns the distance from an area to the nearest obstacle [m].

        The distance is inf if there is no obstacle.

        Args:
            area: the area, seen from above [m].
            within: area of search. Parts of obstacles outside of it do not
                count.
            ignored: names of obstacles that do not count.
        """
        return min(
            (
                float(area.distance(shapely.intersection(other, within)))
                for other in self._met(within, ignored)
            ),
            default=np.inf,
        )

    def _met(
        self, area: BaseGeometry, ignored: Collection[str]
    ) -> list[BaseGeometry]:
        found = self._tree.query(area, predicate="intersects")
        return [
            self._areas[k]
            for k in sorted(found)
            if self._names[k] not in ignored
        ]


# Steeper surfaces are not ground: least z of the unit normal.
_LEAST_UP = 0.3
# Slits between triangles are closed up to twice this width [m].
_SEAM = 0.05
# Smaller islands and holes have no kerb of their own [m^2].
_LEAST_AREA = 4.0


class Kerb(NamedTuple):
    """A stretch of the edge of the carriageway.

    Attributes:
        points: (N, 2) points along the edge, in W [m].
        outwards: (N, 2) unit vectors at the points, away from the road.
    """

    points: np.ndarray
    outwards: np.ndarray


class GroundSurface:
    """The ground near a drive.

    Attributes:
        near: area in which the ground is known, seen from above [m].
    """

    def __init__(
        self, things: Mapping[str, LoadedStructure], near: BaseGeometry
    ):
        """Collects the ground in an area.

        Args:
            things: name -> structure, for all structures of the world.
            near: area in which the ground is known, seen from above [m].
        """
        shapely.prepare(near)
        self.near = near
        corners = {of_road: [np.zeros((0, 3, 3))] for of_road in (False, True)}
        for thing in things.values():
            if thing.semantic_class in GROUND_CLASSES:
                own = corners[thing.semantic_class == "road"]
                own += map(self._upward, thing.parts)
        triangles = {k: np.concatenate(found) for k, found in corners.items()}
        self._roads = triangles[True]
        self._sides = {k: UpperSides(found) for k, found in triangles.items()}

    def _upward(self, part: LoadedPart) -> np.ndarray:
        corners = turned_up(triangle_corners(part))
        middles = corners[:, :, :2].mean(axis=1)
        return corners[
            (unit_normals(corners)[:, 2] > _LEAST_UP)
            & shapely.contains_xy(self.near, middles)
        ]

    @cached_property
    def carriageway(self) -> BaseGeometry:
        """The area of class `road`, seen from above [m]."""
        joined = shapely.unary_union(from_above(self._roads), grid_size=0.001)
        return joined.buffer(_SEAM).buffer(-_SEAM)

    def heights(
        self, xy: np.ndarray, *, of_road: bool | None = None
    ) -> np.ndarray:
        """Returns the heights (N,) of the ground [m]; NaN where there is none.

        Args:
            xy: (N, 2) places in W [m].
            of_road: True for carriageways only, False for all other ground, and
                None for the higher of both.
        """
        kinds = (False, True) if of_road is None else (of_road,)
        found = np.max([self._sides[k].heights(xy) for k in kinds], axis=0)
        return np.where(np.isfinite(found), found, np.nan)

    def lowest(self, area: BaseGeometry, default: float) -> float:
        """Returns the least height of the ground at the corners of an area [m].

        The result is `default` if there is no ground at any corner.
        """
        z = self.heights(shapely.get_coordinates(area))
        z = z[np.isfinite(z)]
        return float(z.min()) if len(z) else default

    def rise(self, old: np.ndarray, new: np.ndarray) -> float:
        """Returns how much higher the ground is at `new` than at `old` [m].

        The result is 0 if there is no ground at one of these places.

        Args:
            old, new: (2,) places in W [m].
        """
        z = self.heights(np.array([old, new]))
        return float(z[1] - z[0]) if np.isfinite(z).all() else 0.0

    def kerbs(self, spacing: float) -> Iterator[Kerb]:
        """Yields the edges of the carriageway within the area `near`.

        The points of an edge are at most `spacing` apart [m].
        """
        inner = self.near.buffer(-1.0)  # The edge of `near` is not a kerb.
        shapely.prepare(inner)
        for polygon in polygons_of(self.carriageway):
            turned = orient(polygon)
            for ring in (turned.exterior, *turned.interiors):
                if shapely.Polygon(ring).area < _LEAST_AREA:
                    continue
                xy = shapely.get_coordinates(ring.segmentize(spacing))[:-1]
                yield from _runs(xy, shapely.contains_xy(inner, xy))


def _runs(xy: np.ndarray, inside: np.ndarray) -> Iterator[Kerb]:
    """Yields the stretches of a ring that are inside an area, as kerbs.

    The carriageway is on the left of the ring.
    """
    along = np.roll(xy, -1, axis=0) - np.roll(xy, 1, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    outwards = np.column_stack([along[:, 1], -along[:, 0]])
    if inside.all():
        order = np.append(np.arange(len(xy)), 0)
        yield Kerb(xy[order], outwards[order])
        return
    first = int(np.argmin(inside))
    order = np.roll(np.arange(len(xy)), -first)
    cuts = np.flatnonzero(np.diff(inside[order])) + 1
    # The first run is outside the area.
    for run in np.split(order, cuts)[1::2]:
        if len(run) >= 2:
            yield Kerb(xy[run], outwards[run])


def triangle_corners(part: LoadedPart) -> np.ndarray:
    """Returns the corners (M, 3, 3) of a part's triangles in W [m].

    A part with a curved surface has no triangles.
    """
    surface = part.geometry.surface
    if not isinstance(surface, surfaces.TriangleSurface):
        return np.zeros((0, 3, 3))
    return part.p_WPs[surface.triangles]


def draws(seed: int, cause: str, name: str) -> np.random.Generator:
    """Returns the random generator for one kind of change of one structure.

    The random numbers do not depend on other structures or other kinds of
    change.

    Args:
        seed: seed of the changes.
        cause: field of the section `transient` that asks for the change.
        name: name of the structure.
    """
    digest = hashlib.sha256(f"{seed}/{cause}/{name}".encode()).digest()
    return np.random.default_rng(int.from_bytes(digest[:16], "little"))
