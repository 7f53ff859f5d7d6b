"""The sports hall."""

from dataclasses import replace
from functools import partial

from worlds.city.facades import (
    Building,
    Openings,
    Roof,
    Wing,
    around,
    bays,
    foot_band,
    free_stretches,
    roofs,
    solids,
)
from worlds.shapes import equip_roof, outlines

# Depth of the windows behind the wall [m].
_RECESS_M = 0.2
# Free strip beside and behind the walls, for eaves and frames [m].
_MARGIN_M = 0.6
# Greatest number of bays around half of the hall.
_MOST_BAYS = 18
# Depth of the free ground in front of the low front part [m].
_FORECOURT_M = 1.6
# Depth of the free ground in front of a hall without a low front part [m].
_PORCH_M = 1.8
# Height of the frames above the roof [m].
_RIB_ABOVE_M = 0.15
# Thickness of the roof [m].
_ROOF_M = 0.3
# Overhang of the roof at its gables, and of its eaves [m].
_OVERHANG_M = 0.4
# Overlap of the two halves of a butterfly roof [m].
_JOINT_M = 0.02
# Half the width of a post of a frame [m].
_POST_HALF_M = 0.2
# Half the width of a rib of a frame [m].
_RIB_HALF_M = 0.18
# Distance of the outermost frames from the ends of a wall [m].
_END_M = 0.5


class SportsHall(Building):
    """The sports hall: a wide roof on frames, a low front, high windows."""

    def draw(self) -> None:
        site = self.site
        # A `butterfly` is two sheds that fall to the middle.
        self.roof = self.pick(("barrel", "gable", "shed", "butterfly"))
        # Height of the walls, as a share of the height of the ridge.
        self.wall = self.uniform(0.58, 0.7)
        # Distance between the frames.
        self.bay = max(
            self.uniform(5.0, 7.5), (site.width + site.depth) / _MOST_BAYS
        )
        self.frame_reach = self.uniform(0.35, 0.6, digits=2)
        # Depth of the low front; 0 for none.
        self.annex = 0.0
        if self.chance(0.8):
            self.annex = round(min(self.uniform(5.0, 8.0), 0.3 * site.depth), 2)
        self.annex_height = round(
            min(self.uniform(3.4, 4.2), 0.5 * self.height), 2
        )
        # Whether the gables are glazed.
        self.glazed = self.chance(0.6)
        self.roof_items = self.draw_roof_items(
            "air_handler vents ac_unit", low=1, high=4
        )

    def build(self) -> None:
        """Adds all parts of the sports hall, with the entrance in front."""
        x0, y0, x1, y1 = self.site.bounds
        ahead = self.annex + _FORECOURT_M if self.annex else _PORCH_M
        front = y0 + ahead
        area = (x0 + _MARGIN_M, front, x1 - _MARGIN_M, y1 - _MARGIN_M)
        along_y = area[3] - area[1] > area[2] - area[0]
        halls = _halls(self, area, along_y)
        for hall in halls:
            _add_hall(self, hall, halls)
        if self.annex:
            _add_annex(self, halls, y0)
        else:
            _add_porch(self, halls)


def _halls(
    building: SportsHall, area: outlines.Area, along_y: bool
) -> list[Wing]:
    """Returns the hall: two halves under a butterfly roof, or one wing."""
    x0, y0, x1, y1 = area
    top = building.height - _RIB_ABOVE_M
    span = (x1 - x0) if along_y else (y1 - y0)
    rises = {"barrel": 0.22 * span, "gable": 0.2 * span}
    rise = rises.get(building.roof, 0.1 * span)
    wall_top = max(building.wall * top, top - _ROOF_M - rise)
    if building.roof != "butterfly":
        roof = Roof(
            building.roof,
            along_y=along_y,
            eaves=0.0 if building.roof == "barrel" else _OVERHANG_M,
            verge=_OVERHANG_M,
            thickness=_ROOF_M,
        )
        return [Wing.at(area, wall_top=wall_top, top=top, roof=roof)]
    if along_y:
        middle = (x0 + x1) / 2
        first = (x0, y0, middle + _JOINT_M, y1)
        second = (middle - _JOINT_M, y0, x1, y1)
    else:
        middle = (y0 + y1) / 2
        first = (x0, y0, x1, middle + _JOINT_M)
        second = (x0, middle - _JOINT_M, x1, y1)
    rising = Roof(
        "shed",
        along_y=along_y,
        eaves=0.0,
        verge=_OVERHANG_M,
        thickness=_ROOF_M,
    )
    falling = replace(rising, falling=True)
    return [
        Wing.at(first, wall_top=wall_top, top=top, roof=falling),
        Wing.at(second, wall_top=wall_top, top=top, roof=rising),
    ]


