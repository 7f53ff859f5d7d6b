"""Houses for one or two families, with gables or hips, porches and garages."""

from collections.abc import Sequence

import numpy as np

from cns_drake.city.buildings.house_heights import (
    ROOF_M,
    STOREY_M,
    storeys_for,
    wall_top_for,
)
from cns_drake.city.facades import (
    Band,
    Building,
    Openings,
    Roof,
    WallFrame,
    Wing,
    add_chimney,
    balconies,
    bay_windows,
    bays,
    outlines,
    porches,
    solids,
    wing_openings,
    wing_roofs,
)
from cns_drake.city.geometry.mesh import Mesh, merge_meshes

# Distance between the windows of the sides [m]. The windows of the front are
# closer together.
_SIDE_PITCH_M = 3.8


class _FamilyHouse(Building):
    """The base class of family houses.

    Attributes:
        boxes: the wings, which hide parts of each other's walls.
        floor: height of the ground floor [m].
        window_pitch: distance between the windows of front and back [m].
        window_width: width of a window [m].
        casing: style of the frames around the windows in front.
    """

    boxes: Sequence[Wing]
    floor: float
    window_pitch: float
    window_width: float
    casing: str


def _window_rows(p: _FamilyHouse, wing: Wing, storeys: int) -> Openings:
    """Returns the windows of a wing, which are further apart on its sides."""
    openings = Openings(p, wing, p.boxes)
    width = p.window_width
    for edges, step in (((0, 2), p.window_pitch), ((1, 3), _SIDE_PITCH_M)):
        wing_openings.add_window_storeys(
            openings, edges, p.floor, STOREY_M, storeys, step, width
        )
    return openings


def _close_box(p: _FamilyHouse, wing: Wing, openings: Openings) -> None:
    """Adds the walls of a wing around its openings, and its roof."""
    wing_openings.add_casings(openings, (0,), p.casing)
    bands = (Band(0.0, p.floor, -0.04),) if p.floor > 0 else ()
    low = wing.wall_top + 0.4
    attic = wing_roofs.attic_window(0.9, low, low + 1.0, wing_openings.GLASS_M)
    openings.enclose((wing_openings.GLASS_M,), bands, attic=attic)


def _garage_wing(
    kind: str, x0: float, x1: float, y0: float, y1: float, most: float
) -> Wing:
    """Returns a garage at most 6.5 m deep and at most `most` high [m].

    Its roof, `kind`, is `flat`, `gable`, `shed` or `hip`.
    """
    wall_top = 2.65
    span = x1 - x0
    rise = {"flat": 0.5, "gable": 0.3 * span, "shed": 0.2 * span,
            "hip": 0.25 * span}[kind]  # fmt: skip
    shape = Roof(kind, True, 0.3, 0.25, ROOF_M)
    top = min(wall_top + ROOF_M + rise, most)
    return Wing.at((x0, y0, x1, min(y1, y0 + 6.5)), wall_top, top, shape)


def _add_garage(p: _FamilyHouse, garage: Wing) -> None:
    """Adds a garage whose door is in front."""
    openings = Openings(p, garage, p.boxes)
    length = garage.x1 - garage.x0
    wing_openings.add_garage_door(
        openings, 0, length / 2, min(length - 0.7, 4.9)
    )
    openings.add_bays(
        (1, 3), 1.0, 3.4, [wing_openings.sash(0.9, 0.0, 1.1, 2.0)]
    )
    openings.enclose((wing_openings.GLASS_M,))


# Kept free around the walls, for eaves and chimneys [m].
_MARGIN_M = 0.5
# Plan of a detached house -> where it has wings besides the main wing.
_WING_ENDS = {
    "box": (),
    "ell": ("front",),
    "tee": ("back",),
    "cross": ("front", "back"),
}


