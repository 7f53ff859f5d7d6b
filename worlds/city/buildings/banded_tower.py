"""The banded office tower."""

from collections.abc import Callable, Sequence

import numpy as np

from worlds.city.facades import (
    Band,
    Building,
    Facade,
    Relief,
    WallFrame,
    bays,
    canopies,
    facade_mesh,
    piers,
    solids,
    tiers,
    top_band,
)
from worlds.shapes import MeshShape, merge_meshes, outlines

# Free strip between the widest storeys and the edge of the site [m].
_MARGIN_M = 0.8
# Least length of the chords of which round corners consist [m].
_LEAST_CHORD_M = 2.8
# Height of an open garden floor [m].
_GARDEN_M = 3.4
# Greatest number of parts of which all stacks together consist.
_MOST_GROUPS = 12
# Height of the walls above the topmost storey [m].
_CROWN_M = 1.2
# Depth of the glass of the lobby [m].
_LOBBY_RECESS_M = 0.3
# Walls of the lobby shorter than this are chords of a round corner [m].
_CHORD_WALL_M = 4.5
# Distance between the columns of a garden floor [m].
_COLUMN_PITCH_M = 7.0


class BandedTower(Building):
    """The banded office tower: round corners, ribbon windows, garden floors."""

    def draw(self) -> None:
        site = self.site
        side = min(site.width, site.depth)
        self.radius = round(self.uniform(0.18, 0.42) * side, 2)
        # Which corners of the rectangle are round.
        self.corners = self.pick(((0, 1, 2, 3), (0, 2), (0, 1), (1,)))
        # Number of stacks of storeys, with an open floor between two.
        self.stacks = min(max(round(self.height / self.uniform(24, 40)), 1), 3)
        # Distance by which every other stack is smaller.
        self.taper = self.uniform(0.03, 0.08) * side
        self.lobby = self.uniform(5.0, 7.5, digits=2)
        self.storey = self.uniform(3.5, 4.0)
        # Height of the bands between the glass.
        self.spandrel = self.uniform(0.9, 1.3, digits=2)
        # How far a sunshade above the glass sticks out.
        self.ledge = self.pick((0.15, 0.5, 0.8))
        self.recess = self.uniform(0.2, 0.4, digits=2)
        # Distance between upright fins; 0 for none.
        self.fins = self.pick((0.0, 5.0, 7.0))
        self.roof_items = self.draw_roof_items(
            "lift_house cooling_tower air_handler ac_unit mast", low=2, high=6
        )

    def build(self) -> None:
        outer = self._outline()
        inner = outlines.inset(
            outer, min(self.taper, 0.5 * outlines.inset_limit(outer))
        )
        z = _add_lobby(self, inner)
        gardens = _GARDEN_M * (self.stacks - 1)
        room = (self.height - _CROWN_M - z - gardens) / self.stacks
        counts = tiers.storey_groups(
            room, storey=self.storey, most=_MOST_GROUPS // self.stacks
        )
        plans = {"wide": outer, "slim": inner}
        shapes = [
            (plan, _stack_adder(self, plan, counts, name))
            for name, plan in list(plans.items())[: self.stacks]
        ]
        for k in range(self.stacks):
            plan, place = shapes[k % 2]
            z = place(z, k)
            if k + 1 < self.stacks:
                z = _add_garden_floor(self, plan, inner, z, k)
        self._add_roof(plan, z)

    def _outline(self) -> np.ndarray:
        """Returns the outline (N, 2) of the widest storeys [m]."""
        x0, y0, x1, y1 = self.site.bounds
        base = outlines.rectangle(
            x0 + _MARGIN_M, y0 + _MARGIN_M, x1 - _MARGIN_M, y1 - _MARGIN_M
        )
        radii = dict.fromkeys(self.corners, self.radius)
        chord = max(_LEAST_CHORD_M, 0.5 * self.radius)
        return np.round(outlines.rounded(base, radii, step=chord), 3)

    def _add_roof(self, plan: np.ndarray, z: float) -> None:
        """Adds the topmost walls over an outline, and the roof behind them.

        `plan` contains the corners (N, 2) of the walls, and `z` is the height
        of their foot [m].
        """
        rim = round(self.height - z, 3)
        crown = Facade(
            rim,
            bands=(Band(z0=rim - 0.4, z1=rim, depth=-min(0.3, self.ledge)),),
        )
        parapet = min(0.9, rim - 0.1)
        tiers.add_crown(
            self, plan, crown, z0=z, parapet=parapet, items=self.roof_items
        )


