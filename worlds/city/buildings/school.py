"""The school."""

import numpy as np

from worlds.city.facades import (
    Building,
    Facade,
    Openings,
    Roof,
    WallFrame,
    Wing,
    around,
    bays,
    foot_band,
    roofs,
    solids,
    tiers,
    top_band,
)
from worlds.shapes import outlines

# Free strip beside and behind the walls, for eaves [m].
_MARGIN_M = 0.6
# Depth of the windows behind the wall [m].
_RECESS_M = 0.16
# Height above the walls under a flat roof, including the entrance hall [m].
_FLAT_ROOF_M = 2.4
# Height above the walls of a low school [m].
_SINGLE_ROOF_M = 1.0
# Least height of a storey under a hipped roof [m].
_LEAST_STOREY_M = 3.6
# Height of a storey, approximately [m].
_STOREY_M = 3.5
# Free ground in front of the classrooms, for the entrance [m].
_FORECOURT_M = 3.2
# Distance between classrooms and gymnasium, which the link bridges [m].
_LINK_M = 1.5
# Least width of a site with a gymnasium [m].
_GYM_SITE_WIDTH_M = 34.0
# Least depth of a site with a gymnasium [m].
_GYM_SITE_DEPTH_M = 16.0
# Greatest width of a gymnasium [m].
_MOST_GYM_WIDTH_M = 28.0
# Greatest depth of a gymnasium [m].
_MOST_GYM_DEPTH_M = 24.0
# Greatest height of a gymnasium [m].
_MOST_GYM_HEIGHT_M = 9.5
# Least depth of a site with a wing behind the classrooms [m].
_WING_SITE_M = 22.0
# Least depth of this wing [m].
_LEAST_WING_M = 6.0
# Height of a storey of the wing behind [m].
_WING_STOREY_M = 3.4
# Greatest number of windows in front.
_MOST_BAYS = 15
# Height of the walls above the classrooms under a flat roof [m].
_RIM_M = 0.7
# Distance of the entrance hall from the ends of the front [m].
_HALL_END_M = 0.4
# How far the entrance hall stands out in front of the classrooms [m].
_HALL_REACH_M = 1.2
# Number of piers along each side of the gymnasium.
_GYM_PIERS = 5


class School(Building):
    """The school: classroom wings, a glazed entrance, a gymnasium."""

    def draw(self) -> None:
        site = self.site
        deep = min(self.uniform(9.0, 12.0), site.depth - 4.5)
        self.rise = round(self.uniform(0.26, 0.36) * deep, 2)
        self.roof = self.pick(("hip", "flat", "flat"))
        # Height of the walls below the roof.
        body = self.height - (self.rise if self.roof == "hip" else _FLAT_ROOF_M)
        if body < _LEAST_STOREY_M:
            self.roof = "flat"
            body = self.height - _SINGLE_ROOF_M
        # Width of the gymnasium; 0 for none.
        self.gym = 0.0
        is_wide = site.width > _GYM_SITE_WIDTH_M
        if is_wide and site.depth > _GYM_SITE_DEPTH_M:
            gym = round(self.uniform(0.3, 0.38) * site.width, 1)
            self.gym = min(gym, _MOST_GYM_WIDTH_M)
        self.storeys = min(max(round(body / _STOREY_M), 1), 4)
        # Depth of the classroom wing.
        self.depth = round(deep, 1)
        # Whether there is a wing behind.
        self.wing = site.depth > _WING_SITE_M and self.chance(0.8)
        # Whether gymnasium and wing stand on the left.
        self.mirrored = self.chance(0.5)
        self.gym_roof = self.pick(("barrel", "shed", "flat"))
        # Width of a classroom's window group.
        self.pitch = max(self.uniform(3.2, 4.4), site.width / _MOST_BAYS)
        self.mullions = self.whole(1, 3)
        # Width of the glazed hall.
        self.entrance = self.uniform(4.5, 6.5, digits=1)
        self.roof_items = self.draw_roof_items(
            "air_handler vents skylight skylight vents", low=2, high=6
        )

    def build(self) -> None:
        """Adds all parts of the school, with the entrance in front."""
        x0, y0, x1, y1 = self.site.bounds
        front = y0 + _FORECOURT_M
        left, right, back = x0 + _MARGIN_M, x1 - _MARGIN_M, y1 - _MARGIN_M
        start, end = left, right
        if self.gym and self.mirrored:
            start = left + (self.gym + _LINK_M)
        elif self.gym:
            end = right - (self.gym + _LINK_M)
        bar = outlines.rectangle(start, front, end, front + self.depth)
        bar = np.round(bar, 2)
        top = _add_classes(self, bar)
        _add_entrance(self, bar, top)
        if self.wing and back - bar[2, 1] > _LEAST_WING_M:
            _add_back_wing(self, bar, back, top)
        if self.gym:
            xs = (left, start + 0.05) if self.mirrored else (end - 0.05, right)
            _add_gym(self, xs, (front, back), bar)


