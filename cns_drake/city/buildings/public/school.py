"""The school: classroom wings, a glazed entrance, a gymnasium."""

from __future__ import annotations

import numpy as np

from cns_drake.city.facades import bays, details, massing, roofs, tiers
from cns_drake.city.facades.assembly import Assembly, Dice
from cns_drake.city.facades.house_walls import Openings
from cns_drake.city.facades.roofs import equip_roof
from cns_drake.city.facades.walls import Band, Facade
from cns_drake.city.facades.wings import Roof, Wing

_WALLS = ((0.62, 0.42, 0.34), (0.82, 0.76, 0.64), (0.74, 0.72, 0.68))
_ROOFS = ((0.44, 0.28, 0.23), (0.36, 0.37, 0.40))
_TRIM = (0.86, 0.85, 0.82)
_ACCENTS = ((0.72, 0.30, 0.22), (0.24, 0.42, 0.55), (0.76, 0.62, 0.26))
_MARGIN = 0.6
_RECESS = 0.16


class Parameters:
    """Parameters of a school; lengths in metres.

    Attributes:
        height: of the ridge of the classrooms, or of their stair.
        roof: `hip` or `flat`.
        rise: of a hipped roof.
        storeys: of classrooms.
        depth: of the classroom wing.
        wing: depth of the wing behind, as a part of the site; 0 for none.
        mirrored: whether gymnasium and wing stand on the left.
        gym: width of the gymnasium; 0 for none.
        gym_roof: `barrel`, `shed` or `flat`.
        pitch: width of a classroom's window group.
        entrance: width of the glazed hall.
    """

    def __init__(self, d: Dice) -> None:
        width, depth = d.width, d.depth
        deep = min(d.uniform(9.0, 12.0), depth - 4.5)
        rise = round(d.uniform(0.26, 0.36) * deep, 2)
        roof = d.pick(("hip", "flat", "flat"))
        body = d.height - (rise if roof == "hip" else 2.4)
        if body < 3.6:
            roof, body = "flat", d.height - 1.0
        gym = 0.0
        if width > 34.0 and depth > 16.0:
            gym = round(d.uniform(0.3, 0.38) * width, 1)
        self.height = d.height
        self.roof = roof
        self.rise = rise
        self.storeys = int(np.clip(round(body / 3.5), 1, 4))
        self.depth = round(deep, 1)
        self.wing = depth > 22.0 and d.chance(0.8)
        self.mirrored = d.chance(0.5)
        self.gym = min(gym, 28.0)
        self.gym_roof = d.pick(("barrel", "shed", "flat"))
        self.pitch = max(d.uniform(3.2, 4.4), width / 15)
        self.mullions = d.whole(1, 3)
        self.entrance = d.uniform(4.5, 6.5, 1)
        self.roof_items = d.some_of(
            "air_handler vents skylight skylight vents", 2, 6
        )
        self.rgb = d.pick(_WALLS)
        self.roof_rgb = d.pick(_ROOFS)
        self.accent_rgb = d.pick(_ACCENTS)


def build(p: Parameters, out: Assembly) -> None:
    """Builds the school on a rectangle, its entrance in front."""
    out.paint(
        gym=p.rgb,
        glass=out.glass_rgb,
        roof=p.roof_rgb,
        accent=p.accent_rgb,
        trim=_TRIM,
    )
    x0, y0, x1, y1 = out.site.bounds
    front = y0 + 3.2
    left, right, back = x0 + _MARGIN, x1 - _MARGIN, y1 - _MARGIN
    gym = p.gym + 1.5 * (p.gym > 0)
    a, b = (left + gym, right) if p.mirrored else (left, right - gym)
    bar = np.round(massing.rectangle(a, front, b, front + p.depth), 2)
    top = _add_classes(out, p, bar)
    _add_entrance(out, p, bar, top)
    if p.wing and back - bar[2, 1] > 6.0:
        _add_back_wing(out, p, bar, back, top)
    if p.gym:
        xs = (left, a + 0.05) if p.mirrored else (b - 0.05, right)
        _add_gym(out, p, xs, (front, back), bar)


def _add_classes(out: Assembly, p: Parameters, bar: np.ndarray) -> float:
    """Adds the classroom wing; returns the top of its walls [m]."""
    room = p.height - (p.rise + 0.1 if p.roof == "hip" else 2.4)
    storey = round(max(room, 3.2) / p.storeys, 3)
    if p.roof == "flat" and p.storeys == 1:
        storey = min(storey, p.height - 1.0)
    head = storey - 0.6
    group = bays.window(p.pitch - 0.9, 0.9, head, _RECESS, mullions=p.mullions)
    small = bays.window(1.4, 1.2, head, _RECESS)
    layouts = {
        0: bays.rhythm(p.pitch, [group], 0.5),
        2: bays.rhythm(p.pitch, [small], 0.5),
    }
    layout = bays.by_edge(layouts, bays.alone(small, 2.4))
    walls = Facade(storey, (Band(0.0, 0.3, -0.06),), layout, (_RECESS,))
    out.add("foundation", massing.foundation(bar))
    top = tiers.add_storeys(out, bar, walls, 0.0, p.storeys, 1)
    if p.roof == "hip":
        roof = roofs.hip(bar, top - 0.02, p.height, 0.5, 0.3)
        out.add("hip", roof, rgb=p.roof_rgb)
        return top
    rim = 0.7
    crown = Facade(rim, (Band(rim - 0.3, rim, -0.15),))
    z = tiers.add_crown(out, bar, crown, top, 0.5, thickness=0.3)
    equip_roof(out, bar, z, p.roof_items)
    return top


