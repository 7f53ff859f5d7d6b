"""The white slab of flats: stacks of balconies, staggered sections."""

from __future__ import annotations

from collections.abc import Sequence
import itertools

import numpy as np

from cns_drake.city.facades import bays, details, massing, tiers
from cns_drake.city.facades.assembly import Assembly, Dice, Site
from cns_drake.city.facades.roofs import equip_roof
from cns_drake.city.facades.walls import Band, Facade, Relief
from cns_drake.city.geometry.mesh import Mesh, merge_meshes

_WALLS = (
    (0.90, 0.89, 0.86),
    (0.86, 0.84, 0.78),
    (0.82, 0.80, 0.76),
    (0.88, 0.82, 0.74),
)
_RAILS = (
    (0.62, 0.64, 0.66),
    (0.36, 0.42, 0.48),
    (0.60, 0.36, 0.28),
    (0.80, 0.80, 0.78),
)
# Room for balconies in front, and for canopies [m].
_FRONT_M = 1.7


class Parameters:
    """Parameters of a slab of flats; lengths in metres.

    Attributes:
        height: of its highest parapet or stair.
        sections: parts of the slab, each with its own stair.
        stagger: by which every other section stands back.
        step: by which every other section is lower, in storeys.
        depth: of a section.
        storey: wanted height of a storey.
        pitch, window_width, recess: of the windows.
        balcony_width, balcony_reach: of the balconies.
        balconies: `stacks` (one above the other), `ribbons` (all along the
            front) or `checks` (every other one left out).
        rail: whether the balconies have open railings, else parapets.
        stair: `slit` (a strip of glass) or `tower` (stands out in front).
    """

    def __init__(self, d: Dice) -> None:
        room = d.depth - _FRONT_M - 0.3
        stagger = d.pick((0.0, 0.0, 1.5, 2.4)) if room > 12.0 else 0.0
        self.height = d.height
        self.sections = int(np.clip(round(d.width / 18.0), 1, 3))
        self.stagger = stagger
        self.step = d.whole(0, 2)
        self.depth = round(min(room - stagger, d.uniform(11.0, 14.0)), 1)
        self.storey = d.uniform(2.8, 3.1)
        self.pitch = max(d.uniform(2.8, 3.6), d.width / 16)
        self.window_width = d.uniform(1.3, 2.0, 2)
        self.recess = d.uniform(0.12, 0.22, 2)
        self.balcony_width = d.uniform(2.8, 3.8, 2)
        self.balcony_reach = d.uniform(1.1, 1.5, 2)
        self.balconies = d.pick(("stacks", "ribbons", "checks"))
        self.rail = d.uniform(0.9, 1.1, 2)
        self.stair = d.pick(("slit", "tower"))
        self.roof_items = d.some_of("stair_house tank mast vents dish", 1, 6)
        self.rgb = d.pick(_WALLS)
        self.rail_rgb = d.pick(_RAILS)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the slab along the front of a rectangle."""
    sections = _sections(p, out.site)
    plan, fronts = _outline(sections)
    storeys = max(2, round((p.height - 1.9) / p.storey))
    lower = p.step if p.sections > 1 and storeys > 3 else 0
    storey = (p.height - 1.9) / storeys
    walls = [_Front(p, plan, edge) for edge in fronts]
    ground = _facade(p, storey, walls, ground=True)
    top = tiers.add_ground(out, plan, ground)
    count, per_group, exact = tiers.divided(
        (storeys - 1 - lower) * storey, storey, 5
    )
    facade = _facade(p, exact, walls)
    top = tiers.add_storeys(out, plan, facade, top, count, per_group)
    common = count * per_group
    _add_balconies(out, p, walls, ground.height, (count, per_group, exact))
    for k, section in enumerate(sections):
        part, high = f"section_{k}", top
        if lower and k % 2 == 0:
            rows = bays.rhythm(p.pitch, [_window(p, exact)], 0.5)
            attic = Facade(exact, (), rows, (p.recess,))
            high = tiers.add_storeys(
                out, section, attic, top, 1, lower, part=f"{part}_storey"
            )
        rim = Facade(0.9, (Band(0.0, 0.15, -0.08), Band(0.75, 0.9, -0.08)))
        roof = tiers.add_crown(
            out, section, rim, high, 0.6, part=f"{part}_crown",
            thickness=0.25,
        )  # fmt: skip
        items = p.roof_items[k :: p.sections]
        equip_roof(out, section, roof, items, prefix=f"{part}_")
    high, stairs = ground.height + common * exact, []
    for k, wall in enumerate(walls):
        stairs += _stair(p, wall, high, k == 0)
    out.add("stairs", *stairs, rgb=p.rail_rgb)


def _sections(p: Parameters, site: Site) -> list[np.ndarray]:
    """Returns the rectangles of the sections, left to right."""
    x0, y0, x1, _ = site.bounds
    bounds = np.round(np.linspace(x0, x1, p.sections + 1), 2).tolist()
    fronts = [y0 + _FRONT_M + p.stagger * (k % 2) for k in range(p.sections)]
    return [
        massing.rectangle(a, round(y, 2), b, round(y + p.depth, 2))
        for (a, b), y in zip(itertools.pairwise(bounds), fronts, strict=True)
    ]


def _outline(sections: list[np.ndarray]) -> tuple[np.ndarray, list[int]]:
    """Returns the outline of all sections, and their front edges."""
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
    """The front of a section: bays, the stair's bay, and balcony bays."""

    def __init__(self, p: Parameters, plan: np.ndarray, edge: int) -> None:
        self.edge = edge
        self.wall = details.WallFrame(plan, edge)
        self.cells = bays.stretches(self.wall.length, p.pitch, 0.5)
        self.middle = len(self.cells) // 2
        free = [k for k in range(len(self.cells)) if k != self.middle]
        if p.balconies == "ribbons":
            self.spots = free
        elif p.balconies == "checks":
            self.spots = free[::2]
        else:
            last = len(self.cells) - 1
            self.spots = [k for k in free if min(k, last - k) % 3 != 1]

    @property
    def stair(self) -> float:
        """The stretch of the stair along the wall [m]."""
        return sum(self.cells[self.middle]) / 2


