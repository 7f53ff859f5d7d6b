"""The assembly of one building from its parts."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike
from shapely.geometry.base import BaseGeometry

from worlds.shapes.dice import Dice
from worlds.shapes.mesh import Mesh, merge_meshes
from worlds.shapes.models import Finish, MeshShape, Model, Part, Shape
from worlds.shapes.object_models import object_mesh
from worlds.shapes.site import Site

_GLASS = Finish((0.20, 0.26, 0.31), "glass")


@dataclass
class Assembly(Dice):
    """Collects the parts of one building, and makes its random choices.

    `add` makes one part from the given meshes. `add_to` collects meshes by
    material, and each material that `declare_materials` names becomes one part:
    a building of many small pieces thus has few visuals.

    Attributes:
        site: the ground of the building.
        rng: the random generator.
        walls: finish of all parts without a finish of their own; None for the
            colour and the material of the semantic class.
        glass: finish of panes.
        parts: the parts so far.
        meshes: name -> mesh of all meshes that the parts use.
    """

    site: Site
    rng: np.random.Generator
    walls: Finish | None = None
    glass: Finish = _GLASS
    parts: list[Part] = field(default_factory=list)
    meshes: dict[str, Mesh] = field(default_factory=dict)
    _colours: dict[str, Finish] = field(default_factory=dict)
    _pieces: dict[str, list[Mesh]] = field(default_factory=dict)

    def draw_roof_items(self, kinds: str, low: int, high: int) -> list[str]:
        """Returns the kinds of the objects on the roof, in a random number.

        The text `kinds` lists kinds, separated by spaces, with the most
        important first. The result contains the first kinds of this list: at
        least `low`, and fewer than `high`.
        """
        return kinds.split()[: self.whole(low, high)]

    def add(
        self,
        part: str,
        *meshes: Mesh,
        z: float = 0.0,
        finish: Finish | None = None,
    ) -> None:
        """Merges meshes into one part, raised by `z` [m], and adds it.

        Meshes without any faces (such as pilasters on walls too short for them)
        are left out.
        """
        mesh = merge_meshes(*meshes)
        if mesh.faces:
            shape = MeshShape(self.define(part, mesh))
            self.place(part, shape, (0.0, 0.0, z), finish=finish)

    def add_glass(self, part: str, *meshes: Mesh, z: float = 0.0) -> None:
        """Merges panes into one part, raised by `z` [m], and adds it."""
        self.add(part, *meshes, z=z, finish=self.glass)

    def declare_materials(self, **colours: Finish) -> None:
        """Declares the building's materials: name=colour, as keywords.

        Call it before `add_to`, which adds meshes to the part of a declared
        material.
        """
        self._colours = colours
        self._pieces = {material: [] for material in colours}

    def add_to(self, material: str, *meshes: Mesh) -> None:
        """Adds meshes in the building's frame to the part of a material.

        Raises:
            ValueError: the material was not declared with `declare_materials`.
        """
        if material not in self._pieces:
            raise ValueError(f"unknown material {material}")
        self._pieces[material] += meshes

    def turn(self, translation: ArrayLike, yaw: float) -> None:
        """Turns the meshes of all materials about z, and then moves them.

        `yaw` is the angle [rad] and `translation` (3,) the shift [m]. Parts
        that are already complete, such as parts from `add`, stay where they
        are.
        """
        for material, pieces in self._pieces.items():
            mesh = merge_meshes(*pieces).moved(translation, yaw)
            self._pieces[material] = [mesh]

    def to_model(self, footprint: BaseGeometry) -> Model:
        """Returns the whole building as a model.

        Call this method once, at the end. Each material becomes one part.

        `footprint` is the ground of the building in its frame S [m].
        """
        for material, pieces in self._pieces.items():
            self.add(material, *pieces, finish=self._colours[material])
        return Model(tuple(self.parts), self.meshes, footprint)

    def define(self, key: str, mesh: Mesh) -> str:
        """Adds a mesh to this building, and returns the mesh's full name.

        The full name consists of the name of the site, an underscore and `key`.

        Raises:
            ValueError: the building already has a mesh of this name.
        """
        name = f"{self.site.name}_{key}"
        if name in self.meshes:
            raise ValueError(f"mesh {name} is defined twice")
        self.meshes[name] = mesh
        return name

    def stack(
        self,
        part: str,
        mesh: Mesh,
        z0: float,
        step: float,
        count: int,
        finish: Finish | None = None,
    ) -> None:
        """Adds a mesh, and places several copies above one another.

        Args:
            part: beginning of the copies' names; the copies are named
                `{part}_00`, `{part}_01` and so on.
            mesh: the mesh in the building's frame [m].
            z0: height of the lowest copy [m].
            step: vertical distance from one copy to the next [m].
            count: number of copies.
            finish: colour and material; by default the finish of the walls.
        """
        shape = MeshShape(self.define(part, mesh))
        for k in range(count):
            z = z0 + k * step
            name = f"{part}_{k:02d}"
            at = (0.0, 0.0, z)
            self.place(name, shape, at, finish=finish)

    def shared(
        self, mesh: str, scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    ) -> MeshShape:
        """Returns a mesh of the folder `object_meshes` as a shape for `place`.

        `mesh` is the name of the mesh's file without `.obj`. `scale` contains
        the scale factors along x, y and z.
        """
        self.meshes[mesh] = object_mesh(mesh)
        return MeshShape(mesh, scale)

    def place(
        self,
        part: str,
        shape: Shape,
        xyz: Iterable[float],
        yaw: float = 0.0,
        finish: Finish | None = None,
    ) -> None:
        """Adds one part to the building: a shape at a place.

        Args:
            part: name of the part.
            shape: the shape.
            xyz: position of the shape in the building's frame [m].
            yaw: heading of the shape [rad].
            finish: colour and material; by default the finish of the walls.
        """
        x, y, z = (round(float(v), 3) for v in xyz)
        rpy = (0.0, 0.0, round(float(yaw), 5))
        rgb, material = finish or self.walls or (None, None)
        self.parts.append(Part(part, shape, (x, y, z), rpy, rgb, material))