def _add_lobby(tower: BandedTower, plan: np.ndarray) -> float:
    """Adds the glazed ground floor with its entrance; returns its top [m]."""
    height = tower.lobby
    pane = bays.ribbon(
        sill=0.2, head=height - 0.9, depth=_LOBBY_RECESS_M, post=0.16
    )
    # Long walls may meet at right angles, where their recesses must not touch.
    short, long = (bays.rhythm(3.2, [pane], margin=m) for m in (0.1, 0.45))

    def glazing(edge: int, length: float) -> Sequence[Relief]:
        return (short if length < _CHORD_WALL_M else long)(edge, length)

    door = bays.entrance(width=3.4, height=3.0, depth=1.2, surround=0.1)
    layout = bays.with_door(glazing, door, width=5.2)
    facade = Facade(
        height,
        bands=(top_band(height, height=0.6, reach=0.15),),
        layout=layout,
        glass=(_LOBBY_RECESS_M,),
    )
    half = min(3.5, max(1.2, WallFrame(plan, 0).length / 2 - 0.5))
    lid = canopies.front_canopy(plan, half=half, reach=2.0, z=3.5)
    return tiers.add_ground(tower, plan, facade, extras=[lid])


def _add_garden_floor(
    tower: BandedTower,
    plan: np.ndarray,
    inner: np.ndarray,
    z0: float,
    number: int,
) -> float:
    """Adds an open garden floor; returns its top [m].

    It has columns around a smaller glazed core. Its slab has the outline
    `plan`; `inner` is the smallest outline of the storeys above.
    """
    height = _GARDEN_M
    limit = outlines.inset_limit(inner)
    core = outlines.inset(inner, min(2.8, 0.6 * limit))
    walls = tiers.lidded_walls(
        core, Facade(height, bands=(Band(z0=0.4, z1=2.9, depth=0.15),)), z0
    )
    ring = outlines.inset(inner, min(0.8, 0.2 * limit))
    columns = []
    for edge in range(len(ring)):
        wall = WallFrame(ring, edge)
        count = max(1, round(wall.length / _COLUMN_PITCH_M))
        for k in range(count):
            spot = wall.point((k + 0.5) * wall.length / count, 0.0)
            shaft = outlines.regular_polygon(radius=0.3, count=8, center=spot)
            columns.append(solids.skirt(shaft, shaft, z0=z0, z1=z0 + height))
    floor = solids.roof_pan(plan, z_floor=z0, z_top=z0 + 1.0, thickness=0.2)
    rim = solids.skirt(plan, plan, z0=z0, z1=z0 + 1.0)
    tower.add(f"garden_{number}", walls, floor, rim, *columns)
    return round(z0 + height, 3)


def _stack_adder(
    tower: BandedTower, plan: np.ndarray, counts: tiers.StoreyGroups, name: str
) -> Callable[[float, int], float]:
    """Returns a function that adds a stack of storeys with one outline.

    The function takes the height of the stack's bottom and the number of the
    stack, and returns the height of the stack's top [m].
    """
    groups, per_group, storey = counts
    step = per_group * storey
    bands = (
        Band(z0=0.0, z1=tower.spandrel, depth=0.0),
        Band(z0=tower.spandrel, z1=storey, depth=tower.recess),
        top_band(storey, height=0.2, reach=tower.ledge),
    )
    facade = Facade(storey, bands=bands, glass=(tower.recess,)).stacked(
        per_group
    )
    pieces = [facade_mesh(plan, facade)]
    if tower.fins > 0:
        # The piers cross the sunshades and join the piers above and below.
        pieces.append(
            piers.wall_piers(
                plan,
                pitch=tower.fins,
                width=0.18,
                reach=tower.ledge + 0.1,
                z0=0.0,
                z1=step,
                depth=tower.recess + 0.05,
                margin=0.8,
            )
        )
    height = round(groups * step, 3)
    pane = outlines.inset(plan, tower.recess - tiers.PANE_OVERLAP)
    meshes = {
        name: merge_meshes(*pieces),
        f"{name}_glass": solids.skirt(pane, pane, z0=0.0, z1=height),
        f"{name}_soffit": solids.flat(plan, 0.0, up=False),
    }
    walls, glass, soffit = (
        MeshShape(tower.define(part, mesh)) for part, mesh in meshes.items()
    )

    def place(z0: float, number: int) -> float:
        """Adds the stack at the height `z0`; returns the top's height [m]."""
        at = (0.0, 0.0, z0)
        part = f"stack_{number}"
        tower.place(f"{part}_glass", glass, at, finish=tower.glass)
        tower.place(f"{part}_soffit", soffit, at)
        for k in range(groups):
            z = z0 + k * step
            tower.place(f"{part}_storey_{k:02d}", walls, (0.0, 0.0, z))
        return round(z0 + height, 3)

    return place
