"""The school."""

import numpy as np

from cns_drake.city.facades import (
    Building,
    Facade,
    Openings,
    Roof,
    WallFrame,
    Wing,
    around,
    bays,
    foot_band,
    outlines,
    roofs,
    solids,
    tiers,
    top_band,
)

# Free strip beside and behind the walls, for eaves [m].
_MARGIN_M = 0.6
# Depth of the windows behind the wall [m].
_RECESS_M = 0.16


class School(Building):
    """The school: classroom wings, a glazed entrance, a gymnasium."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        deep = min(self.uniform(9.0, 12.0), site.depth - 4.5)
        self.rise = round(self.uniform(0.26, 0.36) * deep, 2)
        self.roof = self.pick(("hip", "flat", "flat"))
        # Height of the walls below the roof.
        body = self.height - (self.rise if self.roof == "hip" else 2.4)
        if body < 3.6:
            self.roof = "flat"
            body = self.height - 1.0
        # Width of the gymnasium; 0 for none.
        self.gym = 0.0
        if site.width > 34.0 and site.depth > 16.0:
            gym = round(self.uniform(0.3, 0.38) * site.width, 1)
            self.gym = min(gym, 28.0)
        self.storeys = min(max(round(body / 3.5), 1), 4)
        # Depth of the classroom wing.
        self.depth = round(deep, 1)
        # Whether there is a wing behind.
        self.wing = site.depth > 22.0 and self.chance(0.8)
        # Whether gymnasium and wing stand on the left.
        self.mirrored = self.chance(0.5)
        self.gym_roof = self.pick(("barrel", "shed", "flat"))
        # Width of a classroom's window group.
        self.pitch = max(self.uniform(3.2, 4.4), site.width / 15)
        self.mullions = self.whole(1, 3)
        # Width of the glazed hall.
        self.entrance = self.uniform(4.5, 6.5, digits=1)
        self.roof_items = self.draw_roof_items(
            "air_handler vents skylight skylight vents", low=2, high=6
        )

    def build(self) -> None:
        """Adds all parts of the school, with the entrance in front.

        The building's site must be a rectangle.
        """
        x0, y0, x1, y1 = self.site.bounds
        front = y0 + 3.2
        left, right, back = x0 + _MARGIN_M, x1 - _MARGIN_M, y1 - _MARGIN_M
        gym = self.gym + 1.5 * (self.gym > 0)
        a, b = (left + gym, right) if self.mirrored else (left, right - gym)
        bar = np.round(outlines.rectangle(a, front, b, front + self.depth), 2)
        top = _add_classes(self, bar)
        _add_entrance(self, bar, top)
        if self.wing and back - bar[2, 1] > 6.0:
            _add_back_wing(self, bar, back, top)
        if self.gym:
            xs = (left, a + 0.05) if self.mirrored else (b - 0.05, right)
            _add_gym(self, xs, (front, back), bar)


def _add_classes(school: School, bar: np.ndarray) -> float:
    """Adds the classroom wing; returns the top of its walls [m]."""
    room = school.height - (school.rise + 0.1 if school.roof == "hip" else 2.4)
    storey = round(max(room, 3.2) / school.storeys, 3)
    if school.roof == "flat" and school.storeys == 1:
        storey = min(storey, school.height - 1.0)
    head = storey - 0.6
    group = bays.window(
        width=school.pitch - 0.9,
        sill=0.9,
        head=head,
        depth=_RECESS_M,
        mullions=school.mullions,
    )
    small = bays.window(width=1.4, sill=1.2, head=head, depth=_RECESS_M)
    layouts = {
        0: bays.rhythm(school.pitch, [group], margin=0.5),
        2: bays.rhythm(school.pitch, [small], margin=0.5),
    }
    layout = bays.by_edge(layouts, bays.alone(small, width=2.4))
    walls = Facade(
        storey,
        bands=(foot_band(height=0.3, reach=0.06),),
        layout=layout,
        glass=(_RECESS_M,),
    )
    school.add("foundation", solids.foundation(bar))
    top = tiers.add_storeys(
        school, bar, walls, z0=0.0, groups=school.storeys, per_group=1
    )
    if school.roof == "hip":
        roof = roofs.hip(
            bar, z=top - 0.02, top=school.height, eaves=0.5, fascia=0.3
        )
        school.add("hip", roof, finish=school.colours["roof"])
        return top
    rim = 0.7
    crown = Facade(rim, bands=(top_band(rim, height=0.3, reach=0.15),))
    tiers.add_crown(
        school, bar, crown, z0=top, parapet=0.5, items=school.roof_items
    )
    return top


def _add_entrance(school: School, bar: np.ndarray, top: float) -> None:
    """Adds a glazed stair hall with steps and a canopy on posts."""
    wall = WallFrame(bar, 0)
    share = 0.72 if school.mirrored else 0.28
    x = share * wall.length
    half = min(school.entrance, 0.4 * wall.length) / 2
    x = float(np.clip(x, half + 0.4, wall.length - half - 0.4))
    high = (
        school.height
        if school.roof == "flat"
        else min(top + 0.5, school.height)
    )
    x0, y0 = wall.point(x - half, 1.2)
    hall = Wing.flat(
        (x0, y0, x0 + 2 * half, bar[0, 1] + 4.0), top=high, parapet=0.4
    )
    openings = Openings(school, hall)
    glazing = bays.window(
        width=2 * half - 0.9,
        sill=2.9,
        head=high - 0.9,
        depth=_RECESS_M,
        mullions=2,
        transom=3.0,
    )
    openings.replace_by_bay(0, x=half, width=2 * half - 0.4, bay=glazing)
    doors = bays.window(
        width=2 * half - 1.4, sill=0.05, head=2.5, depth=_RECESS_M, mullions=3
    )
    openings.add_reliefs(0, doors(0.2, 2 * half - 0.2))
    openings.enclose((_RECESS_M,), material="accent")
    front = hall.wall(0)
    a, b = -0.8, 2 * half + 0.8
    posts = (
        front.standing(x=around(u, 0.1), y=(1.4, 1.6), z1=2.65)
        for u in (a + 0.3, b - 0.3)
    )
    step = front.standing(x=(a, b), y=(-0.02, 1.8), z1=0.15, bottom=True)
    school.add_to(
        "trim",
        front.box(x=(a, b), y=(-0.02, 1.75), z=(2.6, 2.85)),
        *posts,
        step,
    )


def _add_back_wing(
    school: School, bar: np.ndarray, back: float, top: float
) -> None:
    """Adds a lower wing at the back, on the side away from the gymnasium."""
    (a, _), (b, y) = bar[0], bar[2]
    wide = min(9.0, 0.4 * (b - a))
    x0 = b - wide - 0.3 if school.mirrored else a + 0.3
    high = min(top, 4.2 if school.storeys < 3 else 7.6)
    area = (x0, y - 0.05, x0 + wide, min(back, y + 22.0))
    openings = Openings(school, Wing.flat(area, top=high, parapet=0.4, rim=0.6))
    for k in range(2 if high > 6.0 else 1):
        z = 3.4 * k
        pane = bays.window(
            width=2.4, sill=z + 0.9, head=z + 2.6, depth=_RECESS_M, mullions=1
        )
        openings.add_bays(
            (1, 2, 3), z=z + 0.5, pitch=3.6, choices=[pane], margin=0.8
        )
    openings.enclose((_RECESS_M,), material="gym")


def _add_gym(
    school: School, xs: bays.Span, ys: bays.Span, bar: np.ndarray
) -> None:
    """Adds the gymnasium with high windows, and its link to the school."""
    a, b = xs
    x0, x1 = (a, b - 1.5) if school.mirrored else (a + 1.5, b)
    y0 = ys[0] + 1.0
    y1 = min(ys[1], y0 + 24.0)
    top = min(school.height, 9.5)
    drop = {"barrel": 0.16 * (x1 - x0), "shed": 1.2}.get(school.gym_roof, 0.3)
    wall = max(top - drop, 0.55 * top)
    eaves = 0.0 if school.gym_roof == "barrel" else 0.4
    roof = Roof(
        school.gym_roof,
        along_y=True,
        eaves=eaves,
        verge=0.4,
        thickness=0.25,
        parapet=0.5,
    )
    gym = Wing.at((x0, y0, x1, y1), wall_top=wall, top=top, roof=roof)
    link_y = min(bar[2, 1], y1) - 3.4
    ends = (bar[1, 0] - 0.1, x0 + 0.1)
    if school.mirrored:
        ends = (min(x1, bar[1, 0]) - 0.1, bar[0, 0] + 0.1)
    link = Wing.flat(
        (ends[0], link_y, ends[1], link_y + 3.0), top=3.4, parapet=0.2, rim=0.3
    )
    boxes = (gym, link)
    openings = Openings(school, gym, boxes)
    high = bays.window(
        width=2.6, sill=wall - 2.2, head=wall - 0.7, depth=_RECESS_M, mullions=1
    )
    openings.add_bays((1, 2, 3), z=3.5, pitch=3.6, choices=[high], margin=0.9)
    openings.replace_by_bay(
        0,
        x=(x1 - x0) / 2,
        width=3.4,
        bay=bays.gate(width=2.4, height=2.6, depth=0.3),
    )
    for edge in (1, 3):
        side = gym.wall(edge)
        for u in np.linspace(0.6, y1 - y0 - 0.6, 5).tolist():
            pier = side.box(
                x=around(u, 0.2), y=(-0.02, 0.25), z=(0.0, wall - 0.3)
            )
            school.add_to("accent", pier)
    openings.enclose((_RECESS_M,), material="gym")
    passage = Openings(school, link, boxes)
    passage.add_bays(
        (0, 2),
        z=0.3,
        pitch=2.0,
        choices=[bays.window(width=1.4, sill=0.4, head=2.6, depth=_RECESS_M)],
        margin=0.3,
    )
    passage.enclose((_RECESS_M,), material="trim")
