"""The base class of the buildings of all archetypes."""

from __future__ import annotations

import abc
from typing import Annotated

import numpy as np
from pydantic import BaseModel, BeforeValidator

from worlds.shapes import Assembly, Finish, Site

GivenFinish = Annotated[Finish, BeforeValidator(Finish.given)]


class Building(Assembly, abc.ABC):
    """The base class of buildings; each archetype has a subclass.

    The constructor first calls `draw`, which samples the sizes and the style of
    the building. Then the constructor samples the colours. From these
    attributes, `build` makes the parts of the building. Only roof equipment and
    chimneys may rise above the building's `height` [m].

    Attributes:
        kind: the archetype.
        height: height of the building without equipment on its roof [m].
        colours: part of the building -> its finish.
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
        self.colours = self._draw_colours()
        if self.walls is None and self.colours:
            self.walls = next(iter(self.colours.values()))
        self.glass = self.colours.setdefault("glass", self.glass)
        self.declare_materials(
            **{part: self.colours[part] for part in kind.materials}
        )

    def _draw_colours(self) -> dict[str, Finish]:
        """Returns a random finish of each part with an entry in the archetype.

        A part whose entry is the name of an earlier part has that part's
        finish.
        """
        colours: dict[str, Finish] = {}
        for part, finishes in self.kind.colours.items():
            if isinstance(finishes, str):
                colours[part] = colours[finishes]
            elif len(finishes) == 1:
                # No random number is used up for a choice of one: it would
                # change all later random numbers of the building.
                colours[part] = finishes[0]
            else:
                colours[part] = self.pick(finishes)
        return colours

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
            otherwise the walls that face a neighbour stand back from the edges
            of the footprint by `overhang`.
        colours: name of a part -> list of colours, from which each building
            gets one at random. The name of an earlier part instead of a list
            means the colour of that part. Parts without an entry have the
            colour of the first part.
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