class DetachedHouse(_FamilyHouse):
    """The detached house: wings under gables or hips, a porch, a garage.

    The parameter `plan` is `box` (one main wing), `ell` (with a second wing in
    front), `tee` (with a second wing at the back) or `cross` (with both). The
    garage is on the right and the front wing on the left; if `mirrored`, the
    garage is on the left and the front wing on the right.
    """

    def draw(self) -> None:
        """Samples sizes and style."""
        self.plan = self.pick(("box", "ell", "tee", "cross", "ell"))
        self.mirrored = self.chance(0.5)
        self.roof = self.pick(("gable", "gable", "hip", "gambrel"))
        self.pitch_deg = self.uniform(28.0, 45.0)
        self.wing_width = self.uniform(0.36, 0.46)
        self.low_wing = self.chance(0.35)
        self.floor = self.uniform(0.2, 0.6, 2)
        self.window_pitch = self.uniform(2.6, 3.4)
        self.window_width = self.uniform(0.95, 1.3, 2)
        self.casing = self.pick(("frame", "sill", "sill", "shutters"))
        self.porch = self.pick(("shed", "gable", "full", "flat"))
        self.porch_reach = self.uniform(1.5, 2.2, 2)
        self.garage = self.pick(("flat", "gable", "shed", "none"))
        self.garage_width = self.uniform(3.2, 5.8, 1)
        self.chimney = self.pick(("ridge", "breast", "ridge", "none"))
        self.chimney_at = self.uniform(0.2, 0.8)
        self.dormers = self.whole(0, 3)
        self.dormer = self.pick(("gable", "shed"))
        self.bay_window = self.chance(0.4)

    def build(self) -> None:
        """Adds all parts of the detached house, with the porch in front.

        The building's site must be a rectangle.
        """
        self._lay_out()
        _add_main(self)
        for wing in self.wings:
            _add_wing(self, wing)
        if self.garage_box is not None:
            _add_garage(self, self.garage_box)
        _add_chimney(self)

    def _lay_out(self) -> None:
        """Chooses the wings of the house.

        The first wing is `main`, with `storeys` storeys. `free` is the stretch
        in x of its front that no other wing hides, and `ahead` the depth of
        free ground in front of it [m].
        """
        x0, y0, x1, y1 = self.site.bounds
        left, right, back = x0 + _MARGIN_M, x1 - _MARGIN_M, y1 - _MARGIN_M
        ahead = self.porch_reach + 0.3 + 1.8 * self.floor
        self.ahead = min(ahead, 0.3 * (back - y0))
        front = y0 + self.ahead
        main_back = front + min(back - front, 10.0)
        deep = main_back - front
        garage_width = min(self.garage_width, 0.36 * (right - left))
        has_garage = self.garage != "none" and garage_width > 2.9
        split = right - garage_width * has_garage
        pitch_deg = 48.0 if self.roof == "gambrel" else self.pitch_deg
        n = storeys_for(self.height, self.floor, deep, pitch_deg)
        wall_top = wall_top_for(self.height, self.floor, deep, n)
        slope = 2 * (self.height - wall_top - ROOF_M) / deep
        roof = Roof(self.roof, eaves=0.4, verge=0.3, thickness=ROOF_M)
        area = (left, front, split, main_back)
        boxes = [Wing.at(area, wall_top, self.height, roof)]
        wide = max(3.2, self.wing_width * (split - left))
        drop = STOREY_M * (n > 1 and self.low_wing)
        top = min(wall_top + ROOF_M + slope * wide / 2, self.height - 0.25)
        kind = "hip" if self.roof == "hip" else "gable"
        shape = Roof(kind, True, 0.35, 0.3, ROOF_M)
        middle = (front + main_back) / 2
        for end in _WING_ENDS[self.plan]:
            if end == "front":
                span = (left - 0.02, front - max(0.6, self.ahead - 0.6))
                area = (*span, left + wide, middle)
            else:
                a = left + 0.4 * (split - left - wide)
                area = (a, middle, a + wide, min(back, main_back + 3.0))
            if end == "front" or back - main_back > 1.0:
                boxes.append(Wing.at(area, wall_top - drop, top - drop, shape))
        if has_garage:
            boxes.append(_garage_wing(
                self.garage, split - 0.06, right, front + 0.6,
                main_back - 0.4, self.height,
            ))  # fmt: skip
        taken = left + wide if "front" in _WING_ENDS[self.plan] else left
        self.free = (taken, split)
        self.storeys = n
        if self.mirrored:
            boxes = [box.mirrored(x0 + x1) for box in boxes]
            self.free = (x0 + x1 - split, x0 + x1 - taken)
        self.boxes = tuple(boxes)
        self.main = boxes[0]
        self.garage_box = boxes[-1] if has_garage else None
        self.wings = boxes[1 : -1 if has_garage else None]


