"""Halls under one wide roof: barns, sports halls and waterfront sheds."""

import itertools

import numpy as np

from cns_drake.city.facades import (
    Building,
    Openings,
    Roof,
    WallFrame,
    Wing,
    bays,
    boards,
    equip_roof,
    free_stretches,
    outlines,
    piers,
    porches,
    roofs,
    solids,
    walls,
    wing_roofs,
)
from cns_drake.city.geometry.mesh import Mesh, merge_meshes

_MARGIN = 0.5
_RECESS = 0.15


class Barn(Building):
    """The barn or boat house: timber boards, wide doors, a lean-to."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        width = min(site.width, site.depth)
        aisle = round(self.uniform(0.2, 0.28) * width, 2)
        self.roof = self.pick(("gambrel", "gable", "gable", "barrel"))
        # Height of the walls, as a part of the ridge's.
        self.wall = self.uniform(0.42, 0.58)
        # Room in front, a jetty of a boat house; 0 for a barn.
        self.deck = self.pick((0.0, 0.0, 2.0)) if site.depth > 10.0 else 0.0
        self.door_width = self.uniform(2.6, 4.4, 2)
        self.door_height = self.uniform(2.4, 3.4, 2)
        # Width of the lean-to on one side; 0 for none.
        self.aisle = aisle if self.chance(0.6) and width > 9.0 else 0.0
        self.aisle_left = self.chance(0.5)
        # Distance between battens.
        self.batten = self.uniform(1.0, 1.6)
        self.ventilators = self.whole(0, 3)

    def build(self) -> None:
        """Adds all parts of the barn, which lies along the site's longer sides.

        The building's site must be a rectangle.
        """
        x0, y0, x1, y1 = self.site.bounds
        along_y = y1 - y0 >= x1 - x0
        left, right = x0 + _MARGIN, x1 - _MARGIN
        front = y0 + _MARGIN + self.deck
        back = y1 - _MARGIN
        a, b, low, high = left, right, front, back
        if along_y:
            a += self.aisle * self.aisle_left
            b -= self.aisle * (not self.aisle_left)
        else:
            high -= self.aisle
        top = self.height - (0.7 if self.ventilators else 0.0)
        half = ((b - a) if along_y else (high - low)) / 2
        wall_top = max(2.3, self.wall * top)
        eaves = 0.35
        if self.roof == "barrel":
            # A vault is at most half a circle.
            eaves = 0.0
            wall_top = max(wall_top, top - 0.8 * half)
        roof = Roof(self.roof, along_y, eaves, 0.35, 0.18)
        main = Wing.at((a, low, b, high), wall_top, top, roof)
        boxes = [main]
        if self.aisle > 1.5:
            boxes.append(_aisle(self, main, (left, right, back)))
        for wing in boxes:
            _add_box(self, wing, boxes)
        _add_ridge(self, main)
        if self.deck > 0:
            _add_jetty(self, (left, right), y0, front)


def _add_box(p: Barn, wing: Wing, boxes: list[Wing]) -> None:
    """Adds the main box of the barn with its doors, or the lean-to."""
    openings = Openings(p, wing, boxes)
    head = round(min(2.0, wing.wall_top - 0.3), 2)
    window = bays.window(0.9, 1.1, head, _RECESS)
    openings.add_bays(range(4), 1.0, 3.2, [window], 0.8)
    if wing is boxes[0]:
        for edge in (0,) if wing.roof.along_y else (3, 0):
            _add_doors(p, wing, openings, edge)
    low = wing.wall_top + 0.5
    attic = wing_roofs.attic_window(1.0, low, low + 1.3, _RECESS)
    openings.enclose((_RECESS,), (walls.Band(0.0, 0.3, -0.06),), attic=attic)
    for edge in range(4):
        _add_battens(p, wing, boxes, openings, edge)


def _aisle(p: Barn, main: Wing, limits: tuple[float, float, float]) -> Wing:
    """Returns the lean-to against the long side of the barn."""
    left, right, back = limits
    along_y = main.roof.along_y
    high = main.wall_top + 0.1
    low = max(1.9, high - 0.3 * p.aisle)
    high = max(high, low + 0.25)
    # The lean-to stands behind or beside the barn: the side to which its roof
    # falls.
    area = (main.x0 + 1.0, main.y1 - 0.05, main.x1 - 1.0, back)
    if along_y:
        a, b = main.x1 - 0.05, right
        if p.aisle_left:
            a, b = left, main.x0 + 0.05
        area = (a, main.y0 + 0.8, b, main.y1 - 0.8)
    falling = not (along_y and p.aisle_left)
    roof = Roof("shed", along_y, 0.3, 0.25, 0.15, falling=falling)
    return Wing.at(area, low, high, roof)


def _add_doors(p: Barn, wing: Wing, openings: Openings, edge: int) -> None:
    """Adds a pair of braced doors that slide along the wall."""
    wall = wing.wall(edge)
    width = min(p.door_width, 0.5 * wall.length)
    height = min(p.door_height, wing.wall_top - 0.35)
    x = wall.length / 2
    openings.clear(edge, x - width - 0.2, x + width + 0.2, 0.0, height + 0.4)
    if p.deck > 0 and edge == 0:
        gap = walls.Patch(x - width / 2, x + width / 2, 0.0, height, 2.0)
        openings.replace_by_bay(edge, x, width + 0.4, lambda a, b: [gap])
        spots = (x - width, x + width / 2 + 0.05)
        half = width / 2 - 0.05
    else:
        spots = (x - width / 2, x + 0.03)
        half = width / 2 - 0.03
    for a in spots:
        b = a + half
        brace = (a + 0.1, 0.1, 0.2), (b - 0.1, 0.1, height - 0.1)
        frame = [
            boards.board(a, a + 0.18, 0.08, height, 0.15),
            boards.board(b - 0.18, b, 0.08, height, 0.15),
            boards.board(a, b, height - 0.18, height, 0.15),
            boards.board(a, b, 0.08, 0.26, 0.15),
            solids.beam(*brace, 0.1),
        ]
        leaf = boards.board(a, b, 0.08, height, 0.1)
        p.add_to("doors", wall.place(leaf))
        p.add_to("trim", *(wall.place(m) for m in frame))
    rail = (x - width - 0.1, x + width + 0.1, 0.0, 0.18)
    p.add_to("trim", wall.box(*rail, height + 0.05, height + 0.18))


def _add_battens(
    p: Barn, wing: Wing, boxes: list[Wing], openings: Openings, edge: int
) -> None:
    """Adds upright battens on the free parts of a wall between openings."""
    wall = wing.wall(edge)
    reliefs = openings.layout(edge, wall.length)
    for a, b in free_stretches(wing, edge, boxes, 0.5):
        for x, _ in bays.stretches(b - a, p.batten, 0.12):
            u = a + x
            if any(r.x0 - 0.15 < u < r.x1 + 0.15 for r in reliefs):
                continue
            strip = boards.board(u - 0.05, u + 0.05, 0.3, wing.wall_top, 0.05)
            p.add_to("walls", wall.place(strip))


def _add_ridge(p: Barn, main: Wing) -> None:
    """Adds louvred ventilators on the ridge."""
    z = main.top
    for k in range(p.ventilators):
        share = (k + 0.5) / p.ventilators - 0.5
        x, y = main.center
        if main.roof.along_y:
            y += 0.8 * share * main.depth
        else:
            x += 0.8 * share * main.width
        p.add_to("walls", solids.post(x, y, 0.45, z + 0.3, z - 0.6))
        eaves = outlines.square(x, y, 0.65)
        p.add_to("roof", solids.tent(eaves, (x, y), z + 0.3, z + 0.7))


def _add_jetty(p: Barn, xs: bays.Span, y0: float, front: float) -> None:
    """Adds a plank deck on posts in front of a boat house."""
    a, b = xs
    y = y0 + 0.1
    p.add_to("doors", solids.box(a, b, y, front, 0.05, 0.3))
    for x in np.linspace(a + 0.2, b - 0.2, 4).tolist():
        spot = (x - 0.12, x + 0.12, y + 0.02, y + 0.26)
        p.add_to("doors", solids.standing(*spot, 1.1))


_DEEP = 0.2
_RIM = 0.6


class SportsHall(Building):
    """The sports hall: a wide roof on frames, a low front, high windows."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        # A `butterfly` is two sheds that fall to the middle.
        self.roof = self.pick(("barrel", "gable", "shed", "butterfly"))
        # Height of the walls, as a part of the ridge's.
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
        area = (x0 + _RIM, front, x1 - _RIM, y1 - _RIM)
        along_y = area[3] - area[1] > area[2] - area[0]
        halls = _halls(self, area, along_y)
        for hall in halls:
            _add_hall(self, hall, halls)
        if self.annex:
            _add_annex(self, halls, y0)
        else:
            _add_porch(self, halls)