def _add_hall(building: SportsHall, hall: Wing, halls: list[Wing]) -> None:
    """Adds one hall or half of a hall, with its frames.

    `halls` contains all halls, which hide parts of each other's walls.
    """
    openings = Openings(building, hall, halls)
    eaves = hall.wall_top
    window = partial(
        bays.window,
        width=building.bay - 0.9,
        head=eaves - 0.6,
        depth=_RECESS_M,
        mullions=1,
    )
    high_window = window(sill=eaves - 2.4)
    # Glass of the gables begins above the low front part.
    least_sill = building.annex_height + 0.4 if building.annex else 0.5
    glazed_bay = window(sill=max(least_sill, 0.3 * eaves), transom=eaves - 1.6)
    gable_bay = glazed_bay if building.glazed else high_window
    sides = [edge for edge in range(4) if edge not in hall.gables]
    z, pitch = eaves - 1.0, building.bay
    openings.add_bays(
        sides, z=z, pitch=pitch, choices=[high_window], margin=0.5
    )
    openings.add_bays(
        hall.gables, z=z, pitch=pitch, choices=[gable_bay], margin=0.9
    )
    gate = bays.gate(width=1.9, height=2.3, depth=0.2)
    openings.replace_by_bay(2, x=2.6, width=2.6, bay=gate)
    openings.enclose((_RECESS_M,), bands=(foot_band(height=0.5, reach=0.08),))
    _add_frame_posts(building, hall, halls)
    _add_ribs(building, hall)


def _add_frame_posts(
    building: SportsHall, hall: Wing, halls: list[Wing]
) -> None:
    """Adds tapering posts along the walls below the eaves."""
    reach = building.frame_reach - 0.02
    for edge in (k for k in range(4) if k not in hall.gables):
        wall = hall.wall(edge)
        for start, end in free_stretches(hall, edge, halls, z=0.5):
            cells = bays.stretches(
                end - start, pitch=building.bay, margin=_END_M
            )
            for offset, _ in cells[1:]:
                left, right = around(start + offset, _POST_HALF_M)
                foot = outlines.rectangle(left, -0.02, right, reach)
                head = outlines.rectangle(left, -0.02, right, 0.3 * reach)
                post = solids.frustum(foot, head, z0=0.0, z1=hall.wall_top)
                root = wall.standing(x=(left, right), y=(-0.02, reach), z1=0.0)
                building.add_to("frames", root, wall.place(post))


def _add_ribs(building: SportsHall, hall: Wing) -> None:
    """Adds ribs over the roof, in line with the posts."""
    line = [(across, z + _RIB_ABOVE_M) for across, z in hall.roof_line]
    start, end = hall.ridge
    cells = bays.stretches(end - start, pitch=building.bay, margin=_END_M)
    for offset, _ in cells[1:]:
        rib_start, rib_end = around(start + offset, _RIB_HALF_M)
        rib = roofs.shell(
            line,
            start=rib_start,
            end=rib_end,
            thickness=0.25,
            along_y=hall.roof.along_y,
        )
        building.add_to("frames", rib)


def _add_annex(building: SportsHall, halls: list[Wing], y0: float) -> None:
    """Adds the low front part: an entrance between changing rooms.

    `halls` contains the halls behind it, and `y0` is the least y of the site
    [m].
    """
    x0, x1 = min(w.x0 for w in halls), max(w.x1 for w in halls)
    margin = 0.06 * (x1 - x0)
    height = building.annex_height
    area = (
        x0 + margin,
        y0 + _FORECOURT_M,
        x1 - margin,
        halls[0].y0 + 0.05,
    )
    annex = Wing.flat(area, top=height, parapet=0.4)
    openings = Openings(building, annex, halls)
    window = bays.window(width=1.6, sill=1.5, head=2.5, depth=_RECESS_M)
    openings.add_bays((0, 1, 3), z=1.0, pitch=3.6, choices=[window], margin=0.8)
    middle = annex.width / 2
    entrance_width = min(7.0, 0.35 * annex.width)
    glazing = bays.window(
        width=entrance_width - 0.6,
        sill=0.05,
        head=height - 0.8,
        depth=_RECESS_M,
        mullions=3,
    )
    openings.replace_by_bay(0, x=middle, width=entrance_width, bay=glazing)
    openings.enclose((_RECESS_M,), bands=(foot_band(height=0.3, reach=0.05),))
    z = height - 0.65
    canopy = annex.wall(0).box(
        x=around(middle, entrance_width / 2 + 1.0),
        y=(-0.02, 1.5),
        z=(z, z + 0.25),
    )
    building.add_to("frames", canopy)
    equip_roof(
        building, annex.outline, annex.floor, building.roof_items, clear=0.5
    )


def _add_porch(building: SportsHall, halls: list[Wing]) -> None:
    """Adds glass doors under a canopy on two posts, in front of the hall."""
    wall = halls[0].wall(0)
    middle = wall.length / 2
    canopy = wall.box(x=around(middle, 2.2), y=(-0.02, 1.5), z=(2.7, 3.0))
    building.add_to("frames", canopy)
    for x in around(middle, 2.1):
        post = wall.standing(x=around(x, 0.12), y=(1.2, 1.44), z1=2.75)
        building.add_to("frames", post)
    doors = wall.box(x=around(middle, 1.6), y=(-0.02, 0.1), z=(0.0, 2.5))
    building.add_to("glass", doors)
