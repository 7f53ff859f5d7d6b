"""Blocks of flats: around a court, around a stair, and in a garden."""

import itertools

import numpy as np

from cns_drake.city.buildings.house_heights import (
    ROOF_M,
    storeys_for,
    wall_top_for,
)
from cns_drake.city.facades import (
    Band,
    Building,
    Facade,
    Layout,
    Openings,
    Relief,
    Roof,
    WallFrame,
    Wing,
    add_chimney,
    balconies,
    bays,
    equip_roof,
    outlines,
    porches,
    roofs,
    solids,
    tiers,
    wing_roofs,
    wing_walls,
)
from cns_drake.city.geometry import Mesh, MeshShape, merge_meshes


class CourtBlock(Building):
    """The court block: wings around a court, a mansard roof with dormers."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        range_depth = self.uniform(10.0, 12.5)
        run = 1.3 * site.open_length
        self.shape = "U" if site.width > 30.0 and self.chance(0.7) else "L"
        self.mirrored = self.chance(0.5)
        self.wing = round(min(range_depth, 0.34 * site.width), 1)
        self.back = round(min(range_depth + 0.8, 0.5 * site.depth), 1)
        self.ground_height = self.uniform(3.8, 4.4, 2)
        self.storey_height = self.uniform(3.0, 3.4)
        self.pitch = max(self.uniform(2.4, 3.2), run / 52)
        self.window_width = self.uniform(0.95, 1.25, 2)
        self.recess = self.uniform(0.15, 0.28, 2)
        self.oriel_every = self.whole(2, 5)
        self.oriel_reach = self.uniform(0.7, 1.0, 2)
        self.mansard_height = self.uniform(3.6, 4.8, 1)
        self.mansard_inset = self.uniform(1.6, 2.2, 2)
        self.dormer_pitch = max(self.uniform(4.5, 6.5), run / 26)
        self.chimneys = self.whole(3, 7)
        self.gate_height = self.uniform(3.2, 3.6, 2)

    def build(self) -> None:
        """Adds all parts of the court block, whose court is open to the back.

        The building's site must be a rectangle.
        """
        form = outlines.u_shape if self.shape == "U" else outlines.l_shape
        plan = form(*self.site.bounds, self.wing, self.back)
        if self.mirrored:
            plan = outlines.mirrored(plan)
        bottom = _add_ground(self, plan)
        eaves = self.height - self.mansard_height
        groups, per_group, storey = tiers.storey_groups(
            eaves - bottom, self.storey_height
        )
        size = (self.window_width, 0.8, storey - 0.55, self.recess)
        windows = bays.rhythm(self.pitch, [bays.window(*size)], 0.8)
        framed = bays.rhythm(self.pitch, [bays.window(*size, ledge=0.1)], 0.8)
        band = Band(storey - 0.15, storey, -0.07)
        layout = {0: framed}
        walls = Facade(
            storey, (band,), bays.by_edge(layout, windows), (self.recess,)
        )
        top = tiers.add_storeys(self, plan, walls, bottom, groups, per_group)
        _add_oriels(self, plan, bottom, groups * per_group, storey)
        self.add(
            "mansard",
            *_mansard(self, plan, top, self.rng),
            finish=self.colours["roof"],
        )


def _add_ground(p: CourtBlock, plan: np.ndarray) -> float:
    h = p.ground_height
    shops = bays.rhythm(1.7 * p.pitch, [bays.shop_front(h - 0.9, 0.3)], 0.7)
    window = bays.window(p.window_width, 1.2, h - 0.9, 0.3)
    flats = bays.rhythm(1.6 * p.pitch, [window], 0.8)
    front = bays.with_middle(shops, bays.gate(3.2, p.gate_height, 2.4), 5.0)
    layout = bays.by_edge({0: front}, flats)
    bands = (Band(0.0, 0.5, -0.08), Band(h - 0.4, h, -0.16))
    return tiers.add_ground(p, plan, Facade(h, bands, layout, (0.3,)))


def _add_oriels(
    p: CourtBlock, plan: np.ndarray, z0: float, count: int, storey: float
) -> None:
    """Adds bay windows to the street front, from the first floor upwards."""
    half = 0.75
    r = p.oriel_reach
    outline = [(-half - 0.5, 0.0), (-half, -r), (half, -r), (half + 0.5, 0.0)]
    floor = Facade(storey, (Band(0.9, storey - 0.5, 0.14),))
    height = count * storey
    oriel = merge_meshes(
        tiers.lidded_walls(outline, floor.stacked(count), 0.0),
        solids.flat(outline, 0.0, up=False),
        solids.spire(outline, (0.0, 0.0), height, height + 0.6),
    )
    shape = MeshShape(p.define("oriel", oriel))
    wall = WallFrame(plan, 0)
    cells = bays.stretches(wall.length, p.pitch, 0.8)[1:-1]
    step = max(p.oriel_every, len(cells) // 5)
    for k, (a, b) in enumerate(cells[::step]):
        x, y = wall.point((a + b) / 2, 0.0)
        p.place(f"oriel_{k}", shape, (x, y, z0), wall.heading)


def _mansard(
    p: CourtBlock, plan: np.ndarray, z0: float, rng: np.random.Generator
) -> list[Mesh]:
    eaves = outlines.inset(plan, -0.5)
    knee = outlines.inset(plan, p.mansard_inset - 0.6)
    slope = min(1.6, p.wing / 2 - p.mansard_inset - 0.4)
    ridge = outlines.inset(plan, p.mansard_inset + slope)
    z1 = z0 + 0.3
    z2, z3 = p.height - 0.9, p.height
    pieces = [
        solids.skirt(eaves, eaves, z0, z1),
        solids.flat(eaves, z0, up=False),
        solids.skirt(eaves, outlines.inset(plan, 0.0), z1, z1),
        solids.skirt(plan, knee, z1, z2),
        solids.skirt(knee, ridge, z2, z3),
        solids.flat(ridge, z3),
    ]
    for edge in range(len(plan)):
        wall = WallFrame(plan, edge)
        for a, b in bays.stretches(wall.length, p.dormer_pitch, 2.5):
            dormer = _dormer(p, round((a + b) / 2, 2), z1, z2)
            pieces.append(wall.place(dormer))
    middle = (plan[0] + plan[1]) / 2
    for k in range(p.chimneys):
        x = plan[0, 0] + (k + 0.5) / p.chimneys * (plan[1, 0] - plan[0, 0])
        y = middle[1] + p.mansard_inset + 2.4 + float(rng.uniform(0.0, 1.5))
        stack = (x - 0.6, x + 0.6, y - 0.35, y + 0.35)
        pieces.append(solids.box(*stack, z2, p.height, bottom=False))
    return pieces


def _dormer(p: CourtBlock, x: float, z0: float, z1: float) -> Mesh:
    """Returns a dormer whose back is in the roof, in wall coordinates."""
    low, high = z0 + 0.4, min(z0 + 2.4, z1 - 0.2)
    deep = p.mansard_inset
    body = [
        (x - 0.7, -deep),
        (x + 0.7, -deep),
        (x + 0.7, -0.1),
        (x - 0.7, -0.1),
    ]
    walls = solids.skirt(body, body, low, high)
    lid = solids.box(x - 0.9, x + 0.9, -deep, 0.15, high, high + 0.2)
    # Left out: the back wall, which is inside the roof. The sill stands in
    # front of the window.
    front = Mesh(walls.vertices, walls.faces[1:])
    sill = solids.box(x - 0.8, x + 0.8, -0.6, 0.05, low - 0.15, low + 0.1)
    return merge_meshes(front, lid, sill)


# Room in front of the walls for steps [m].
_FRONT_M = 1.5
# Room behind the walls for eaves [m].
_BACK_M = 0.5


class WalkUp(Building):
    """The walk-up: brick flats around a stair, behind a raised entrance."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        depth = site.depth - _FRONT_M - _BACK_M
        is_free = not {1, 3} & site.blind_edges
        # Rise of a hipped roof; 0 for a flat one.
        self.rise = 0.0
        if is_free and depth < 16.0 and self.chance(0.4):
            rise = 0.3 * min(depth, site.width)
            self.rise = round(rise, 2) if self.height - rise >= 7.0 else 0.0
        self.roof = "hip" if self.rise > 0 else "flat"
        self.floor = self.uniform(0.5, 1.1, 2)
        self.storey = self.uniform(2.8, 3.1)
        # Wanted length of front for each stair.
        self.section = self.uniform(11.0, 15.0)
        # How far the bays of the front stand out; 0 for none.
        self.bay_reach = self.pick((0.0, 0.4, 0.6))
        self.pitch = max(self.uniform(2.1, 2.8), (site.width + depth) / 17)
        self.window_width = self.uniform(1.0, 1.5, 2)
        self.recess = self.uniform(0.14, 0.26, 2)
        # Whether the windows of the ground floor are arched.
        self.arched = self.chance(0.3)
        self.ledge = self.pick((0.0, 0.08))
        self.hood = self.pick((0.0, 0.08))
        self.cornice = self.uniform(0.15, 0.45, 2)
        self.roof_items = self.draw_roof_items(
            "stair_house vents tank skylight", 1, 5
        )

    def build(self) -> None:
        """Adds all parts of the walk-up flats.

        The building's site must be a rectangle.
        """
        site = self.site
        x0, y0, x1, y1 = site.bounds
        left = x0 + 0.5 * (3 not in site.blind_edges)
        right = x1 - 0.5 * (1 not in site.blind_edges)
        body = outlines.rectangle(left, y0 + _FRONT_M, right, y1 - _BACK_M)
        plan, stairs = _bay_front(self, body)
        site_outline = outlines.rectangle(x0, y0, x1, y1)
        blind = outlines.edges_on(plan, site_outline, site.blind_edges)
        top = _add_walk_up_ground(self, plan, stairs, blind)
        goal = self.height - self.rise - (0.9 if self.roof == "flat" else 0.15)
        groups, per_group, storey = tiers.storey_groups(
            goal - top, self.storey, 6
        )
        window = bays.window(
            self.window_width, 0.8, min(2.3, storey - 0.4), self.recess,
            ledge=self.ledge, hood=self.hood,
        )  # fmt: skip
        rows = bays.rhythm(self.pitch, [window], 0.45)
        landing = bays.window(1.1, storey - 1.0, storey - 0.05, self.recess)
        layouts = dict.fromkeys(stairs, bays.with_middle(rows, landing, 2.2))
        layout = bays.by_edge(layouts, rows)
        walls = Facade(storey, (), layout, (self.recess,), blind)
        top = tiers.add_storeys(self, plan, walls, top, groups, per_group)
        _add_top(self, body, plan, top, blind)