def _halls(p: SportsHall, area: outlines.Area, along_y: bool) -> list[Wing]:
    """Returns the one hall, or the two halves under a butterfly roof."""
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
    band = bays.window(width, high - 2.4, high - 0.6, _DEEP, mullions=1)
    low = max(0.5 if p.annex == 0.0 else p.annex_height + 0.4, 0.3 * high)
    tall = bays.window(
        width, low, high - 0.6, _DEEP, mullions=1, transom=high - 1.6
    )
    ends = hall.gables
    sides = [k for k in range(4) if k not in ends]
    openings.add_bays(sides, high - 1.0, p.bay, [band], 0.5)
    openings.add_bays(
        ends, high - 1.0, p.bay, [tall if p.glazed else band], 0.9
    )
    openings.replace_by_bay(2, 2.6, 2.6, bays.gate(1.9, 2.3, 0.2))
    openings.enclose((_DEEP,), (walls.Band(0.0, 0.5, -0.08),))
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
    small = bays.window(1.6, 1.5, 2.5, _DEEP)
    openings.add_bays((0, 1, 3), 1.0, 3.6, [small], 0.8)
    middle = annex.width / 2
    wide = min(7.0, 0.35 * annex.width)
    glazing = bays.window(wide - 0.6, 0.05, h - 0.8, _DEEP, mullions=3)
    openings.replace_by_bay(0, middle, wide, glazing)
    openings.enclose((_DEEP,), (walls.Band(0.0, 0.3, -0.05),))
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


