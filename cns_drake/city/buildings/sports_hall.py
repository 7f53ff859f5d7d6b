"""The sports hall."""

from cns_drake.city.facades import (
    Building,
    Openings,
    Roof,
    Wing,
    bays,
    equip_roof,
    free_stretches,
    outlines,
    roofs,
    solids,
)
from cns_drake.city.facades.reliefs import Band

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
        self.frame_reach = self.uniform(0.35, 0.6, 2)
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
            "air_handler vents ac_unit", 1, 4
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


def _halls(p: SportsHall, area: outlines.Area, along_y: bool) -> list[Wing]:
    """Returns the hall: two halves under a butterfly roof, or one wing."""
    x0, y0, x1, y1 = area
    top = p.height - 0.15
    span = (x1 - x0) if along_y else (y1 - y0)
    rise = {"barrel": 0.22 * span, "gable": 0.2 * span}.get(p.roof, 0.1 * span)
    wall = max(p.wall * top, top - 0.3 - rise)
    if p.roof != "butterfly":
        eaves = 0.0 if p.roof == "barrel" else 0.4
        roof = Roof(p.roof, along_y, eaves, 0.4, 0.3)
        return [Wing.at((x0, y0, x1, y1), wall, top, roof)]
    low, high = area, area
    if along_y:
        middle = (x0 + x1) / 2
        low, high = (x0, y0, middle + 0.02, y1), (middle - 0.02, y0, x1, y1)
    else:
        middle = (y0 + y1) / 2
        low, high = (x0, y0, x1, middle + 0.02), (x0, middle - 0.02, x1, y1)
    falling = Roof("shed", along_y, 0.0, 0.4, 0.3, falling=True)
    rising = Roof("shed", along_y, 0.0, 0.4, 0.3)
    return [Wing.at(low, wall, top, falling), Wing.at(high, wall, top, rising)]


def _add_hall(p: SportsHall, hall: Wing, halls: list[Wing]) -> None:
    openings = Openings(p, hall, halls)
    high = hall.wall_top
    width = p.bay - 0.9
    band = bays.window(width, high - 2.4, high - 0.6, _RECESS_M, mullions=1)
    low = max(0.5 if p.annex == 0.0 else p.annex_height + 0.4, 0.3 * high)
    tall = bays.window(
        width, low, high - 0.6, _RECESS_M, mullions=1, transom=high - 1.6
    )
    ends = hall.gables
    sides = [k for k in range(4) if k not in ends]
    openings.add_bays(sides, high - 1.0, p.bay, [band], 0.5)
    openings.add_bays(
        ends, high - 1.0, p.bay, [tall if p.glazed else band], 0.9
    )
    openings.replace_by_bay(2, 2.6, 2.6, bays.gate(1.9, 2.3, 0.2))
    openings.enclose((_RECESS_M,), (Band(0.0, 0.5, -0.08),))
    _add_frames(p, hall, halls)


def _add_frames(p: SportsHall, hall: Wing, halls: list[Wing]) -> None:
    """Adds posts along the walls, and ribs over the roof."""
    reach = p.frame_reach - 0.02
    for edge in (k for k in range(4) if k not in hall.gables):
        wall = hall.wall(edge)
        for a, b in free_stretches(hall, edge, halls, 0.5):
            for u, _ in bays.stretches(b - a, p.bay, 0.5)[1:]:
                left, right = a + u - 0.2, a + u + 0.2
                foot = outlines.rectangle(left, -0.02, right, reach)
                head = outlines.rectangle(left, -0.02, right, 0.3 * reach)
                post = solids.frustum(foot, head, 0.0, hall.wall_top)
                root = wall.standing(left, right, -0.02, reach, 0.0)
                p.add_to("frames", root, wall.place(post))
    line = [(u, z + 0.15) for u, z in hall.roof_line]
    start, end = hall.ridge
    for u, _ in bays.stretches(end - start, p.bay, 0.5)[1:]:
        ends = (start + u - 0.18, start + u + 0.18)
        rib = roofs.shell(line, *ends, 0.25, along_y=hall.roof.along_y)
        p.add_to("frames", rib)


def _add_annex(p: SportsHall, halls: list[Wing], y0: float) -> None:
    """Adds the low front part: an entrance between changing rooms."""
    x0, x1 = min(w.x0 for w in halls), max(w.x1 for w in halls)
    margin = 0.06 * (x1 - x0)
    h = p.annex_height
    area = (x0 + margin, y0 + 1.6, x1 - margin, halls[0].y0 + 0.05)
    annex = Wing.flat(area, h, 0.4)
    openings = Openings(p, annex, halls)
    small = bays.window(1.6, 1.5, 2.5, _RECESS_M)
    openings.add_bays((0, 1, 3), 1.0, 3.6, [small], 0.8)
    middle = annex.width / 2
    wide = min(7.0, 0.35 * annex.width)
    glazing = bays.window(wide - 0.6, 0.05, h - 0.8, _RECESS_M, mullions=3)
    openings.replace_by_bay(0, middle, wide, glazing)
    openings.enclose((_RECESS_M,), (Band(0.0, 0.3, -0.05),))
    z = h - 0.65
    half = wide / 2 + 1.0
    lid = (middle - half, middle + half, -0.02, 1.5, z, z + 0.25)
    p.add_to("frames", annex.wall(0).box(*lid))
    equip_roof(p, annex.outline, annex.floor, p.roof_items, clear=0.5)


def _add_porch(p: SportsHall, halls: list[Wing]) -> None:
    wall = halls[0].wall(0)
    x = wall.length / 2
    p.add_to("frames", wall.box(x - 2.2, x + 2.2, -0.02, 1.5, 2.7, 3.0))
    for u in (x - 2.1, x + 2.1):
        post = wall.standing(u - 0.12, u + 0.12, 1.2, 1.44, 2.75)
        p.add_to("frames", post)
    p.add_to("glass", wall.box(x - 1.6, x + 1.6, -0.02, 0.1, 0.0, 2.5))
