"""The white slab block with stacks of balconies."""

from __future__ import annotations

from collections.abc import Sequence
import itertools

import numpy as np

from worlds.city.facades import (
    Band,
    Building,
    Facade,
    Relief,
    WallFrame,
    around,
    balconies,
    bays,
    foot_band,
    tiers,
)
from worlds.shapes import Mesh, equip_roof, merge_meshes, outlines

# Room for balconies in front, and for canopies [m].
_FRONT_M = 1.7
# Depth of the ground in front of the sections and behind them [m].
_AROUND_M = 2.0
# Least depth of the other ground if sections stand back [m].
_STAGGER_DEPTH_M = 12.0
# Greatest number of sections.
_MOST_SECTIONS = 3
# Greatest number of windows in front.
_MOST_BAYS = 16
# Length of front for each section, which has a stair of its own [m].
_SECTION_M = 18.0
# Height of everything above the topmost storey: roof and stair house [m].
_TOP_M = 1.9
# Height of the walls above the topmost storey of a section [m].
_RIM_M = 0.9
# Distance of the bays from the ends of a wall [m].
_END_M = 0.5
# Side walls longer than this have rows of windows instead of one window [m].
_LONG_SIDE_M = 15.0
# Half the width of the canopy over a door, and of a stair tower [m].
_STAIR_HALF_M = 1.5


class BalconyFlats(Building):
    """The white slab block: stacks of balconies, staggered sections."""

    def draw(self) -> None:
        site = self.site
        room = site.depth - _AROUND_M
        # Distance by which every other section stands back.
        self.stagger = 0.0
        if room > _STAGGER_DEPTH_M:
            self.stagger = self.pick((0.0, 0.0, 1.5, 2.4))
        # Number of sections of the slab, each with its own stair.
        self.sections = min(
            max(round(site.width / _SECTION_M), 1), _MOST_SECTIONS
        )
        # Number of storeys by which every other section is lower.
        self.step = self.whole(0, 2)
        self.depth = round(
            min(room - self.stagger, self.uniform(11.0, 14.0)), 1
        )
        self.storey = self.uniform(2.8, 3.1)
        self.pitch = max(self.uniform(2.8, 3.6), site.width / _MOST_BAYS)
        self.window_width = self.uniform(1.3, 2.0, digits=2)
        self.recess = self.uniform(0.12, 0.22, digits=2)
        self.balcony_width = self.uniform(2.8, 3.8, digits=2)
        self.balcony_reach = self.uniform(1.1, 1.5, digits=2)
        # `stacks` (one above the other), `ribbons` (all along the front) or
        # `checks` (every other one left out).
        self.balconies = self.pick(("stacks", "ribbons", "checks"))
        self.rail = self.uniform(0.9, 1.1, digits=2)
        # `slit` (a strip of glass) or `tower` (stands out in front).
        self.stair = self.pick(("slit", "tower"))
        self.roof_items = self.draw_roof_items(
            "stair_house tank mast vents dish", low=1, high=6
        )

    def build(self) -> None:
        """Adds all parts of the slab block, which lies along the front."""
        sections = _sections(self)
        plan, fronts = _outline(sections)
        body = self.height - _TOP_M
        storeys = max(2, round(body / self.storey))
        lower = self.step if self.sections > 1 and storeys > 3 else 0
        storey = body / storeys
        walls = [_Front(self, plan, edge) for edge in fronts]
        ground = _storey_walls(self, storey, walls, ground=True)
        top = tiers.add_ground(self, plan, ground)
        # The storeys that all sections have.
        common = tiers.storey_groups(
            (storeys - 1 - lower) * storey, storey=storey, most=5
        )
        facade = _storey_walls(self, common.storey, walls)
        top = tiers.add_storeys(
            self,
            plan,
            facade,
            z0=top,
            groups=common.groups,
            per_group=common.per_group,
        )
        _add_balconies(self, walls, ground.height, common)
        for k, section in enumerate(sections):
            eaves = top
            if lower and k % 2 == 0:
                eaves = _add_upper_storeys(
                    self, k, section, top, common.storey, lower
                )
            _add_section_roof(self, k, section, eaves)
        high = ground.height + common.num_storeys * common.storey
        stairs = []
        for k, wall in enumerate(walls):
            stairs += _stair(self, wall, high, k == 0)
        self.add("stairs", *stairs, finish=self.colours["rail"])