def _add_main(p: DetachedHouse) -> None:
    openings = _window_rows(p, p.main, p.storeys)
    a, b = (x - p.main.x0 for x in p.free)
    door = a + 0.5 * (b - a)
    wing_openings.add_door(openings, 0, door, p.floor, lights=0.3)
    _add_porch(p, (a, b))
    _close_box(p, p.main, openings)
    if p.roof in ("gable", "gambrel"):
        wing_roofs.add_dormers(p, p.main, a, b, p.dormers, p.dormer, 3.0)


def _add_porch(p: DetachedHouse, free: bays.Span) -> None:
    """Adds a roof over the door; a `full` porch runs along the free front."""
    wall = p.main.wall(0)
    a, b = free
    door = (a + b) / 2
    reach = min(p.porch_reach, p.ahead - 0.3)
    eaves = p.floor + 2.3
    top = eaves + (0.9 if p.porch == "gable" else 0.45)
    if p.storeys == 1:
        top = min(top, p.main.wall_top + 0.1)
    full = p.porch == "full" and b - a > 3.5
    x0, x1 = (a + 0.3, b - 0.3) if full else (door - 1.2, door + 1.2)
    porches.add_porch(
        p, wall, x0, x1, reach, p.floor, eaves, top,
        roof="shed" if p.porch == "full" else p.porch,
        posts=max(3, round((x1 - x0) / 2.2)) if full else 2,
    )  # fmt: skip
    room = p.ahead - reach - 0.02
    porches.add_steps(p, wall, door - 0.7, door + 0.7, reach, p.floor, room)
    if full and p.floor > 0.3:
        y = reach - 0.15
        trim = p.colours["trim"]
        runs = ((x0 + 0.15, door - 0.8), (door + 0.8, x1 - 0.15))
        for k, (a, b) in enumerate(runs):
            part = f"railing_{k}"
            balconies.add_railing(p, part, wall, (a, y), (b, y), p.floor, trim)


def _add_wing(p: DetachedHouse, wing: Wing) -> None:
    count = max(1, round((wing.wall_top - p.floor) / STOREY_M))
    openings = _window_rows(p, wing, count)
    _close_box(p, wing, openings)
    is_front = wing.y0 < p.main.y0
    if p.bay_window and is_front and wing.width > 3.0:
        size = (wing.width / 2, 2.2, 0.4, 0.0, p.floor + 2.3)
        bay_windows.add_bay_window(p, wing.wall(0), *size)


def _add_chimney(p: DetachedHouse) -> None:
    main = p.main
    if p.chimney == "breast":
        wall = main.wall(1 if p.mirrored else 3)
        x = wall.length / 2
        breast = _chimney_breast(wall, x, 1.6, 0.42, main.top - 0.1)
        p.add_to("base", breast)
        spot = (*wall.point(x, 0.18), main.top - 0.9)
        add_chimney(p, "chimney", spot, p.colours["base"], yaw=np.pi / 2)
    elif p.chimney == "ridge":
        x = main.x0 + p.chimney_at * main.width
        spot = (x, main.center[1], main.top - 1.2)
        add_chimney(p, "chimney", spot, p.kind.choices["bricks"][0])


def _chimney_breast(
    wall: WallFrame, x: float, width: float, reach: float, top: float
) -> Mesh:
    """Returns a chimney in front of a wall, which narrows at its shoulders.

    Args:
        wall: the wall.
        x: middle of the chimney along the wall [m].
        width: width at the foot [m].
        reach: how far it reaches out of the wall [m].
        top: height of its top [m].
    """
    a, b = x - width / 2, x + width / 2
    neck = 0.62 * width / 2
    shoulder = 0.5 * top
    low = outlines.rectangle(a, -0.05, b, reach)
    high = outlines.rectangle(x - neck, -0.05, x + neck, reach)
    head = (x - neck - 0.08, x + neck + 0.08, -0.05, reach + 0.06)
    breast = merge_meshes(
        solids.skirt(low, low, -solids.FOUNDATION_M, shoulder),
        solids.skirt(low, high, shoulder, shoulder + 0.6),
        solids.prism(high, shoulder + 0.6, top),
        solids.box(*head, top - 0.35, top - 0.15),
    )
    return wall.place(breast)