def _bay_front(p: WalkUp, body: np.ndarray) -> tuple[np.ndarray, list[int]]:
    """Returns the outline with bays in front, and the walls with stairs."""
    (x0, y0), (x1, y1) = body[0], body[2]
    count = max(1, round((x1 - x0) / p.section))
    bounds = np.linspace(x0, x1, count + 1)
    if p.bay_reach == 0.0 or (x1 - x0) / count < 9.0:
        return body, [0] if count == 1 else []
    points: list[tuple[float, float]] = []
    stairs = []
    for a, b in itertools.pairwise(bounds):
        # Bays left and right of the stair, clear of the party walls.
        third = 0.3 * (b - a)
        for start, end in ((a + 0.9, a + third), (b - third, b - 0.9)):
            start, end = round(start, 2), round(end, 2)
            points += [(start, y0), (start, y0 - p.bay_reach),
                       (end, y0 - p.bay_reach), (end, y0)]  # fmt: skip
        stairs.append(len(points) - 5 + 1)
    plan = [(x0, y0), *points, (x1, y0), (x1, y1), (x0, y1)]
    return np.array(plan), stairs


def _add_walk_up_ground(
    p: WalkUp, plan: np.ndarray, stairs: list[int], blind: frozenset[int]
) -> float:
    """Adds the raised ground floor with its entrances and steps."""
    h = round(p.floor + p.storey, 2)
    sill, head = round(p.floor + 0.8, 2), round(p.floor + 2.25, 2)
    if p.arched:
        width = min(p.window_width, 1.2)
        window = bays.arched(width, sill, head - width / 2, p.recess)
    else:
        window = bays.window(p.window_width, sill, head, p.recess)
    rows = bays.rhythm(p.pitch, [window], 0.45)
    door = bays.house_door(1.4, p.floor, round(p.floor + 2.35, 2), 0.4)
    vent = bays.window(0.9, 0.1, p.floor - 0.15, 0.15)
    cellar = bays.rhythm(2 * p.pitch, [vent], 0.5)
    doors = stairs or [0]
    entries = dict.fromkeys(doors, bays.with_middle(rows, door, 2.4))
    others = _combined_layout(rows, cellar) if p.floor > 0.7 else rows
    layout = bays.by_edge({0: rows} | entries, others)
    bands = (Band(p.floor, p.floor + 0.12, -0.08), Band(h - 0.2, h, -0.08))
    pieces: list[Mesh] = []
    room = _FRONT_M - p.bay_reach * (not stairs) - 0.05
    for edge in doors:
        pieces += _steps(p, WallFrame(plan, edge), room)
    p.add("steps", *pieces, finish=p.colours["base"])
    return tiers.add_ground(
        p, plan, Facade(h, bands, layout, (p.recess,), blind)
    )