def _add_entrance(
    out: Assembly, p: Parameters, bar: np.ndarray, top: float
) -> None:
    """Adds a stair hall with glass, a canopy on posts and steps."""
    wall = details.WallFrame(bar, 0)
    share = 0.72 if p.mirrored else 0.28
    x, half = share * wall.length, min(p.entrance, 0.4 * wall.length) / 2
    x = float(np.clip(x, half + 0.4, wall.length - half - 0.4))
    high = p.height if p.roof == "flat" else min(top + 0.5, p.height)
    x0, y0 = wall.point(x - half, 1.2)
    hall = Wing.flat(x0, y0, x0 + 2 * half, bar[0, 1] + 4.0, high, 0.4)
    openings = Openings(hall)
    glazing = bays.window(
        2 * half - 0.9, 2.9, high - 0.9, _RECESS, mullions=2, transom=3.0
    )
    openings.put(0, half, 2 * half - 0.4, glazing)
    doors = bays.window(2 * half - 1.4, 0.05, 2.5, _RECESS, mullions=3)
    openings.add(0, doors(0.2, 2 * half - 0.2))
    openings.enclose(out, (_RECESS,), material="accent")
    front = hall.wall(0)
    a, b = -0.8, 2 * half + 0.8
    posts = (
        front.standing(u - 0.1, u + 0.1, 1.4, 1.6, 2.65)
        for u in (a + 0.3, b - 0.3)
    )
    step = front.standing(a, b, -0.02, 1.8, 0.15, bottom=True)
    out.add_to("trim", front.box(a, b, -0.02, 1.75, 2.6, 2.85), *posts, step)


def _add_back_wing(
    out: Assembly, p: Parameters, bar: np.ndarray, back: float, top: float
) -> None:
    """Adds a lower wing behind, on the side away from the gymnasium."""
    (a, _), (b, y) = bar[0], bar[2]
    wide = min(9.0, 0.4 * (b - a))
    x0 = b - wide - 0.3 if p.mirrored else a + 0.3
    high = min(top, 4.2 if p.storeys < 3 else 7.6)
    area = (x0, y - 0.05, x0 + wide, min(back, y + 22.0))
    openings = Openings(Wing.flat(*area, high, 0.4, rim=0.6))
    for k in range(2 if high > 6.0 else 1):
        z = 3.4 * k
        pane = bays.window(2.4, z + 0.9, z + 2.6, _RECESS, mullions=1)
        openings.row((1, 2, 3), z + 0.5, 3.6, [pane], 0.8)
    openings.enclose(out, (_RECESS,), material="gym")


def _add_gym(
    out: Assembly, p: Parameters, xs: bays.Span, ys: bays.Span, bar: np.ndarray
) -> None:
    """Adds the gymnasium with high windows, and its link to the school."""
    a, b = xs
    x0, x1 = (a, b - 1.5) if p.mirrored else (a + 1.5, b)
    y0 = ys[0] + 1.0
    y1 = min(ys[1], y0 + 24.0)
    top = min(p.height, 9.5)
    drop = {"barrel": 0.16 * (x1 - x0), "shed": 1.2}.get(p.gym_roof, 0.3)
    wall = max(top - drop, 0.55 * top)
    eaves = 0.0 if p.gym_roof == "barrel" else 0.4
    roof = Roof(p.gym_roof, True, eaves, 0.4, 0.25, parapet=0.5)
    gym = Wing.at(x0, y0, x1, y1, wall, top, roof)
    link_y = min(bar[2, 1], y1) - 3.4
    ends = (bar[1, 0] - 0.1, x0 + 0.1)
    if p.mirrored:
        ends = (min(x1, bar[1, 0]) - 0.1, bar[0, 0] + 0.1)
    link = Wing.flat(ends[0], link_y, ends[1], link_y + 3.0, 3.4, 0.2, rim=0.3)
    boxes = (gym, link)
    openings = Openings(gym, boxes)
    high = bays.window(2.6, wall - 2.2, wall - 0.7, _RECESS, mullions=1)
    openings.row((1, 2, 3), 3.5, 3.6, [high], 0.9)
    openings.put(0, (x1 - x0) / 2, 3.4, bays.gate(2.4, 2.6, 0.3))
    for edge in (1, 3):
        side = gym.wall(edge)
        for u in np.linspace(0.6, y1 - y0 - 0.6, 5).tolist():
            pier = side.box(u - 0.2, u + 0.2, -0.02, 0.25, 0.0, wall - 0.3)
            out.add_to("accent", pier)
    openings.enclose(out, (_RECESS,), material="gym")
    passage = Openings(link, boxes)
    passage.row((0, 2), 0.3, 2.0, [bays.window(1.4, 0.4, 2.6, _RECESS)], 0.3)
    passage.enclose(out, (_RECESS,), material="trim")