class WaterfrontHall(Building):
    """The waterfront hall: a long shed with a loading dock and big doors.

    `roof` is `gable`, `barrel` or `sawtooth`; the ridge is at `height`.
    """

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        self.roof = self.pick(("gable", "barrel", "sawtooth"))
        self.dock_depth = self.uniform(2.5, 4.0, 1)
        depth = site.depth - self.dock_depth
        self.eaves = round(self.height * self.uniform(0.6, 0.7), 1)
        self.spans = max(1, round(depth / self.uniform(16.0, 22.0)))
        self.pitch = max(self.uniform(4.5, 6.0), (site.width + depth) / 15)
        self.pier_width = self.uniform(0.6, 0.9, 2)
        self.pier_reach = self.uniform(0.2, 0.34, 2)
        self.window_depth = self.uniform(0.2, 0.35, 2)
        self.door_every = self.whole(2, 4)
        self.dock_height = self.uniform(0.9, 1.2, 2)
        self.ventilators = self.whole(3, 7)

    def build(self) -> None:
        """Adds all parts of the waterfront hall, with its dock in front.

        The building's site must be a rectangle.
        """
        x0, y0, x1, y1 = self.site.bounds
        front = y0 + self.dock_depth
        plan = outlines.rectangle(x0, front, x1, y1)
        facade = _walls(self)
        pieces = [
            solids.foundation(plan),
            walls.facade_mesh(plan, facade),
            piers.wall_piers(
                plan, self.pitch, self.pier_width, self.pier_reach, 0.0,
                self.eaves - 0.5, margin=0.5 + self.pier_width / 2,
            ),
            *_dock(self, x0, x1, y0, front),
        ]  # fmt: skip
        self.add("walls", *pieces)
        self.add_glass("glass", walls.glass_mesh(plan, facade))
        self.add("roof", _roof(self, plan), finish=self.colours["roof"])


def _walls(p: WaterfrontHall) -> walls.Facade:
    """Returns walls with tall windows between piers, and doors among them."""
    head = p.eaves - 1.0
    window = bays.window(
        p.pitch - 1.6, 2.2, head, p.window_depth, mullions=1,
        transom=round((2.2 + head) / 2, 2),
    )  # fmt: skip
    door = bays.gate(p.pitch - 1.4, min(4.6, head - 0.3))
    front = bays.gate(p.pitch - 1.4, min(4.2 + p.dock_height, head - 0.3))
    choices = [front] + [window] * (p.door_every - 1)
    rows = bays.rhythm(p.pitch, [window], margin=0.5)
    layouts = {0: bays.rhythm(p.pitch, choices, margin=0.5), 2: rows}
    layout = bays.by_edge(layouts, bays.with_middle(rows, door, p.pitch))
    bands = (
        walls.Band(0.0, 0.6, -0.1),
        walls.Band(p.eaves - 0.5, p.eaves, -0.3),
    )
    return walls.Facade(p.eaves, bands, layout, (p.window_depth,))