def _steps(p: WalkUp, wall: WallFrame, room: float) -> list[Mesh]:
    """Returns the steps up to a door, between cheeks and under a hood."""
    x = wall.length / 2
    count = max(2, round(p.floor / 0.17))
    run = min(0.28 * count, room - 0.3)
    flight = porches.steps(x - 0.8, x + 0.8, run, p.floor, count)
    slab = (x - 1.1, x + 1.1, -0.05, room - run, p.floor)
    hood = (x - 1.2, x + 1.2, -0.05, 0.9, p.floor + 2.5, p.floor + 2.7)
    cheeks = (
        wall.standing(
            u - 0.12, u + 0.12, -0.05, room, p.floor + 0.35, bottom=True
        )
        for u in (x - 0.98, x + 0.98)
    )
    return [
        wall.standing(*slab, bottom=True),
        wall.place(flight.moved((0.0, room - run, 0.0))),
        wall.box(*hood),
        *cheeks,
    ]


def _add_top(
    p: WalkUp,
    body: np.ndarray,
    plan: np.ndarray,
    z0: float,
    blind: frozenset[int],
) -> None:
    if p.roof == "flat":
        rim = round(p.height - z0, 3)
        top = max(rim - 0.15, 0.5)
        bands = tiers.cornice(top, p.cornice, thickness=0.4, steps=2)
        crown = Facade(rim, bands, plain=blind)
        parapet = min(0.6, rim - 0.1)
        z = tiers.add_crown(p, plan, crown, z0, parapet, thickness=0.25)
        equip_roof(p, body, z, p.roof_items)
        return
    eaves = (max(p.bay_reach + 0.15, 0.45), 0.45, 0.45, 0.45)
    solid = roofs.hip(body, z0 - 0.02, p.height, eaves, 0.3)
    p.add("roof", solid, finish=p.colours["roof"])
    (ax, ay), (bx, by) = body[0], body[2]
    for k, share in enumerate((0.35, 0.65)):
        x, y = ax + share * (bx - ax), ay + 0.5 * (by - ay)
        if by - ay > bx - ax:
            x, y = ax + 0.5 * (bx - ax), ay + share * (by - ay)
        spot = (x, y, p.height - 1.4)
        brick = p.kind.choices["bricks"][k]
        add_chimney(p, f"chimney_{k}", spot, brick, item="chimney_row")


