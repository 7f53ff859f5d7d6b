"""An archetype, a kind of building, as `archetypes.yaml` describes it."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, BeforeValidator

from cns_drake.city.geometry import Finish

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