# Kept free around the walls, for wide eaves [m].
_BUNGALOW_MARGIN_M = 0.75


class Bungalow(_FamilyHouse):
    """The bungalow: one long low storey, a carport or a garage."""

    def draw(self) -> None:
        """Samples sizes and style."""
        # `long`, `ell` (a wing to the front) or `court` (two of them).
        self.plan = self.pick(("long", "ell", "ell", "court"))
        # `garage` in the front wing, `carport` beside the house or `none`.
        self.parking = self.pick(("garage", "carport", "none"))
        # Whether the front wing stands on the right.
        self.mirrored = self.chance(0.5)
        self.roof = self.pick(("gable", "hip", "hip"))
        # Width of a front wing, as a share of the width of the house.
        self.wing_width = self.uniform(0.3, 0.4)
        # How far the front wings stand out from the house.
        self.reach = self.uniform(2.0, 4.0, 2)
        self.floor = self.uniform(0.1, 0.35, 2)
        self.window_pitch = self.uniform(2.6, 3.6)
        self.window_width = self.uniform(1.2, 1.7, 2)
        # Width of the large window beside the door.
        self.picture = self.uniform(2.2, 3.4, 2)
        self.casing = self.pick(("frame", "sill", "shutters"))
        self.veranda = self.chance(0.5)
        self.chimney_at = self.uniform(0.25, 0.75)

    def build(self) -> None:
        """Adds all parts of the bungalow, which lies along the front.

        The building's site must be a rectangle.
        """
        self._lay_out()
        main, *fronts = self.boxes
        openings = _window_rows(self, main, 1)
        _add_bungalow_main(self, main, openings)
        for k, wing in enumerate(fronts):
            openings = _window_rows(self, wing, 1)
            if self.parking == "garage" and k == 0:
                width = min(wing.width - 0.8, 4.8)
                wing_openings.add_garage_door(
                    openings, 0, wing.width / 2, width
                )
            _close_box(self, wing, openings)
        if self.carport is not None:
            _add_carport(self, self.carport)
        x = main.x0 + self.chimney_at * main.width
        spot, scale = (x, main.center[1], main.top - 1.3), (1.5, 1.2, 0.95)
        add_chimney(self, "chimney", spot, self.colours["base"], scale=scale)

    def _lay_out(self) -> None:
        """Chooses the main wing, the wings in front of it and the carport.

        `free` is the stretch in x of its front that no other wing hides [m].
        """
        x0, y0, x1, y1 = self.site.bounds
        left, right = x0 + _BUNGALOW_MARGIN_M, x1 - _BUNGALOW_MARGIN_M
        back = y1 - _BUNGALOW_MARGIN_M
        width, depth = right - left, back - y0
        wanted = {"long": 0, "ell": 1, "court": 2}[self.plan]
        count = min(wanted, int(width / 6.5))
        ahead = min(1.9, 0.2 * depth)
        reach = min(self.reach, 0.3 * depth) if count else 0.0
        front = y0 + max(ahead, _BUNGALOW_MARGIN_M + reach)
        deep = min(back - front, 8.5)
        carport: outlines.Area | None = None
        if self.parking == "carport" and width > 13.0:
            carport = (
                right - 3.4, front + 0.4, right, front + min(6.0, deep)
            )  # fmt: skip
            right -= 3.6
        top = self.height
        wall_top = min(
            self.floor + 2.75, top - ROOF_M - 0.1 * deep, 0.8 * (top - ROOF_M)
        )
        shape = Roof(self.roof, eaves=0.6, verge=0.4, thickness=ROOF_M)
        main = Wing.at((left, front, right, front + deep), wall_top, top, shape)
        slope = 2 * (top - main.wall_top - ROOF_M) / deep
        wide = max(3.4, self.wing_width * (right - left))
        end = min(top - 0.2, main.wall_top + ROOF_M + slope * wide / 2)
        cross = Roof(self.roof, True, 0.5, 0.4, ROOF_M)
        boxes = [main]
        taken = [left, right]
        for k in range(count):
            a = left - 0.02 if k == 0 else right - wide
            area = (a, front - reach, a + wide + 0.02, front + deep / 2)
            boxes.append(Wing.at(area, main.wall_top, end, cross))
            taken[k] = a + wide if k == 0 else a
        if self.mirrored:
            both = x0 + x1
            boxes = [box.mirrored(both) for box in boxes]
            taken = [both - x for x in reversed(taken)]
            if carport is not None:
                a, c, b, d = carport
                carport = (both - b, c, both - a, d)
        self.boxes = boxes
        self.carport = carport
        self.free = taken