def _combined_layout(first: Layout, second: Layout) -> Layout:
    """Returns a layout with the reliefs of two layouts that do not overlap."""

    def layout(edge: int, length: float) -> list[Relief]:
        return [*first(edge, length), *second(edge, length)]

    return layout


_MARGIN = 0.5
_FLOOR = 0.3


class GardenFlats(Building):
    """Flats in a garden: staggered houses under gables, stacks of verandas."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        self.roof = self.pick(("gable", "gable", "hip"))
        # Wanted slope of the roofs.
        self.pitch_deg = self.uniform(22.0, 34.0)
        # Wanted length of front for each house of the group.
        self.section = self.uniform(11.0, 15.0)
        # Distance by which every other house stands back.
        self.stagger = round(self.uniform(0.0, 0.16) * site.depth, 2)
        # Whether every other house turns its gable to the front.
        self.crossed = self.chance(0.5)
        self.window_pitch = max(self.uniform(2.6, 3.4), site.width / 12)
        self.window_width = self.uniform(1.1, 1.6, 2)
        self.veranda_width = self.uniform(2.8, 4.0, 2)
        self.veranda_reach = self.uniform(1.4, 1.9, 2)
        self.casing = "sill"
        if site.width < 20.0:
            self.casing = self.pick(("frame", "sill"))

    def build(self) -> None:
        """Adds all parts of the houses, side by side along the front.

        The building's site must be a rectangle.
        """
        x0, y0, x1, y1 = self.site.bounds
        left, right = x0 + _MARGIN, x1 - _MARGIN
        count = max(1, round((right - left) / self.section))
        bounds = np.linspace(left, right, count + 1)
        front = y0 + self.veranda_reach + 0.4
        deep = min(y1 - _MARGIN - front - self.stagger, 13.0)
        storeys = storeys_for(self.height, _FLOOR, deep, self.pitch_deg)
        storeys = max(2, storeys)
        wall_top = wall_top_for(self.height, _FLOOR, deep, storeys)
        boxes = []
        for k in range(count):
            y = front + self.stagger * (k % 2)
            top = self.height
            cross = False
            if k % 2 and self.crossed:
                cross = True
                run = (bounds[1] - bounds[0]) / 2
                slope = 2 * (self.height - wall_top - ROOF_M) / deep
                top = min(wall_top + ROOF_M + slope * run, self.height - 0.1)
            shape = Roof(self.roof, cross, 0.4, 0.35, ROOF_M)
            area = (bounds[k] - 0.05 * (k > 0), y, bounds[k + 1], y + deep)
            boxes.append(Wing.at(area, wall_top, top, shape))
        for k, wing in enumerate(boxes):
            _add_house(self, wing, boxes, storeys, k)


def _add_house(
    p: GardenFlats, wing: Wing, boxes: list[Wing], storeys: int, number: int
) -> None:
    openings = Openings(p, wing, boxes)
    storey = (wing.wall_top - 0.15 - _FLOOR) / storeys
    head = min(2.2, storey - 0.4)
    for edges, pitch in (((0, 2), p.window_pitch), ((1, 3), 4.5)):
        openings.add_window_storeys(
            edges,
            _FLOOR,
            storey,
            storeys,
            pitch,
            p.window_width,
            head=head,
        )
    wall = wing.wall(0)
    middle = wall.length / 2
    glass = wing_walls.GLASS_M
    openings.clear(0, middle - 1.1, middle + 1.1, 0.0, wing.wall_top)
    if wing.wall_top > 6.0:
        stair = bays.window(1.8, _FLOOR + 2.6, wing.wall_top - 0.7, glass)
        openings.replace_by_bay(0, middle, 2.6, stair)
    openings.add_door(0, middle, _FLOOR, width=1.2, lights=0.4)
    area = (middle - 1.4, middle + 1.4, -0.05, 1.3)
    p.add_to("trim", wall.box(*area, _FLOOR + 2.3, _FLOOR + 2.5))
    p.add_to("base", wall.standing(*area, _FLOOR, bottom=True))
    _add_verandas(p, wing, storeys, storey, number)
    openings.add_casings((0,), p.casing)
    z = round(_FLOOR + storey, 2)
    bands = (Band(0.0, _FLOOR, -0.05), Band(z - 0.2, z, -0.05))
    low = wing.wall_top + 0.4
    attic = wing_roofs.attic_window(0.9, low, low + 1.0, glass, 2)
    openings.enclose((glass,), bands, attic=attic)
    if not wing.roof.along_y:
        x, y = wing.x0 + 0.3 * wall.length, wing.center[1]
        spot = (x, y, wing.top - 1.3)
        brick = p.kind.choices["bricks"][0]
        add_chimney(p, f"chimney_{number}", spot, brick)


def _add_verandas(
    p: GardenFlats, wing: Wing, storeys: int, storey: float, number: int
) -> None:
    """Adds verandas above one another, left and right of the entrance."""
    wall = wing.wall(0)
    width = min(p.veranda_width, wall.length / 2 - 2.2)
    if width < 2.0:
        return
    reach = p.veranda_reach
    top = wing.wall_top - 0.1
    pieces, frame = [], []
    for x in (0.9 + width / 2, wall.length - 0.9 - width / 2):
        a, b = round(x - width / 2, 2), round(x + width / 2, 2)
        pieces.append(wall.place(balconies.balcony(a, b, reach, 0.0, 1.0)))
        for u in (a + 0.1, b - 0.1):
            spot = (u - 0.09, u + 0.09, reach - 0.2, reach - 0.02)
            frame.append(wall.standing(*spot, top - 0.1))
        lid = (a - 0.1, b + 0.1, -0.05, reach + 0.1, top - 0.25, top)
        frame.append(wall.box(*lid))
    part = f"house_{number}"
    trim = p.colours["trim"]
    mesh = merge_meshes(*pieces)
    shape = MeshShape(p.define(f"{part}_verandas", mesh))
    for k in range(1, storeys):
        at = (0.0, 0.0, _FLOOR + k * storey)
        p.place(f"{part}_verandas_{k}", shape, at, finish=trim)
    p.add(f"{part}_posts", *frame, finish=trim)
