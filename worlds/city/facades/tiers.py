"""The tiers of a building: ground floor, storeys, and top walls with a roof."""

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from worlds.city.facades import bays, piers, solids
from worlds.city.facades.bays import Bay
from worlds.city.facades.reliefs import Band
from worlds.city.facades.walls import Facade, facade_mesh, glass_mesh
from worlds.shapes import Assembly, Mesh, equip_roof, merge_meshes, outlines

# A pane reaches this far into the reveals in front of it, so that no ray passes
# between them [m].
PANE_OVERLAP = 0.004


class StoreyGroups(NamedTuple):
    """Equal storeys in groups; each group becomes one part.

    Attributes:
        groups: number of groups.
        per_group: number of storeys in a group.
        storey: height of a storey [m].
    """

    groups: int
    per_group: int
    storey: float

    @property
    def num_storeys(self) -> int:
        """Number of storeys in all groups together."""
        return self.groups * self.per_group


def storey_groups(height: float, storey: float, most: int = 10) -> StoreyGroups:
    """Divides a height into equal storeys, and the storeys into groups.

    The height of a storey is rounded down to millimetres, so that stacked
    storeys leave no gap.

    Args:
        height: height of all storeys together [m].
        storey: approximate height of a storey [m].
        most: greatest number of groups.
    """
    count = max(1, round(height / storey))
    per_group = -(-count // most)
    groups = max(1, round(count / per_group))
    exact = height / (groups * per_group)
    return StoreyGroups(groups, per_group, math.floor(1000.0 * exact) / 1000.0)


def add_ground(
    out: Assembly,
    outline: ArrayLike,
    facade: Facade,
    extras: Sequence[Mesh] = (),
    part: str = "ground",
) -> float:
    """Adds ground floor and foundation; returns the floor's height [m].

    Args:
        out: the building under assembly, which gets the parts.
        outline: (N, 2) corners of the walls in the building's frame,
            counter-clockwise [m].
        facade: the walls and their openings.
        extras: further meshes of the floor, in the building's frame.
        part: name of the part.
    """
    base = solids.foundation(outline)
    walls = facade_mesh(outline, facade)
    out.add(part, base, walls, *extras)
    _add_glass(out, outline, facade, 0.0, part)
    return facade.height


def add_storeys(
    out: Assembly,
    outline: ArrayLike,
    facade: Facade,
    z0: float,
    groups: int,
    per_group: int,
    extras: Sequence[Mesh] = (),
    part: str = "storey",
) -> float:
    """Adds `groups` times `per_group` storeys; returns the top's height [m].

    If all glass in `facade` has the same depth, a single pane behind the walls
    closes all windows. In this case, no other relief may be deeper than the
    glass.

    Args:
        out: the building under assembly, which gets the parts.
        outline: (N, 2) corners of the walls in the building's frame,
            counter-clockwise [m].
        facade: the walls of one storey.
        z0: height of the lowest floor [m].
        groups: number of parts, one above another.
        per_group: number of storeys in each part.
        extras: further meshes of each storey, with z measured from the storey's
            floor.
        part: beginning of the names of the parts.
    """
    pieces = [facade_mesh(outline, facade.stacked(per_group))]
    for k in range(per_group):
        pieces += [e.moved((0.0, 0.0, k * facade.height)) for e in extras]
    step = per_group * facade.height
    out.stack(part, merge_meshes(*pieces), z0, step, groups)
    top = round(z0 + groups * step, 3)
    if len(facade.glass) == 1:
        glass = _pane(outline, facade, z0, top)
        out.add_glass(f"{part}_glass", glass)
    elif facade.glass:
        glass = glass_mesh(outline, facade.stacked(per_group))
        out.stack(f"{part}_glass", glass, z0, step, groups, out.glass)
    return top


def _pane(outline: ArrayLike, facade: Facade, z0: float, z1: float) -> Mesh:
    """Returns one pane behind all walls except plain ones."""
    edges = range(len(np.asarray(outline)))
    depth = facade.glass[0] - PANE_OVERLAP
    plan = outlines.inset(
        outline, [0.0 if k in facade.plain else depth for k in edges]
    )
    pane = solids.skirt(plan, plan, z0, z1)
    faces = tuple(pane.faces[k] for k in edges if k not in facade.plain)
    return Mesh(pane.vertices, faces)


@dataclass(frozen=True)
class Grooves:
    """Windows between upright piers; all lengths are in metres.

    Attributes:
        storey_height: wanted height of a storey.
        spandrel: height of the wall under the windows.
        recess: depth of the windows.
        pitch: distance between piers.
        pier: width of a pier; 0 for none.
        pier_reach: how far a pier protrudes.
        solid_corner: width of solid corners; 0 for glass around the corner.
        ledge: how far a lip on the spandrel protrudes; 0 for none.
    """

    storey_height: float
    spandrel: float
    recess: float
    pitch: float
    pier: float
    pier_reach: float
    solid_corner: float = 0.0
    ledge: float = 0.0


def add_grooved(
    out: Assembly,
    outline: ArrayLike,
    grooves: Grooves,
    z0: float,
    goal: float,
    part: str,
    rise: float = 0.0,
    most: int = 4,
    plain: frozenset[int] = frozenset(),
) -> float:
    """Adds storeys with windows between upright piers.

    Returns the height of the top [m], which is a few millimetres below `goal`.

    Args:
        out: the building under assembly, which gets the parts.
        outline: (N, 2) corners of the walls, counter-clockwise [m].
        grooves: sizes of the windows and piers.
        z0: height of the bottom [m].
        goal: wanted height of the top [m].
        part: beginning of the names of the parts.
        rise: how far the piers rise above the storeys [m].
        most: greatest number of parts, one above another.
        plain: numbers of the edges whose walls are plain.
    """
    groups, per_group, storey = storey_groups(
        goal - z0, grooves.storey_height, most
    )
    depth = grooves.recess
    bands = [
        Band(0.0, grooves.spandrel, 0.0),
        Band(grooves.spandrel, storey, depth),
    ]
    if grooves.ledge > 0:
        bands.append(Band(0.0, 0.2, -grooves.ledge))
    facade = Facade(storey, tuple(bands), glass=(depth,), plain=plain)
    top = add_storeys(out, outline, facade, z0, groups, per_group, part=part)
    pieces = []
    into = depth + 0.05
    if grooves.solid_corner > 0:
        size = (grooves.solid_corner, grooves.pier_reach, into)
        pieces.append(piers.corner_piers(outline, *size, z0, top + rise, plain))
    if grooves.pier > 0:
        margin = max(
            grooves.solid_corner + grooves.pitch - grooves.pier,
            into + grooves.pier,
        )
        along = piers.wall_piers(
            outline, grooves.pitch, grooves.pier, grooves.pier_reach, z0,
            top + rise, depth=into, margin=margin, skip=plain,
        )  # fmt: skip
        pieces.append(along)
    if pieces:
        out.add(f"{part}_piers", *pieces)
    return top


def lidded_walls(outline: ArrayLike, facade: Facade, z0: float) -> Mesh:
    """Returns one mesh of walls, their glass and a flat lid.

    Args:
        outline: (N, 2) corners of the walls, counter-clockwise [m].
        facade: height, bands and openings of the walls.
        z0: height of the foot of the walls [m].
    """
    pieces = [
        facade_mesh(outline, facade, z0),
        solids.flat(outline, z0 + facade.height),
    ]
    if facade.glass:
        pieces.append(glass_mesh(outline, facade, z0))
    return merge_meshes(*pieces)


def shaft_walls(
    height: float,
    entry: Bay,
    slit: Bay,
    room: float,
    rim: Band,
) -> Facade:
    """Returns the walls of a stair tower: one bay in front and one behind.

    Each bay is in the middle of its wall. The other walls are plain.

    Args:
        height: height of the walls [m].
        entry: the bay in front.
        slit: the bay behind.
        room: width of each bay [m].
        rim: the band around the top.
    """
    layouts = {0: bays.alone(entry, room), 2: bays.alone(slit, room)}
    return Facade(height, (rim,), bays.by_edge(layouts))


def add_crown(
    out: Assembly,
    outline: ArrayLike,
    facade: Facade,
    z0: float,
    parapet: float,
    part: str = "crown",
    thickness: float = 0.3,
    items: Sequence[str] = (),
) -> float:
    """Adds the top walls and the roof; returns the height of the roof [m].

    Args:
        out: the building under assembly, which gets the parts.
        outline: (N, 2) corners of the walls in the building's frame,
            counter-clockwise [m].
        facade: the topmost walls.
        z0: height of the foot of these walls [m].
        parapet: height of the walls above the roof [m].
        part: name of the building's part that gets these walls and the roof.
        thickness: thickness of the parapet [m].
        items: names of the equipment on the roof, the most important first (see
            `worlds.shapes.equip_roof`).
    """
    roof = round(facade.height - parapet, 3)
    mesh = merge_meshes(
        facade_mesh(outline, facade),
        solids.roof_pan(outline, roof, facade.height, thickness),
    )
    out.add(part, mesh, z=z0)
    _add_glass(out, outline, facade, z0, part)
    level = round(z0 + roof, 3)
    equip_roof(out, np.asarray(outline), level, items)
    return level


def _add_glass(
    out: Assembly, outline: ArrayLike, facade: Facade, z0: float, part: str
) -> None:
    if facade.glass:
        glass = glass_mesh(outline, facade)
        out.add_glass(f"{part}_glass", glass, z=z0)


def cornice(
    height: float, reach: float, *, thickness: float = 0.9, steps: int = 3
) -> tuple[Band, ...]:
    """Returns the bands of a cornice; higher bands protrude more.

    Args:
        height: height of the cornice's upper edge [m].
        reach: how far the topmost band protrudes [m].
        thickness: height of all bands together [m].
        steps: number of bands.
    """
    step = thickness / steps
    return tuple(
        Band(
            round(height - thickness + k * step, 3),
            round(height - thickness + (k + 1) * step, 3),
            -round(reach * (k + 1) / steps, 3),
        )
        for k in range(steps)
    )
