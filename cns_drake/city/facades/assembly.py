"""The base class of buildings: site, random choices, collected parts."""

from __future__ import annotations

import abc
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel, BeforeValidator
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from cns_drake.city.dice import Dice
from cns_drake.city.facades import outlines
from cns_drake.city.geometry import (
    Finish,
    Mesh,
    MeshShape,
    Model,
    Part,
    Shape,
    merge_meshes,
    object_mesh,
)

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

    def blind_in(self, number: int, count: int) -> frozenset[int]:
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


GivenFinish = Annotated[Finish, BeforeValidator(Finish.given)]


class Archetype(BaseModel, frozen=True, extra="forbid"):
    """A kind of building: one entry of `buildings/archetypes.yaml`.

    Attributes:
        name: name of the archetype.
        heights: least and greatest height of a building [m].
        widths: least and greatest length of a side of the footprint [m].
        overhang: greatest distance by which eaves, balconies and canopies reach
            outside the footprint [m].
        any_outline: whether the footprint can be any simple polygon; otherwise
            the footprint must be a rectangle.
        party_walls: whether a building can stand wall to wall with a neighbour;
            otherwise a building keeps the distance `overhang` from the edges of
            its footprint towards neighbours.
        colours: name of a part -> colours, one of which each building gets at
            random; or the name of an earlier part with the same colour. Parts
            without an entry have the colour of the first part.
        choices: further lists of colours, by name, for single elements of a
            building.
        materials: names of the parts that are made of many pieces, such as
            `trim`; each is a key of `colours`, or `glass`.
    """

    name: str
    heights: tuple[float, float]
    widths: tuple[float, float]
    overhang: float = 1.5
    any_outline: bool = False
    party_walls: bool = False
    colours: dict[str, tuple[GivenFinish, ...] | str] = {}
    choices: dict[str, tuple[GivenFinish, ...]] = {}
    materials: tuple[str, ...] = ()


_GLASS = Finish((0.20, 0.26, 0.31), "glass")
# Plinths and pilasters may stand this far outside the footprint [m].
GROUND_OVERHANG_M = 0.35
# Above this height, the archetype's own overhang applies [m].
HEAD_ROOM_M = 2.3


@dataclass
class Assembly(Dice):
    """Collects the parts of one building, and makes its random choices.

    `add` makes one part from the given meshes. `add_to` collects meshes by
    material, and `paint` sets the materials' colours: each material becomes one
    part, so that a building of many small pieces has few visuals. Parts without
    their own finish have the finish of the `walls`.
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
        """Returns the kinds of a random number of objects on the roof.

        The result contains the first kinds in `kinds`, which are separated by
        spaces. The number of objects is at least `low` and less than `high`.
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

    def paint(self, **colours: Finish) -> None:
        """Declares the building's materials: name=colour, as keywords.

        Call it before `add_to`, which adds meshes to the part of a declared
        material.
        """
        self._colours = colours
        self._pieces = {material: [] for material in colours}

    def add_to(self, material: str, *meshes: Mesh) -> None:
        """Adds meshes in the building's frame to the part of a material.

        Raises:
            ValueError: the material was not declared with `paint`.
        """
        if material not in self._pieces:
            raise ValueError(f"unknown material {material}")
        self._pieces[material] += meshes

    def turn(self, translation: ArrayLike, yaw: float) -> None:
        """Turns the meshes of all materials about z, and then moves them.

        `yaw` is the angle [rad] and `translation` (3,) the shift [m]. Parts
        that are already complete, such as those from `add`, stay where they
        are.
        """
        for material, pieces in self._pieces.items():
            mesh = merge_meshes(*pieces).moved(translation, yaw)
            self._pieces[material] = [mesh]

    def finish(self, footprint: BaseGeometry) -> Model:
        """Returns the finished building, with one part for each material.

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
            finish: colour and material; by default those of the walls.
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
            finish: colour and material; by default those of the walls.
        """
        x, y, z = (round(float(v), 3) for v in xyz)
        rpy = (0.0, 0.0, round(float(yaw), 5))
        rgb, material = finish or self.walls or (None, None)
        self.parts.append(Part(part, shape, (x, y, z), rpy, rgb, material))


class Building(Assembly, abc.ABC):
    """The base class of buildings; each archetype has a subclass.

    The constructor calls `draw`, which samples the sizes and the style of the
    building, and then samples its colours. From these attributes, `build` makes
    the parts of the building. Only roof equipment and chimneys may rise above
    the building's `height` [m].
    """

    def __init__(
        self,
        kind: Archetype,
        site: Site,
        height: float,
        rng: np.random.Generator,
    ) -> None:
        """Samples sizes and style, and then the colours of the building."""
        super().__init__(site, rng)
        self.kind = kind
        self.height = height
        self.draw()
        self.colours: dict[str, Finish] = {}
        for part, finishes in kind.colours.items():
            if isinstance(finishes, str):
                self.colours[part] = self.colours[finishes]
            else:
                several = len(finishes) > 1
                drawn = self.pick(finishes) if several else finishes[0]
                self.colours[part] = drawn
        if self.walls is None and self.colours:
            self.walls = next(iter(self.colours.values()))
        self.glass = self.colours.setdefault("glass", self.glass)
        self.paint(**{part: self.colours[part] for part in kind.materials})

    @abc.abstractmethod
    def draw(self) -> None:
        """Sets the attributes that differ between buildings of one archetype.

        Lengths are in metres. Do not change the order in which random numbers
        are sampled, because this order determines the numbers that a building
        gets.
        """

    @abc.abstractmethod
    def build(self) -> None:
        """Adds all parts of the building; to be called once."""