def _add_upper_storeys(
    flats: BalconyFlats,
    number: int,
    section: np.ndarray,
    z0: float,
    storey: float,
    count: int,
) -> float:
    """Adds storeys that only one section has; returns their top [m].

    Args:
        section: outline (4, 2) of the section [m].
        z0: height of the storeys' floor [m].
        storey: height of a storey [m].
    """
    windows = [_window(flats, storey)]
    rows = bays.rhythm(flats.pitch, windows, margin=_END_M)
    walls = Facade(storey, layout=rows, glass=(flats.recess,))
    return tiers.add_storeys(
        flats,
        section,
        walls,
        z0=z0,
        groups=1,
        per_group=count,
        part=f"section_{number}_storey",
    )


def _add_section_roof(
    flats: BalconyFlats, number: int, section: np.ndarray, z0: float
) -> None:
    """Adds the parapet and the roof of a section, and equipment on the roof.

    `section` is the outline (4, 2) of the section `number` [m], and `z0` the
    height of the parapet's foot [m].
    """
    part = f"section_{number}"
    bands = (
        foot_band(height=0.15, reach=0.08),
        Band(z0=0.75, z1=_RIM_M, depth=-0.08),
    )
    roof = tiers.add_crown(
        flats,
        section,
        Facade(_RIM_M, bands=bands),
        z0=z0,
        parapet=0.6,
        part=f"{part}_crown",
        thickness=0.25,
    )
    items = flats.roof_items[number :: flats.sections]
    equip_roof(flats, section, roof, items, prefix=f"{part}_")


def _sections(flats: BalconyFlats) -> list[np.ndarray]:
    """Returns the outlines of the rectangular sections, left to right."""
    x0, y0, x1, _ = flats.site.bounds
    bounds = np.round(np.linspace(x0, x1, flats.sections + 1), 2).tolist()
    fronts = [
        y0 + _FRONT_M + flats.stagger * (k % 2) for k in range(flats.sections)
    ]
    return [
        outlines.rectangle(left, round(y, 2), right, round(y + flats.depth, 2))
        for (left, right), y in zip(
            itertools.pairwise(bounds), fronts, strict=True
        )
    ]


def _window(flats: BalconyFlats, storey: float, sill: float = 0.85) -> bays.Bay:
    """Returns a bay with a window in a storey of the height `storey` [m]."""
    return bays.window(
        width=flats.window_width,
        sill=sill,
        head=storey - 0.45,
        depth=flats.recess,
    )


def _storey_walls(
    flats: BalconyFlats,
    storey: float,
    walls: list[_Front],
    *,
    ground: bool = False,
) -> Facade:
    """Returns the walls of a storey, with doors and a plinth if `ground`."""
    window = _window(flats, storey)
    french_window = _window(flats, storey, sill=0.12)
    slit = bays.window(width=1.3, sill=0.3, head=storey, depth=flats.recess)
    door = bays.window(
        width=1.6, sill=0.0, head=2.3, depth=flats.recess, mullions=1
    )
    by_front = {front.edge: front for front in walls}
    blank = bays.alone(
        bays.window(width=1.0, sill=1.0, head=storey - 0.5, depth=flats.recess),
        width=2.0,
    )
    rows = bays.rhythm(flats.pitch, [window], margin=_END_M)

    def layout(edge: int, length: float) -> Sequence[Relief]:
        if edge not in by_front:
            return (rows if length > _LONG_SIDE_M else blank)(edge, length)
        front = by_front[edge]
        relief: list[Relief] = []
        for k, cell in enumerate(front.cells):
            if k == front.middle:
                if ground:
                    relief += door(*cell)
                elif flats.stair == "slit":
                    relief += slit(*cell)
            else:
                has_balcony = k in front.spots and not ground
                relief += (french_window if has_balcony else window)(*cell)
        return relief

    band = (
        foot_band(height=0.35, reach=0.06)
        if ground
        else foot_band(height=0.12, reach=0.04)
    )
    return Facade(
        round(storey, 3), bands=(band,), layout=layout, glass=(flats.recess,)
    )


