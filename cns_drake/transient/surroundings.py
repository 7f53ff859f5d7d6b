"""What surrounds a drive: structures, ground, and what is chosen to change."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
import hashlib
from typing import Protocol, TypeVar

import numpy as np

from cns_drake.scene import SceneStructure
from cns_drake.transient.scene_editing import SceneEditing
from worlds.shapes import Area, GroundSurface, Obstacles, Way

# Fronts and kerbs farther from the drive than this get no new objects [m].
FARTHEST = 30.0
# Snow farther from the drive than this would hardly be visible to a LiDAR [m].
_NEAR = 120.0


class _Named(Protocol):
    @property
    def name(self) -> str: ...


Named = TypeVar("Named", bound=_Named)


@dataclass
class Surroundings:
    """The surroundings of a drive, to which changes are made.

    Attributes:
        editing: makes the changes in the world.
        structures: name -> geometry, for all structures of the world before
            the changes.
        drive: path of the vehicle, seen from above [m].
        kept_free: area that must stay free of new objects, seen from above [m].
        seed: seed of all random choices.
        bare: the surroundings before new objects were put up; None if there are
            none.
    """

    editing: SceneEditing
    structures: Mapping[str, SceneStructure]
    drive: Way
    kept_free: Area
    seed: int
    bare: Surroundings | None = None

    @property
    def bare_ground(self) -> GroundSurface:
        """The ground near the drive, without new objects."""
        return (self.bare or self).ground

    @cached_property
    def ground(self) -> GroundSurface:
        """The ground near the drive."""
        return GroundSurface(self.structures, self.drive.area(_NEAR))

    def of_classes(self, classes: Collection[str]) -> list[SceneStructure]:
        """Returns the structures of some classes."""
        return [
            one
            for one in self.structures.values()
            if one.semantic_class in classes
        ]

    def obstacles_of(self, classes: Collection[str]) -> Obstacles:
        """Returns the areas where new objects must not stand.

        The result contains the area `kept_free` and the footprints of all
        structures of some classes.
        """
        return self._obstacles(self.of_classes(classes))

    def obstacles_except(self, ignored: Collection[str]) -> Obstacles:
        """Returns the areas where new objects must not stand.

        The result contains the area `kept_free` and the footprints of all
        structures except structures of the classes `ignored`.
        """
        return self._obstacles(
            one
            for one in self.structures.values()
            if one.semantic_class not in ignored
        )

    def _obstacles(self, standing: Iterable[SceneStructure]) -> Obstacles:
        feet = [(one.name, one.footprint) for one in standing]
        return Obstacles([("", self.kept_free), *feet])

    def chosen(
        self, cause: str, objects: Iterable[Named], share: float
    ) -> Iterator[tuple[Named, np.random.Generator]]:
        """Yields a random share of objects, each with its own random generator.

        The choice depends on the seed, the cause and the names of the objects.

        Args:
            cause: field of the scenario's section `transient` that asks for the
                change.
            objects: objects with a `name`, such as structures.
            share: share of the objects, from 0 to 1.
        """
        for one in objects:
            rng = change_rng(self.seed, cause, one.name)
            if rng.uniform() < share:
                yield one, rng


def change_rng(seed: int, cause: str, name: str) -> np.random.Generator:
    """Returns the random generator for one kind of change to one object.

    The random numbers do not depend on other objects or other kinds of change.

    Args:
        seed: seed of the changes.
        cause: field of the section `transient` that asks for the change.
        name: name of the object, such as a structure.
    """
    digest = hashlib.sha256(f"{seed}/{cause}/{name}".encode()).digest()
    return np.random.default_rng(int.from_bytes(digest[:16], "little"))