def _add_bungalow_main(p: Bungalow, main: Wing, openings: Openings) -> None:
    wall = main.wall(0)
    a, b = (x - main.x0 for x in p.free)
    door = a + 0.3 * (b - a)
    if b - door > p.picture + 1.6:
        x = (door + 0.6 + b) / 2
        pane = wing_openings.sash(p.picture, p.floor, 0.45, 2.15, bars=2)
        openings.replace_by_bay(0, x, p.picture + 0.7, pane)
    wing_openings.add_door(openings, 0, door, p.floor, lights=0.3)
    _close_box(p, main, openings)
    reach = min(1.6, main.y0 - p.site.bounds[1] - 0.4)
    if p.veranda and b - a > 4.0 and reach > 0.9:
        eaves = min(p.floor + 2.25, main.wall_top - 0.35)
        porches.add_porch(
            p, wall, a + 0.25, b - 0.25, reach, p.floor, eaves,
            eaves + 0.4, posts=max(3, round((b - a) / 2.4)),
        )  # fmt: skip
    else:
        slab = (door - 1.0, door + 1.0, -0.05, min(1.2, reach), p.floor)
        p.add_to("base", wall.standing(*slab, bottom=True))


def _add_carport(p: Bungalow, area: outlines.Area) -> None:
    """Adds a flat roof on six posts, with a shed at its end."""
    x0, y0, x1, y1 = area
    top = 2.65
    p.add_to("roof", solids.box(x0, x1, y0, y1, top - 0.25, top))
    for x in (x0 + 0.15, x1 - 0.15):
        for y in np.linspace(y0 + 0.3, y1 - 2.0, 3).tolist():
            p.add_to("trim", solids.post(x, y, 0.08, top - 0.2))
    shed = (x0 + 0.1, x1 - 0.1, y1 - 1.6, y1 - 0.1, top - 0.2)
    p.add_to("walls", solids.standing(*shed, bottom=True))


class SemiDetached(_FamilyHouse):
    """The pair of semi-detached houses: mirrored halves under one roof."""

    def draw(self) -> None:
        """Samples sizes and style."""
        self.roof = self.pick(("gable", "hip"))
        # Wanted pitch of the roof.
        self.pitch_deg = self.uniform(30.0, 45.0)
        self.floor = self.uniform(0.15, 0.45, 2)
        self.window_pitch = self.uniform(2.4, 3.2)
        self.window_width = self.uniform(1.0, 1.4, 2)
        self.casing = self.pick(("frame", "sill", "sill", "shutters"))
        # `gabled` (through all storeys, under a gable of its own), `canted`
        # or `none`.
        self.bay = self.pick(("gabled", "canted", "gabled", "none"))
        self.bay_width = self.uniform(2.6, 3.2, 2)
        self.bay_reach = self.uniform(0.6, 1.0, 2)
        self.doors_inside = self.chance(0.5)
        self.porch_reach = self.uniform(1.1, 1.5, 2)
        # Roof of the two garages, one on either side, or `none`.
        self.garages = self.pick(("none", "flat", "shed", "hip"))
        self.garage_width = self.uniform(2.9, 3.4, 2)
        self.chimneys = self.pick(("middle", "ends"))

    def build(self) -> None:
        """Adds all parts of the two semi-detached houses.

        The building's site must be a rectangle.
        """
        x0, y0, x1, y1 = self.site.bounds
        left, right, back = x0 + _MARGIN_M, x1 - _MARGIN_M, y1 - _MARGIN_M
        front = y0 + min(2.4, 0.25 * (y1 - y0))
        deep = min(back - front, 10.0)
        has_garages = self.garages != "none" and right - left > 17.0
        side = self.garage_width * has_garages
        n = storeys_for(self.height, self.floor, deep, self.pitch_deg)
        wall_top = wall_top_for(self.height, self.floor, deep, n)
        shape = Roof(self.roof, eaves=0.4, verge=0.3, thickness=ROOF_M)
        area = (left + side, front, right - side, front + deep)
        main = Wing.at(area, wall_top, self.height, shape)
        bays = _gabled_bays(self, main) if self.bay == "gabled" else ()
        garages = []
        if has_garages:
            for a, b in ((left, main.x0 + 0.06), (main.x1 - 0.06, right)):
                area = (a, b, front + 1.5, main.y1 - 0.3)
                garages.append(_garage_wing(self.garages, *area, self.height))
        self.boxes = (main, *bays, *garages)
        openings = _window_rows(self, main, n)
        _add_entrances(self, main, openings, y0)
        _close_box(self, main, openings)
        for wing in bays:
            rows = Openings(self, wing, self.boxes)
            wing_openings.add_window_storeys(
                rows, (0,), self.floor, STOREY_M, n, 2.4, 1.5, margin=0.2
            )
            _close_box(self, wing, rows)
        for garage in garages:
            _add_garage(self, garage)
        _add_chimneys(self, main)


