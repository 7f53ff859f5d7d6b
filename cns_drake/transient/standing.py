"""The structures of a loaded world, and their footprints."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from pydrake.geometry import Role
from pydrake.math import RigidTransform
import shapely
from shapely.geometry.base import BaseGeometry

from cns_drake.scene.perception_geometry import (
    GeometryReader,
    PerceptionGeometry,
    structure_name,
)
from cns_drake.scene.surfaces import (
    CapsuleSurface,
    CylinderSurface,
    EllipsoidSurface,
    HalfSpaceSurface,
    TriangleSurface,
)
from cns_drake.scene.world import World

# Classes of the ground below other things.
GROUND_CLASSES = frozenset(
    {"road", "parking", "sidewalk", "other-ground", "terrain"}
)
# Cars and walkers can pass below parts higher than this above a thing's foot
# [m].
_HEADROOM = 2.2
# Corners of the box about a round shape of size one.
_BOX = np.array(
    [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float
)


@dataclass(frozen=True)
class StandingPart:
    """One geometry of a structure.

    Attributes:
        geometry: visible to a LiDAR.
        X_WG: its pose in the world.
    """

    geometry: PerceptionGeometry
    X_WG: RigidTransform

    @property
    def name(self) -> str:
        """The part's name within its structure."""
        return self.geometry.name.rpartition("::")[2].rpartition("/")[2]

    @cached_property
    def p_WPs(self) -> np.ndarray:
        """(N, 3) points in the world whose hull holds the part [m]."""
        surface = self.geometry.surface
        if isinstance(surface, TriangleSurface):
            p_GPs = surface.p_GVset
        elif isinstance(surface, EllipsoidSurface):
            p_GPs = _BOX * surface.semi_axes
        elif isinstance(surface, CylinderSurface):
            r = surface.radius
            p_GPs = _BOX * (r, r, surface.length / 2)
        elif isinstance(surface, CapsuleSurface):
            r = surface.radius
            p_GPs = _BOX * (r, r, surface.length / 2 + r)
        else:
            assert isinstance(surface, HalfSpaceSurface)
            p_GPs = np.zeros((0, 3))
        R, p = self.X_WG.rotation().matrix(), self.X_WG.translation()
        return p_GPs @ R.T + p


@dataclass(frozen=True)
class Standing:
    """A structure in the world.

    Attributes:
        name: of the structure.
        semantic_class: a key of `CLASS_IDS`.
        parts: its geometries.
    """

    name: str
    semantic_class: str
    parts: tuple[StandingPart, ...]

    @cached_property
    def p_WPs(self) -> np.ndarray:
        """(N, 3) points in the world whose hull holds the structure [m]."""
        return np.concatenate([part.p_WPs for part in self.parts])

    @cached_property
    def bottom(self) -> float:
        """Height of its lowest point [m]."""
        return float(self.p_WPs[:, 2].min(initial=np.inf))

    @cached_property
    def outline(self) -> BaseGeometry:
        """The convex hull of all of it, seen from above [m]."""
        return shapely.MultiPoint(self.p_WPs[:, :2]).convex_hull

    @cached_property
    def footprint(self) -> BaseGeometry:
        """The convex hull of the parts near its foot, seen from above [m]."""
        p_WPs = self.p_WPs
        low = p_WPs[p_WPs[:, 2] <= self.bottom + _HEADROOM]
        return shapely.MultiPoint(low[:, :2]).convex_hull


def read_standing(
    world: World, wanted: Callable[[str], bool] = lambda name: True
) -> dict[str, Standing]:
    """Reads the static structures of a world.

    Args:
        world: not yet a part of a diagram.
        wanted: name -> whether to read the structure.

    Returns:
        Structure name -> structure, in alphabetical order.

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
    inspector = world.scene_graph.model_inspector()
    hidden = {
        geometry
        for geometry in inspector.GetAllGeometryIds(Role.kPerception)
        if inspector.GetFrameId(geometry) not in X_WFs
        or not wanted(structure_name(inspector.GetName(geometry)))
    }
    found = defaultdict(list)
    for geometry in GeometryReader(Role.kPerception).read(inspector, hidden):
        X_WG = X_WFs[geometry.frame_id] @ geometry.X_FG
        found[geometry.structure].append(StandingPart(geometry, X_WG))
    return {
        name: Standing(
            name, world.structures[name].semantic_class, tuple(found[name])
        )
        for name in sorted(found)
    }


class Obstacles:
    """Obstacles of new things, seen from above."""

    def __init__(self, areas: Iterable[tuple[str, BaseGeometry]]):
        """Collects them.

        Args:
            areas: names, and areas in the world [m].
        """
        pairs = [(n, area) for n, area in areas if not area.is_empty]
        self._names = np.array([name for name, _ in pairs], object)
        self._areas = [area for _, area in pairs]
        self._tree = shapely.STRtree(self._areas)

    @classmethod
    def of_things(
        cls, kept_free: BaseGeometry, things: Iterable[Standing]
    ) -> Obstacles:
        """Collects footprints, and an area without a name.

        Args:
            kept_free: area that stays free, seen from above [m].
            things: structures whose footprints are obstacles.
        """
        feet = ((thing.name, thing.footprint) for thing in things)
        return cls([("", kept_free), *feet])

    def is_free(
        self, area: BaseGeometry, ignored: Collection[str] = ()
    ) -> bool:
        """Returns whether an area meets no obstacle.

        Args:
            area: in the world [m].
            ignored: names of obstacles that do not count.
        """
        return not self._met(area, ignored)

    def distance(
        self, area: BaseGeometry, within: BaseGeometry, ignored: Collection[str]
    ) -> float:
        """Returns the distance of the nearest obstacle from an area [m].

        Args:
            area: in the world [m].
            within: area to search.
            ignored: names of obstacles that do not count.

        Returns:
            The distance to the part of obstacles within; inf for none.
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
