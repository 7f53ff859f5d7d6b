"""The base class of the buildings of all archetypes."""

from __future__ import annotations

import abc

import numpy as np

from cns_drake.city.facades.archetype import Archetype
from cns_drake.city.facades.assembly import Assembly
from cns_drake.city.facades.site import Site
from cns_drake.city.geometry import Finish


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