def _bay_middles(p: SemiDetached, main: Wing) -> tuple[float, float]:
    """Returns the middles of the two bays along the main wall [m]."""
    half = (main.x1 - main.x0) / 2
    # Doors take the middle or the ends; bays take the rest of each half.
    u = 0.6 * half if p.doors_inside else 0.36 * half
    offset = half - u if not p.doors_inside else u
    return half - offset, half + offset


def _gabled_bays(p: SemiDetached, main: Wing) -> tuple[Wing, ...]:
    width = min(p.bay_width, 0.45 * (main.x1 - main.x0) / 2)
    if width < 1.8:
        return ()
    rise = min(0.5 * width, main.top - main.wall_top - ROOF_M - 0.2)
    top = main.wall_top + ROOF_M + rise
    shape = Roof("gable", True, 0.2, 0.25, ROOF_M)
    middle = (main.y0 + main.y1) / 2
    fronts = (
        (main.x0 + x - width / 2, main.x0 + x + width / 2)
        for x in _bay_middles(p, main)
    )
    y0 = main.y0 - p.bay_reach
    return tuple(
        Wing.at((a, y0, b, middle), main.wall_top, top, shape)
        for a, b in fronts
    )


def _add_entrances(
    p: SemiDetached, main: Wing, openings: Openings, y0: float
) -> None:
    """Adds the doors under one or two roofs, and bays on the ground floor."""
    wall = main.wall(0)
    half = wall.length / 2
    room = main.y0 - y0 - 0.1
    reach = min(p.porch_reach, room - 0.3)
    offset = 0.75 if p.doors_inside else half - 0.95
    eaves = p.floor + 2.35
    size = (reach, p.floor, eaves, eaves + 0.4)
    for x in (half - offset, half + offset):
        wing_openings.add_door(openings, 0, x, p.floor)
        if not p.doors_inside:
            porches.add_porch(p, wall, x - 0.85, x + 0.85, *size)
    if p.doors_inside:
        porches.add_porch(
            p, wall, half - 1.6, half + 1.6, *size, roof="flat", posts=3
        )
    for x in _bay_middles(p, main) if p.bay == "canted" else ():
        width = min(2.4, 0.5 * half)
        ends = (x - width / 2 - 0.1, x + width / 2 + 0.1)
        openings.clear(0, *ends, 0.0, p.floor + STOREY_M - 0.2)
        bay_windows.add_bay_window(
            p, wall, x, width, min(0.7, room - 0.1), 0.0,
            round(p.floor + 2.3, 2),
        )  # fmt: skip
    if p.doors_inside:
        step = (half - 1.4, half + 1.4, reach, reach + 0.28, 0.12)
        p.add_to("base", wall.standing(*step, bottom=True))


def _add_chimneys(p: SemiDetached, main: Wing) -> None:
    x, y = main.center
    spots = [x]
    if p.chimneys != "middle":
        side = 0.7 if p.roof == "gable" else 0.35 * main.width
        spots = [main.x0 + side, main.x1 - side]
    for k, x in enumerate(spots):
        add_chimney(
            p, f"chimney_{k}", (x, y, main.top - 1.1),
            p.kind.choices["bricks"][0], item="chimney_row",
            yaw=np.pi / 2, scale=(0.8, 1.0, 1.0),
        )  # fmt: skip
