"""The sports hall: a wide roof on outer frames, a low front, high windows."""

from __future__ import annotations

from cns_drake.city.facades import bays, massing, roofs
from cns_drake.city.facades.assembly import Assembly, Dice
from cns_drake.city.facades.house_walls import Openings, free_stretches
from cns_drake.city.facades.roofs import equip_roof
from cns_drake.city.facades.walls import Band
from cns_drake.city.facades.wings import Roof, Wing

_WALLS = ((0.80, 0.78, 0.74), (0.62, 0.44, 0.36), (0.66, 0.70, 0.72))
_ROOFS = ((0.42, 0.46, 0.50), (0.52, 0.30, 0.24), (0.36, 0.44, 0.40))
_FRAMES = ((0.70, 0.24, 0.18), (0.86, 0.85, 0.82), (0.46, 0.36, 0.26),
           (0.22, 0.36, 0.52))  # fmt: skip
_RECESS = 0.2
_MARGIN = 0.6


class Parameters:
    """Parameters of a sports hall; lengths in metres.

    Attributes:
        height: of the ridge, the ribs on it included.
        roof: `barrel`, `gable`, `shed` or `butterfly` (two sheds that
            fall to the middle).
        wall: height of the walls as a part of the ridge's.
        bay: distance between the frames.
        frame_reach: how far the frames stand out of the walls.
        annex: depth of the low front; 0 for none.
        annex_height: [m].
        glazed: whether the gables are glazed.
    """

    def __init__(self, d: Dice) -> None:
        depth = d.depth
        self.height = d.height
        self.roof = d.pick(("barrel", "gable", "shed", "butterfly"))
        self.wall = d.uniform(0.58, 0.7)
        self.bay = max(d.uniform(5.0, 7.5), (d.width + depth) / 18)
        self.frame_reach = d.uniform(0.35, 0.6, 2)
        self.annex = (
            round(min(d.uniform(5.0, 8.0), 0.3 * depth), 2)
            if d.chance(0.8)
            else 0.0
        )
        self.annex_height = round(min(d.uniform(3.4, 4.2), 0.5 * d.height), 2)
        self.glazed = d.chance(0.6)
        self.roof_items = d.some_of("air_handler vents ac_unit", 1, 4)
        self.rgb = d.pick(_WALLS)
        self.roof_rgb = d.pick(_ROOFS)
        self.frame_rgb = d.pick(_FRAMES)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the hall on a rectangle, its entrance in front."""
    out.paint(
        walls=p.rgb,
        glass=out.glass_rgb,
        roof=p.roof_rgb,
        frames=p.frame_rgb,
    )
    x0, y0, x1, y1 = out.site.bounds
    front = y0 + (p.annex + 1.6 if p.annex else 1.8)
    area = (x0 + _MARGIN, front, x1 - _MARGIN, y1 - _MARGIN)
    along_y = area[3] - area[1] > area[2] - area[0]
    halls = _halls(p, area, along_y)
    for hall in halls:
        _add_hall(out, p, hall, halls)
    if p.annex:
        _add_annex(out, p, halls, y0)
    else:
        _add_porch(out, halls)


def _halls(p: Parameters, area: massing.Area, along_y: bool) -> list[Wing]:
    """Returns one hall, or the two halves of a butterfly."""
    x0, y0, x1, y1 = area
    top = p.height - 0.15
    span = (x1 - x0) if along_y else (y1 - y0)
    rise = {"barrel": 0.22 * span, "gable": 0.2 * span}.get(p.roof, 0.1 * span)
    wall = max(p.wall * top, top - 0.3 - rise)
    if p.roof != "butterfly":
        eaves = 0.0 if p.roof == "barrel" else 0.4
        roof = Roof(p.roof, along_y, eaves, 0.4, 0.3)
        return [Wing.at(x0, y0, x1, y1, wall, top, roof)]
    low, high = area, area
    if along_y:
        middle = (x0 + x1) / 2
        low, high = (x0, y0, middle + 0.02, y1), (middle - 0.02, y0, x1, y1)
    else:
        middle = (y0 + y1) / 2
        low, high = (x0, y0, x1, middle + 0.02), (x0, middle - 0.02, x1, y1)
    falling = Roof("shed", along_y, 0.0, 0.4, 0.3, falling=True)
    rising = Roof("shed", along_y, 0.0, 0.4, 0.3)
    return [
        Wing.at(*low, wall, top, falling),
        Wing.at(*high, wall, top, rising),
    ]


def _add_hall(
    out: Assembly, p: Parameters, hall: Wing, halls: list[Wing]
) -> None:
    openings = Openings(hall, halls)
    high, width = hall.wall_top, p.bay - 0.9
    band = bays.window(width, high - 2.4, high - 0.6, _RECESS, mullions=1)
    low = max(0.5 if p.annex == 0.0 else p.annex_height + 0.4, 0.3 * high)
    tall = bays.window(
        width, low, high - 0.6, _RECESS, mullions=1, transom=high - 1.6
    )
    ends = hall.gables
    sides = [k for k in range(4) if k not in ends]
    openings.row(sides, high - 1.0, p.bay, [band], 0.5)
    openings.row(ends, high - 1.0, p.bay, [tall if p.glazed else band], 0.9)
    openings.put(2, 2.6, 2.6, bays.gate(1.9, 2.3, 0.2))
    openings.enclose(out, (_RECESS,), (Band(0.0, 0.5, -0.08),))
    _add_frames(out, p, hall, halls)


def _add_frames(
    out: Assembly, p: Parameters, hall: Wing, halls: list[Wing]
) -> None:
    """Adds posts along the walls, and ribs over the roof."""
    reach = p.frame_reach - 0.02
    for edge in (k for k in range(4) if k not in hall.gables):
        wall = hall.wall(edge)
        for a, b in free_stretches(hall, edge, halls, 0.5):
            for u, _ in bays.stretches(b - a, p.bay, 0.5)[1:]:
                left, right = a + u - 0.2, a + u + 0.2
                foot = massing.rectangle(left, -0.02, right, reach)
                head = massing.rectangle(left, -0.02, right, 0.3 * reach)
                post = massing.frustum(foot, head, 0.0, hall.wall_top)
                root = wall.standing(left, right, -0.02, reach, 0.0)
                out.add_to("frames", root, wall.place(post))
    line = [(u, z + 0.15) for u, z in hall.line]
    start, end = hall.ridge
    for u, _ in bays.stretches(end - start, p.bay, 0.5)[1:]:
        ends = (start + u - 0.18, start + u + 0.18)
        rib = roofs.shell(line, *ends, 0.25, along_y=hall.roof.along_y)
        out.add_to("frames", rib)


def _add_annex(
    out: Assembly, p: Parameters, halls: list[Wing], y0: float
) -> None:
    """Adds the low front: an entrance between changing rooms."""
    x0, x1 = min(w.x0 for w in halls), max(w.x1 for w in halls)
    margin, h = 0.06 * (x1 - x0), p.annex_height
    area = (x0 + margin, y0 + 1.6, x1 - margin, halls[0].y0 + 0.05)
    annex = Wing.flat(*area, h, 0.4)
    openings = Openings(annex, halls)
    small = bays.window(1.6, 1.5, 2.5, _RECESS)
    openings.row((0, 1, 3), 1.0, 3.6, [small], 0.8)
    middle, wide = annex.width / 2, min(7.0, 0.35 * annex.width)
    glazing = bays.window(wide - 0.6, 0.05, h - 0.8, _RECESS, mullions=3)
    openings.put(0, middle, wide, glazing)
    openings.enclose(out, (_RECESS,), (Band(0.0, 0.3, -0.05),))
    z, half = h - 0.65, wide / 2 + 1.0
    lid = (middle - half, middle + half, -0.02, 1.5, z, z + 0.25)
    out.add_to("frames", annex.wall(0).box(*lid))
    equip_roof(out, annex.outline, annex.floor, p.roof_items, clear=0.5)


def _add_porch(out: Assembly, halls: list[Wing]) -> None:
    wall = halls[0].wall(0)
    x = wall.length / 2
    out.add_to("frames", wall.box(x - 2.2, x + 2.2, -0.02, 1.5, 2.7, 3.0))
    for u in (x - 2.1, x + 2.1):
        post = wall.standing(u - 0.12, u + 0.12, 1.2, 1.44, 2.75)
        out.add_to("frames", post)
    out.add_to("glass", wall.box(x - 1.6, x + 1.6, -0.02, 0.1, 0.0, 2.5))
