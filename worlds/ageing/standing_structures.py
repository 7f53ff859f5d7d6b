"""The structures that stand in an ageing city, and the record of its events."""

from collections.abc import Sequence
import math

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from worlds.ageing.events import PUT_UP, TAKEN_DOWN, Event
from worlds.ageing.old_world import OldWorld
from worlds.shapes import GROUND_CLASSES, Structure, StructureEntry, part_mesh


class StandingStructures:
    """The structures that stand at the end of a year.

    Attributes:
        year: the year; today is 0.
        by_name: name of each existing structure -> the structure, or None if it
            is the same as today.
        new: name -> structure as it was first put up, for all structures that
            are not the same as today, in the order in which they were built.
        events: all events since today.
    """

    def __init__(self, world: OldWorld) -> None:
        """Begins with the city of today."""
        self.year = 0
        self.by_name: dict[str, Structure | None] = dict.fromkeys(world.visuals)
        self.new: dict[str, Structure] = {}
        self.events: list[Event] = []
        self._world = world
        geometry = world.geometry
        # Entries of all structures that stand or stood. New ones have no
        # instance id yet.
        self._entries = {name: one.entry for name, one in geometry.items()}
        self._footprints = {n: one.footprint for n, one in geometry.items()}
        self._tree = shapely.STRtree(list(self._footprints.values()))
        self._names = list(self._footprints)
        # Footprints of structures that were added.
        self._added: dict[str, BaseGeometry] = {}

    def record(
        self, event: str, structure: str, successor: str = "", detail: str = ""
    ) -> None:
        """Records an event of this year; the arguments are those of `Event`."""
        self.events.append(
            Event(self.year, event, structure, successor, detail)
        )

    def put(
        self,
        one: Structure,
        footprint: BaseGeometry | None = None,
        *,
        because: str = "",
    ) -> None:
        """Adds a structure.

        Args:
            one: the structure.
            footprint: area in W [m] that the structure takes; by default its
                own footprint.
            because: cause of the structure, which gets a record `PUT_UP`; empty
                if another record names the structure.
        """
        self.by_name[one.name] = one
        # The frame and the scaffold of a building site are put up every year
        # anew. Their row of the structure table stays that of the first year.
        self.new.setdefault(one.name, one)
        self._entries[one.name] = one.entry()
        self._added[one.name] = (
            one.footprint_W if footprint is None else footprint
        )
        if because:
            self.record(PUT_UP, one.name, detail=because)

    def remove(self, name: str, *, because: str = "") -> None:
        """Removes a structure, if it stands.

        `because` is the cause, which gets a record `TAKEN_DOWN`; empty if
        another record names the structure.
        """
        is_there = name in self.by_name
        self.by_name.pop(name, None)
        self._added.pop(name, None)
        if because and is_there:
            self.record(TAKEN_DOWN, name, detail=because)

    def near(
        self, area: BaseGeometry, ignored: Sequence[str] = ()
    ) -> list[str]:
        """Returns the names of structures, except ground, that touch an area.

        The area is in W. Structures with the names `ignored` are left out.
        """
        rows = sorted(self._tree.query(area, predicate="intersects"))
        found = [
            name
            for name in map(self._names.__getitem__, rows)
            if name in self.by_name and name not in self._added
        ]
        found += [
            name
            for name, footprint in self._added.items()
            if footprint.intersects(area)
        ]
        return [
            name
            for name in found
            if name not in ignored
            and self.entry(name).semantic_class not in GROUND_CLASSES
        ]

    def entry(self, name: str) -> StructureEntry:
        """Returns the table entry of a structure that stands or stood."""
        return self._entries[name]

    def footprint(self, name: str) -> BaseGeometry:
        """Returns the area in W [m] that a structure takes."""
        return self._added.get(name, self._footprints.get(name, Polygon()))

    def structure(self, name: str) -> Structure:
        """Returns a structure as it is now; the structure must stand.

        A structure that is unchanged since today comes from
        `OldWorld.structure`.

        Raises:
            InputError: `OldWorld.structure` does not support the structure.
        """
        return self.by_name.get(name) or self._world.structure(name)

    def triangles(self, name: str) -> np.ndarray:
        """Returns the triangles (M, 3, 3) of a structure in W [m]."""
        if name in self._world.geometry and self.by_name[name] is None:
            return self._world.triangles(name)
        return structure_triangles(self.structure(name))


def structure_triangles(structure: Structure) -> np.ndarray:
    """Returns the triangles (M, 3, 3) of a structure in W [m]."""
    found = [np.zeros((0, 3, 3))]
    for part in structure.model.parts:
        mesh = part_mesh(part, structure.model.meshes)
        found.append(mesh.vertices[mesh.triangles()])
    p = np.concatenate(found)
    c, s = math.cos(structure.yaw), math.sin(structure.yaw)
    x, y, z = np.moveaxis(p, -1, 0)
    return np.stack([c * x - s * y, s * x + c * y, z], -1) + structure.xyz