def _window(p: Parameters, storey: float, sill: float = 0.85) -> bays.Bay:
    return bays.window(p.window_width, sill, storey - 0.45, p.recess)


def _facade(
    p: Parameters, storey: float, walls: list[_Front], *, ground: bool = False
) -> Facade:
    """Returns a storey; the ground floor has doors and a plinth."""
    window, french = _window(p, storey), _window(p, storey, 0.12)
    slit = bays.window(1.3, 0.3, storey, p.recess)
    door = bays.window(1.6, 0.0, 2.3, p.recess, mullions=1)
    by_front = {front.edge: front for front in walls}
    blank = bays.alone(bays.window(1.0, 1.0, storey - 0.5, p.recess), 2.0)
    rows = bays.rhythm(p.pitch, [window], 0.5)

    def layout(edge: int, length: float) -> Sequence[Relief]:
        if edge not in by_front:
            return (rows if length > 15.0 else blank)(edge, length)
        front = by_front[edge]
        relief: list[Relief] = []
        for k, (a, b) in enumerate(front.cells):
            if k == front.middle:
                if ground:
                    relief += door(a, b)
                elif p.stair == "slit":
                    relief += slit(a, b)
            else:
                has_balcony = k in front.spots and not ground
                relief += (french if has_balcony else window)(a, b)
        return relief

    band = Band(0.0, 0.35, -0.06) if ground else Band(0.0, 0.12, -0.04)
    return Facade(round(storey, 3), (band,), layout, (p.recess,))


def _add_balconies(
    out: Assembly,
    p: Parameters,
    walls: list[_Front],
    z0: float,
    stack: tuple[int, int, float],
) -> None:
    """Places the balconies of a few storeys above one another."""
    groups, per_group, storey = stack
    pieces: list[Mesh] = []
    joined = p.balconies == "ribbons"
    for front in walls:
        for a, b in _runs(front.cells, front.spots, joined):
            width = b - a - 0.3
            if not joined:
                width = min(width, p.balcony_width)
            x = (a + b) / 2
            ends = round(x - width / 2, 2), round(x + width / 2, 2)
            balcony = details.balcony(*ends, p.balcony_reach, 0.0, p.rail)
            pieces += [
                front.wall.place(balcony, k * storey) for k in range(per_group)
            ]
    if pieces:
        mesh, step = merge_meshes(*pieces), per_group * storey
        out.stack("balconies", mesh, z0, step, groups, rgb=p.rail_rgb)


def _runs(
    cells: list[bays.Span], spots: list[int], joined: bool
) -> list[bays.Span]:
    """Returns the stretches with balconies, neighbours joined or not."""
    runs: list[tuple[float, float]] = []
    for k in spots:
        a, b = cells[k]
        if joined and runs and abs(runs[-1][1] - a) < 1e-6:
            runs[-1] = (runs[-1][0], b)
        else:
            runs.append((a, b))
    return runs


def _stair(
    p: Parameters, front: _Front, top: float, highest: bool
) -> list[Mesh]:
    """A canopy at the door, and the stair where it stands out."""
    x, wall = front.stair, front.wall
    pieces = [
        wall.box(x - 1.5, x + 1.5, -0.05, 1.4, 2.55, 2.75),
        wall.standing(x - 1.4, x - 1.25, 1.1, 1.25, 2.6),
        wall.standing(x + 1.25, x + 1.4, 1.1, 1.25, 2.6),
    ]
    if p.stair == "tower":
        high = p.height if highest else top + 1.6
        pieces.append(wall.box(x - 1.5, x + 1.5, -2.5, 0.9, 2.7, high))
        for k in range(int((high - 4.2) / p.storey)):
            z = 3.7 + k * p.storey
            pieces.append(wall.box(x - 0.55, x + 0.55, 0.85, 0.98, z, z + 1.1))
    elif highest:
        spot = (x - 2.2, x + 2.2, -5.0, -1.5)
        pieces.append(wall.box(*spot, top - 0.1, p.height))
    return pieces