def _add_classes(school: School, bar: np.ndarray) -> float:
    """Adds the classroom wing; returns the top of its walls [m]."""
    above = school.rise + 0.1 if school.roof == "hip" else _FLAT_ROOF_M
    room = school.height - above
    storey = round(max(room, 3.2) / school.storeys, 3)
    if school.roof == "flat" and school.storeys == 1:
        storey = min(storey, school.height - _SINGLE_ROOF_M)
    head = storey - 0.6
    classroom = bays.window(
        width=school.pitch - 0.9,
        sill=0.9,
        head=head,
        depth=_RECESS_M,
        mullions=school.mullions,
    )
    corridor = bays.window(width=1.4, sill=1.2, head=head, depth=_RECESS_M)
    layouts = {
        0: bays.rhythm(school.pitch, [classroom], margin=0.5),
        2: bays.rhythm(school.pitch, [corridor], margin=0.5),
    }
    walls = Facade(
        storey,
        bands=(foot_band(height=0.3, reach=0.06),),
        layout=bays.by_edge(layouts, bays.alone(corridor, width=2.4)),
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
    else:
        rim = Facade(_RIM_M, bands=(top_band(_RIM_M, height=0.3, reach=0.15),))
        tiers.add_crown(
            school, bar, rim, z0=top, parapet=0.5, items=school.roof_items
        )
    return top


def _add_entrance(school: School, bar: np.ndarray, top: float) -> None:
    """Adds a glazed stair hall with steps and a canopy on posts.

    `bar` is the outline (4, 2) of the classroom wing, and `top` the height of
    its walls [m].
    """
    wall = WallFrame(bar, 0)
    share = 0.72 if school.mirrored else 0.28
    width = 2 * (min(school.entrance, 0.4 * wall.length) / 2)
    half = width / 2
    least, most = half + _HALL_END_M, wall.length - half - _HALL_END_M
    x = float(np.clip(share * wall.length, least, most))
    height = school.height
    if school.roof != "flat":
        height = min(top + 0.5, school.height)
    x0, y0 = wall.point(x - half, _HALL_REACH_M)
    area = (x0, y0, x0 + width, bar[0, 1] + 4.0)
    hall = Wing.flat(area, top=height, parapet=0.4)
    openings = Openings(school, hall)
    glazing = bays.window(
        width=width - 0.9,
        sill=2.9,
        head=height - 0.9,
        depth=_RECESS_M,
        mullions=2,
        transom=3.0,
    )
    openings.replace_by_bay(0, x=half, width=width - 0.4, bay=glazing)
    doors = bays.window(
        width=width - 1.4, sill=0.05, head=2.5, depth=_RECESS_M, mullions=3
    )
    openings.add_reliefs(0, doors(0.2, width - 0.2))
    openings.enclose((_RECESS_M,), material="accent")
    _add_canopy(school, hall.wall(0), -0.8, width + 0.8)


def _add_canopy(
    school: School, wall: WallFrame, start: float, end: float
) -> None:
    """Adds a canopy on two posts above a low step in front of a wall.

    The canopy extends from `start` to `end` along the wall [m].
    """
    posts = (
        wall.standing(x=around(x, 0.1), y=(1.4, 1.6), z1=2.65)
        for x in (start + 0.3, end - 0.3)
    )
    step = wall.standing(x=(start, end), y=(-0.02, 1.8), z1=0.15, bottom=True)
    canopy = wall.box(x=(start, end), y=(-0.02, 1.75), z=(2.6, 2.85))
    school.add_to("trim", canopy, *posts, step)


def _add_back_wing(
    school: School, bar: np.ndarray, back: float, top: float
) -> None:
    """Adds a lower wing at the back, on the side away from the gymnasium."""
    (left, _), (right, y) = bar[0], bar[2]
    width = min(9.0, 0.4 * (right - left))
    x0 = right - width - 0.3 if school.mirrored else left + 0.3
    height = min(top, 4.2 if school.storeys < 3 else 7.6)
    area = (x0, y - 0.05, x0 + width, min(back, y + 22.0))
    wing = Wing.flat(area, top=height, parapet=0.4, rim=0.6)
    openings = Openings(school, wing)
    for k in range(2 if height > 6.0 else 1):
        floor = _WING_STOREY_M * k
        window = bays.window(
            width=2.4,
            sill=floor + 0.9,
            head=floor + 2.6,
            depth=_RECESS_M,
            mullions=1,
        )
        openings.add_bays(
            (1, 2, 3), z=floor + 0.5, pitch=3.6, choices=[window], margin=0.8
        )
    openings.enclose((_RECESS_M,), material="gym")


def _add_gym(
    school: School, xs: bays.Span, ys: bays.Span, bar: np.ndarray
) -> None:
    """Adds the gymnasium with high windows, and its link to the school.

    Args:
        xs: least and greatest x of gymnasium and link [m].
        ys: y of the front of the school, and greatest y of the gymnasium [m].
        bar: (4, 2) outline of the classroom wing [m].
    """
    x0, x1 = xs
    if school.mirrored:
        x1 -= _LINK_M
    else:
        x0 += _LINK_M
    y0 = ys[0] + 1.0
    y1 = min(ys[1], y0 + _MOST_GYM_DEPTH_M)
    # The link begins inside the classroom wing, and ends inside the gymnasium.
    link_start, link_end = bar[1, 0] - 0.1, x0 + 0.1
    if school.mirrored:
        link_start, link_end = min(x1, bar[1, 0]) - 0.1, bar[0, 0] + 0.1
    link_y = min(bar[2, 1], y1) - 3.4
    link = Wing.flat(
        (link_start, link_y, link_end, link_y + 3.0),
        top=3.4,
        parapet=0.2,
        rim=0.3,
    )
    eaves = _gym_eaves(school, x1 - x0)
    gym = _gym_wing(school, (x0, y0, x1, y1), eaves)
    boxes = (gym, link)
    openings = Openings(school, gym, boxes)
    window = bays.window(
        width=2.6,
        sill=eaves - 2.2,
        head=eaves - 0.7,
        depth=_RECESS_M,
        mullions=1,
    )
    openings.add_bays((1, 2, 3), z=3.5, pitch=3.6, choices=[window], margin=0.9)
    gate = bays.gate(width=2.4, height=2.6, depth=0.3)
    openings.replace_by_bay(0, x=(x1 - x0) / 2, width=3.4, bay=gate)
    _add_gym_piers(school, gym, y1 - y0, eaves)
    openings.enclose((_RECESS_M,), material="gym")
    passage = Openings(school, link, boxes)
    window = bays.window(width=1.4, sill=0.4, head=2.6, depth=_RECESS_M)
    passage.add_bays((0, 2), z=0.3, pitch=2.0, choices=[window], margin=0.3)
    passage.enclose((_RECESS_M,), material="trim")


def _gym_eaves(school: School, width: float) -> float:
    """Returns the height of the walls of a gymnasium of a width [m]."""
    top = min(school.height, _MOST_GYM_HEIGHT_M)
    rises = {"barrel": 0.16 * width, "shed": 1.2}
    return max(top - rises.get(school.gym_roof, 0.3), 0.55 * top)


def _gym_wing(school: School, area: outlines.Area, eaves: float) -> Wing:
    """Returns the gymnasium.

    `area` is its ground, and `eaves` the height of its walls [m].
    """
    roof = Roof(
        school.gym_roof,
        along_y=True,
        eaves=0.0 if school.gym_roof == "barrel" else 0.4,
        verge=0.4,
        thickness=0.25,
        parapet=0.5,
    )
    top = min(school.height, _MOST_GYM_HEIGHT_M)
    return Wing.at(area, wall_top=eaves, top=top, roof=roof)


def _add_gym_piers(
    school: School, gym: Wing, depth: float, eaves: float
) -> None:
    """Adds piers along both sides of the gymnasium.

    `depth` is the depth of the gymnasium, and `eaves` the height of its walls
    [m].
    """
    for edge in (1, 3):
        side = gym.wall(edge)
        spots = np.linspace(0.6, depth - 0.6, _GYM_PIERS)
        for x in spots.tolist():
            pier = side.box(
                x=around(x, 0.2), y=(-0.02, 0.25), z=(0.0, eaves - 0.3)
            )
            school.add_to("accent", pier)