def _add_balconies(
    flats: BalconyFlats,
    walls: list[_Front],
    z0: float,
    stack: tiers.StoreyGroups,
) -> None:
    """Adds the balconies of several storeys, one above another."""
    groups, per_group, storey = stack
    pieces: list[Mesh] = []
    joined = flats.balconies == "ribbons"
    for front in walls:
        stretches = _balcony_stretches(front.cells, front.spots, joined)
        for start, end in stretches:
            width = end - start - 0.3
            if not joined:
                width = min(width, flats.balcony_width)
            x = (start + end) / 2
            balcony = balconies.balcony(
                x0=round(x - width / 2, 2),
                x1=round(x + width / 2, 2),
                reach=flats.balcony_reach,
                z=0.0,
                rail=flats.rail,
            )
            pieces += [
                front.wall.place(balcony, k * storey) for k in range(per_group)
            ]
    if pieces:
        mesh = merge_meshes(*pieces)
        step = per_group * storey
        flats.stack(
            "balconies",
            mesh,
            z0=z0,
            step=step,
            count=groups,
            finish=flats.colours["rail"],
        )


def _stair(
    flats: BalconyFlats, front: _Front, top: float, highest: bool
) -> list[Mesh]:
    """Returns a canopy over the door, and the visible part of the stair.

    If `flats.stair` is `tower`, this part is a stair tower in front of the
    wall. Otherwise it is a small house on the roof of the highest section.
    """
    x, wall = front.stair, front.wall
    pieces = [
        wall.box(x=around(x, _STAIR_HALF_M), y=(-0.05, 1.4), z=(2.55, 2.75)),
        wall.standing(x=(x - 1.4, x - 1.25), y=(1.1, 1.25), z1=2.6),
        wall.standing(x=(x + 1.25, x + 1.4), y=(1.1, 1.25), z1=2.6),
    ]
    if flats.stair == "tower":
        high = flats.height if highest else top + 1.6
        tower = wall.box(
            x=around(x, _STAIR_HALF_M), y=(-2.5, 0.9), z=(2.7, high)
        )
        pieces.append(tower)
        for k in range(int((high - 4.2) / flats.storey)):
            z = 3.7 + k * flats.storey
            frame = wall.box(x=around(x, 0.55), y=(0.85, 0.98), z=(z, z + 1.1))
            pieces.append(frame)
    elif highest:
        house = wall.box(
            x=around(x, 2.2), y=(-5.0, -1.5), z=(top - 0.1, flats.height)
        )
        pieces.append(house)
    return pieces


def _outline(sections: list[np.ndarray]) -> tuple[np.ndarray, list[int]]:
    """Returns the outline of all sections, and its front edges' numbers."""
    points: list[np.ndarray] = []
    fronts = []
    for section in sections:
        if not points or abs(points[-1][1] - section[0, 1]) > 1e-6:
            points.append(section[0])
        fronts.append(len(points) - 1)
        points.append(section[1])
    for section in reversed(sections):
        if abs(points[-1][1] - section[2, 1]) > 1e-6:
            points.append(section[2])
        points.append(section[3])
    return np.array(points), fronts


class _Front:
    """The front wall of a section, with the bays of stair and balconies.

    Attributes:
        cells: start and end of each bay along the wall [m].
        spots: numbers of the bays with balconies.
    """

    def __init__(
        self, flats: BalconyFlats, plan: np.ndarray, edge: int
    ) -> None:
        self.edge = edge
        self.wall = WallFrame(plan, edge)
        self.cells = bays.stretches(
            self.wall.length, pitch=flats.pitch, margin=_END_M
        )
        self.middle = len(self.cells) // 2
        free = [k for k in range(len(self.cells)) if k != self.middle]
        if flats.balconies == "ribbons":
            self.spots = free
        elif flats.balconies == "checks":
            self.spots = free[::2]
        else:
            last = len(self.cells) - 1
            self.spots = [k for k in free if min(k, last - k) % 3 != 1]

    @property
    def stair(self) -> float:
        """Middle of the stair's bay along the wall [m]."""
        return sum(self.cells[self.middle]) / 2


def _balcony_stretches(
    cells: list[bays.Span], spots: list[int], joined: bool
) -> list[bays.Span]:
    """Returns stretches with balconies; neighbours are merged if `joined`."""
    runs: list[tuple[float, float]] = []
    for k in spots:
        start, end = cells[k]
        if joined and runs and abs(runs[-1][1] - start) < 1e-6:
            runs[-1] = (runs[-1][0], end)
        else:
            runs.append((start, end))
    return runs