def _dock(
    p: WaterfrontHall, x0: float, x1: float, y0: float, front: float
) -> list[Mesh]:
    """Returns a loading platform under a canopy, with steps at both ends."""
    high = p.dock_height
    a, b = x0 + 2.0, x1 - 2.0
    platform = solids.standing(a, b, y0 + 0.4, front, high, bottom=True)
    steps = porches.steps(0.0, p.dock_depth - 0.6, 1.6, high, 5)
    ends = outlines.rectangle(a, y0 + 0.4, b, front)
    pieces = [platform]
    pieces += [WallFrame(ends, k).place(steps) for k in (1, 3)]
    eaves = min(p.eaves - 0.8, high + 5.2)
    ya, za = front - p.dock_depth + 0.1, eaves - 0.5
    yb, zb = front, eaves
    section = [(ya, za), (yb, zb), (yb, zb + 0.2), (ya, za + 0.25)]
    vertices = np.array([(x, y, z) for x in (a, b) for y, z in section])
    faces = [(k, 4 + k, 4 + (k + 1) % 4, (k + 1) % 4) for k in range(4)]
    faces += [(0, 1, 2, 3), (7, 6, 5, 4)]
    pieces.append(Mesh(vertices, tuple(faces)).turned())
    for x, _ in bays.stretches(b - a, 1.5 * p.pitch, 0.3)[1:]:
        post = (a + x - 0.12, a + x + 0.12, y0 + 0.6, y0 + 0.84)
        pieces.append(solids.box(*post, high - 0.1, eaves - 0.2))
    return pieces


def _roof(p: WaterfrontHall, plan: np.ndarray) -> Mesh:
    (x0, y0), (x1, y1) = plan[0], plan[2]
    rise = p.height - p.eaves
    if p.roof == "sawtooth":
        teeth = solids.extruded(_sawtooth(x0, x1, rise), y0, y1)
        return solids.swapped(teeth).moved((0.0, 0.0, p.eaves))
    pieces = []
    edges = np.linspace(y0, y1, p.spans + 1)
    for a, b in itertools.pairwise(edges):
        shed = solids.extruded(_profile(p.roof, a, b, rise), x0, x1)
        pieces.append(shed.moved((0.0, 0.0, p.eaves)))
        pieces += _ridge(p, x0, x1, (a + b) / 2)
    return merge_meshes(*pieces)


def _ridge(p: WaterfrontHall, x0: float, x1: float, y: float) -> list[Mesh]:
    """Returns a monitor along the ridge with evenly spaced ventilators."""
    top, low = p.height - 0.25, p.height - 1.1
    length = x1 - x0
    a, b = x0 + 0.15 * length, x1 - 0.15 * length
    pieces = [solids.box(a, b, y - 0.7, y + 0.7, low, top, bottom=False)]
    for k in range(p.ventilators):
        x = a + (k + 0.5) * (b - a) / p.ventilators
        hood = (x - 0.5, x + 0.5, y - 0.9, y + 0.9)
        pieces.append(solids.box(*hood, low, p.height, bottom=False))
    return pieces


def _sawtooth(x0: float, x1: float, rise: float) -> list:
    """Returns the roof line: upright glazing, and slopes that fall from it."""
    teeth = max(2, round((x1 - x0) / 7.0))
    step = (x1 - x0) / teeth
    line = [(x0, 0.0)]
    for k in range(teeth):
        line += [(x0 + k * step, rise), (x0 + (k + 1) * step, 0.0)]
    return line


def _profile(roof: str, a: float, b: float, rise: float) -> list:
    # Leaves room for the monitor, which rises above the ridge.
    rise -= 0.6
    half, middle = (b - a) / 2, (a + b) / 2
    if roof == "gable":
        return [(a, 0.0), (middle, rise), (b, 0.0)]
    angles = np.linspace(np.pi, 0.0, 9)[1:-1]
    arc = [(middle + half * np.cos(t), rise * np.sin(t)) for t in angles]
    return [(a, 0.0), *arc, (b, 0.0)]
