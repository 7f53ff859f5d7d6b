"""The sports hall."""

from cns_drake.city.facades import (
    Building,
    Openings,
    Roof,
    Wing,
    around,
    bays,
    equip_roof,
    foot_band,
    free_stretches,
    outlines,
    roofs,
    solids,
)

# Depth of the windows behind the wall [m].
_RECESS_M = 0.2
# Free strip beside and behind the walls, for eaves and frames [m].
_MARGIN_M = 0.6


class SportsHall(Building):
    """The sports hall: a wide roof on frames, a low front, high windows."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        # A `butterfly` is two sheds that fall to the middle.
        self.roof = self.pick(("barrel", "gable", "shed", "butterfly"))
        # Height of the walls, as a share of the height of the ridge.
        self.wall = self.uniform(0.58, 0.7)
        # Distance between the frames.
        self.bay = max(self.uniform(5.0, 7.5), (site.width + site.depth) / 18)
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
        """Adds all parts of the sports hall, with the entrance in front.

        The building's site must be a rectangle.
        """
        x0, y0, x1, y1 = self.site.bounds
        front = y0 + (self.annex + 1.6 if self.annex else 1.8)
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
    top = building.height - 0.15
    span = (x1 - x0) if along_y else (y1 - y0)
    rise = {"barrel": 0.22 * span, "gable": 0.2 * span}.get(
        building.roof, 0.1 * span
    )
    wall = max(building.wall * top, top - 0.3 - rise)
    if building.roof != "butterfly":
        eaves = 0.0 if building.roof == "barrel" else 0.4
        roof = Roof(
            building.roof,
            along_y=along_y,
            eaves=eaves,
            verge=0.4,
            thickness=0.3,
        )
        return [Wing.at((x0, y0, x1, y1), wall_top=wall, top=top, roof=roof)]
    low, high = area, area
    if along_y:
        middle = (x0 + x1) / 2
        low, high = (x0, y0, middle + 0.02, y1), (middle - 0.02, y0, x1, y1)
    else:
        middle = (y0 + y1) / 2
        low, high = (x0, y0, x1, middle + 0.02), (x0, middle - 0.02, x1, y1)
    falling = Roof(
        "shed",
        along_y=along_y,
        eaves=0.0,
        verge=0.4,
        thickness=0.3,
        falling=True,
    )
    rising = Roof("shed", along_y=along_y, eaves=0.0, verge=0.4, thickness=0.3)
    return [
        Wing.at(low, wall_top=wall, top=top, roof=falling),
        Wing.at(high, wall_top=wall, top=top, roof=rising),
    ]


def _add_hall(building: SportsHall, hall: Wing, halls: list[Wing]) -> None:
    openings = Openings(building, hall, halls)
    high = hall.wall_top
    width = building.bay - 0.9
    band = bays.window(
        width=width,
        sill=high - 2.4,
        head=high - 0.6,
        depth=_RECESS_M,
        mullions=1,
    )
    low = max(
        0.5 if building.annex == 0.0 else building.annex_height + 0.4,
        0.3 * high,
    )
    tall = bays.window(
        width=width,
        sill=low,
        head=high - 0.6,
        depth=_RECESS_M,
        mullions=1,
        transom=high - 1.6,
    )
    ends = hall.gables
    sides = [k for k in range(4) if k not in ends]
    openings.add_bays(
        sides, z=high - 1.0, pitch=building.bay, choices=[band], margin=0.5
    )
    openings.add_bays(
        ends,
        z=high - 1.0,
        pitch=building.bay,
        choices=[tall if building.glazed else band],
        margin=0.9,
    )
    openings.replace_by_bay(
        2, x=2.6, width=2.6, bay=bays.gate(width=1.9, height=2.3, depth=0.2)
    )
    openings.enclose((_RECESS_M,), bands=(foot_band(height=0.5, reach=0.08),))
    _add_frames(building, hall, halls)


def _add_frames(building: SportsHall, hall: Wing, halls: list[Wing]) -> None:
    """Adds posts along the walls, and ribs over the roof."""
    reach = building.frame_reach - 0.02
    for edge in (k for k in range(4) if k not in hall.gables):
        wall = hall.wall(edge)
        for a, b in free_stretches(hall, edge, halls, z=0.5):
            for u, _ in bays.stretches(b - a, pitch=building.bay, margin=0.5)[
                1:
            ]:
                left, right = a + u - 0.2, a + u + 0.2
                foot = outlines.rectangle(left, -0.02, right, reach)
                head = outlines.rectangle(left, -0.02, right, 0.3 * reach)
                post = solids.frustum(foot, head, z0=0.0, z1=hall.wall_top)
                root = wall.standing(x=(left, right), y=(-0.02, reach), z1=0.0)
                building.add_to("frames", root, wall.place(post))
    line = [(u, z + 0.15) for u, z in hall.roof_line]
    start, end = hall.ridge
    for u, _ in bays.stretches(end - start, pitch=building.bay, margin=0.5)[1:]:
        ends = (start + u - 0.18, start + u + 0.18)
        rib = roofs.shell(line, *ends, 0.25, along_y=hall.roof.along_y)
        building.add_to("frames", rib)


def _add_annex(building: SportsHall, halls: list[Wing], y0: float) -> None:
    """Adds the low front part: an entrance between changing rooms."""
    x0, x1 = min(w.x0 for w in halls), max(w.x1 for w in halls)
    margin = 0.06 * (x1 - x0)
    h = building.annex_height
    area = (x0 + margin, y0 + 1.6, x1 - margin, halls[0].y0 + 0.05)
    annex = Wing.flat(area, top=h, parapet=0.4)
    openings = Openings(building, annex, halls)
    small = bays.window(width=1.6, sill=1.5, head=2.5, depth=_RECESS_M)
    openings.add_bays((0, 1, 3), z=1.0, pitch=3.6, choices=[small], margin=0.8)
    middle = annex.width / 2
    wide = min(7.0, 0.35 * annex.width)
    glazing = bays.window(
        width=wide - 0.6, sill=0.05, head=h - 0.8, depth=_RECESS_M, mullions=3
    )
    openings.replace_by_bay(0, x=middle, width=wide, bay=glazing)
    openings.enclose((_RECESS_M,), bands=(foot_band(height=0.3, reach=0.05),))
    z = h - 0.65
    half = wide / 2 + 1.0
    building.add_to(
        "frames",
        annex.wall(0).box(
            x=around(middle, half), y=(-0.02, 1.5), z=(z, z + 0.25)
        ),
    )
    equip_roof(
        building, annex.outline, annex.floor, building.roof_items, clear=0.5
    )


def _add_porch(building: SportsHall, halls: list[Wing]) -> None:
    wall = halls[0].wall(0)
    x = wall.length / 2
    building.add_to(
        "frames", wall.box(x=around(x, 2.2), y=(-0.02, 1.5), z=(2.7, 3.0))
    )
    for u in (x - 2.1, x + 2.1):
        post = wall.standing(x=around(u, 0.12), y=(1.2, 1.44), z1=2.75)
        building.add_to("frames", post)
    building.add_to(
        "glass", wall.box(x=around(x, 1.6), y=(-0.02, 0.1), z=(0.0, 2.5))
    )
