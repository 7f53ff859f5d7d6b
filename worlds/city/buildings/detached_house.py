"""The detached house, with a porch and a garage."""

import numpy as np

from worlds.city.buildings.family_house import (
    MARGIN_M,
    FamilyHouse,
    add_garage,
    add_walls_and_roof,
    garage_wing,
    window_rows,
)
from worlds.city.buildings.house_heights import (
    ROOF_M,
    STOREY_M,
    storeys_for,
    wall_top_for,
)
from worlds.city.facades import (
    Roof,
    WallFrame,
    Wing,
    around,
    balconies,
    bay_windows,
    bays,
    porches,
    solids,
    wing_openings,
    wing_roofs,
)
from worlds.shapes import Mesh, add_chimney, merge_meshes, outlines

# Greatest depth of the main wing [m].
_MOST_DEPTH_M = 10.0
# Pitch of a gambrel roof, from which its number of storeys follows [deg].
_GAMBREL_PITCH_DEG = 48.0
# Least width of a garage [m].
_LEAST_GARAGE_M = 2.9
# Least width of a wing [m].
_LEAST_WING_M = 3.2
# Greatest distance by which a wing stands out at the back [m].
_BACK_WING_M = 3.0
# Overlap of the walls of the garage and the house [m].
_GARAGE_JOINT_M = 0.06
# Height of a porch above the floor [m].
_PORCH_M = 2.3
# Least length of the free front for a porch along all of it [m].
_FULL_PORCH_M = 3.5
# Width of a chimney in front of a wall at its foot [m].
_BREAST_M = 1.6
# How far such a chimney reaches out of the wall [m].
_BREAST_REACH_M = 0.42
# Plan of a detached house -> where it has wings besides the main wing.
_WING_ENDS = {
    "box": (),
    "ell": ("front",),
    "tee": ("back",),
    "cross": ("front", "back"),
}


class DetachedHouse(FamilyHouse):
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
        # Width of a wing, as a share of the width of the main wing.
        self.wing_share = self.uniform(0.36, 0.46)
        self.low_wing = self.chance(0.35)
        self.floor = self.uniform(0.2, 0.6, digits=2)
        self.window_pitch = self.uniform(2.6, 3.4)
        self.window_width = self.uniform(0.95, 1.3, digits=2)
        self.casing = self.pick(("frame", "sill", "sill", "shutters"))
        self.porch = self.pick(("shed", "gable", "full", "flat"))
        self.porch_reach = self.uniform(1.5, 2.2, digits=2)
        self.garage = self.pick(("flat", "gable", "shed", "none"))
        self.garage_width = self.uniform(3.2, 5.8, digits=1)
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
            add_garage(self, self.garage_box)
        _add_chimney(self)

    def _lay_out(self) -> None:
        """Chooses the wings of the house.

        The first wing is `main`, with `storeys` storeys. `free` is the stretch
        in x on which no other wing hides the main wing's front, and `ahead` is
        the depth of free ground in front of the main wing [m].
        """
        x0, y0, x1, y1 = self.site.bounds
        left, right, back = x0 + MARGIN_M, x1 - MARGIN_M, y1 - MARGIN_M
        ahead = self.porch_reach + 0.3 + 1.8 * self.floor
        self.ahead = min(ahead, 0.3 * (back - y0))
        front = y0 + self.ahead
        main_back = front + min(back - front, _MOST_DEPTH_M)
        garage_width = min(self.garage_width, 0.36 * (right - left))
        has_garage = self.garage != "none" and garage_width > _LEAST_GARAGE_M
        split = right - garage_width if has_garage else right
        deep = main_back - front
        wall_top = self._choose_storeys(deep)
        roof = Roof(self.roof, eaves=0.4, verge=0.3, thickness=ROOF_M)
        area = (left, front, split, main_back)
        main = Wing.at(area, wall_top=wall_top, top=self.height, roof=roof)
        wing_width = max(_LEAST_WING_M, self.wing_share * (split - left))
        slope = 2 * (self.height - wall_top - ROOF_M) / deep
        rise = slope * wing_width / 2
        middle = (front + main_back) / 2
        ends = _WING_ENDS[self.plan]
        boxes = [main]
        if "front" in ends:
            wing_front = front - max(0.6, self.ahead - 0.6)
            area = (left - 0.02, wing_front, left + wing_width, middle)
            boxes.append(self._cross_wing(area, wall_top, rise))
        if "back" in ends and back - main_back > 1.0:
            x = left + 0.4 * (split - left - wing_width)
            wing_back = min(back, main_back + _BACK_WING_M)
            area = (x, middle, x + wing_width, wing_back)
            boxes.append(self._cross_wing(area, wall_top, rise))
        if has_garage:
            garage = garage_wing(
                self.garage,
                x0=split - _GARAGE_JOINT_M,
                x1=right,
                y0=front + 0.6,
                y1=main_back - 0.4,
                most=self.height,
            )
            boxes.append(garage)
        free_start = left + wing_width if "front" in ends else left
        self.free = (free_start, split)
        if self.mirrored:
            boxes = [box.mirrored(x0 + x1) for box in boxes]
            self.free = (x0 + x1 - split, x0 + x1 - free_start)
        self.boxes = tuple(boxes)
        self.main = boxes[0]
        self.garage_box = boxes[-1] if has_garage else None
        self.wings = boxes[1 : -1 if has_garage else None]

    def _choose_storeys(self, deep: float) -> float:
        """Chooses the number of storeys; returns the height of the walls [m].

        `deep` is the depth of the main wing [m].
        """
        pitch_deg = self.pitch_deg
        if self.roof == "gambrel":
            pitch_deg = _GAMBREL_PITCH_DEG
        self.storeys = storeys_for(self.height, self.floor, deep, pitch_deg)
        return wall_top_for(self.height, self.floor, deep, self.storeys)

    def _cross_wing(
        self, area: outlines.Area, wall_top: float, rise: float
    ) -> Wing:
        """Returns a wing in front of the main wing, or behind it.

        Args:
            area: ground of the wing [m].
            wall_top: height of the walls of the main wing [m].
            rise: height of the wing's roof [m].
        """
        is_lower = self.storeys > 1 and self.low_wing
        drop = STOREY_M if is_lower else 0.0
        top = min(wall_top + ROOF_M + rise, self.height - 0.25)
        kind = "hip" if self.roof == "hip" else "gable"
        roof = Roof(kind, along_y=True, eaves=0.35, verge=0.3, thickness=ROOF_M)
        return Wing.at(
            area, wall_top=wall_top - drop, top=top - drop, roof=roof
        )


def _add_main(house: DetachedHouse) -> None:
    """Adds the main wing with its door, the porch and dormers."""
    openings = window_rows(house, house.main, house.storeys)
    start, end = (x - house.main.x0 for x in house.free)
    door = start + 0.5 * (end - start)
    wing_openings.add_door(openings, x=door, floor=house.floor, lights=0.3)
    _add_porch(house, (start, end))
    add_walls_and_roof(house, house.main, openings)
    if house.roof in ("gable", "gambrel"):
        wing_roofs.add_dormers(
            house,
            house.main,
            start=start,
            end=end,
            count=house.dormers,
            roof=house.dormer,
            pitch=3.0,
        )


def _add_porch(house: DetachedHouse, free: bays.Span) -> None:
    """Adds a roof over the door; a `full` porch runs along the free front.

    `free` is the start and the end of the free front along the wall [m].
    """
    wall = house.main.wall(0)
    start, end = free
    door = (start + end) / 2
    floor = house.floor
    reach = min(house.porch_reach, house.ahead - 0.3)
    eaves = floor + _PORCH_M
    top = eaves + (0.9 if house.porch == "gable" else 0.45)
    if house.storeys == 1:
        top = min(top, house.main.wall_top + 0.1)
    is_full = house.porch == "full" and end - start > _FULL_PORCH_M
    x0, x1 = (start + 0.3, end - 0.3) if is_full else around(door, 1.2)
    porches.add_porch(
        house,
        wall,
        x0=x0,
        x1=x1,
        reach=reach,
        deck=floor,
        eaves=eaves,
        top=top,
        roof="shed" if house.porch == "full" else house.porch,
        posts=max(3, round((x1 - x0) / 2.2)) if is_full else 2,
    )
    porches.add_steps(
        house,
        wall,
        x0=door - 0.7,
        x1=door + 0.7,
        start=reach,
        rise=floor,
        room=house.ahead - reach - 0.02,
    )
    if is_full and floor > 0.3:
        y = reach - 0.15
        runs = ((x0 + 0.15, door - 0.8), (door + 0.8, x1 - 0.15))
        for k, (run_start, run_end) in enumerate(runs):
            balconies.add_railing(
                house,
                f"railing_{k}",
                wall,
                start=(run_start, y),
                end=(run_end, y),
                z=floor,
                finish=house.colours["trim"],
            )


def _add_wing(house: DetachedHouse, wing: Wing) -> None:
    """Adds a wing, with a bay window if it stands in front."""
    count = max(1, round((wing.wall_top - house.floor) / STOREY_M))
    openings = window_rows(house, wing, count)
    add_walls_and_roof(house, wing, openings)
    is_front = wing.y0 < house.main.y0
    if house.bay_window and is_front and wing.width > 3.0:
        bay_windows.add_bay_window(
            house,
            wing.wall(0),
            x=wing.width / 2,
            width=2.2,
            reach=0.4,
            z0=0.0,
            z1=house.floor + 2.3,
        )


def _add_chimney(house: DetachedHouse) -> None:
    """Adds a chimney in front of a side wall or on the ridge, or none."""
    main = house.main
    if house.chimney == "breast":
        wall = main.wall(1 if house.mirrored else 3)
        x = wall.length / 2
        brick = house.colours["base"]
        house.add_to("base", _chimney_breast(wall, x, top=main.top - 0.1))
        foot = (*wall.point(x, 0.18), main.top - 0.9)
        add_chimney(house, "chimney", foot, brick, yaw=np.pi / 2)
    elif house.chimney == "ridge":
        x = main.x0 + house.chimney_at * main.width
        foot = (x, main.center[1], main.top - 1.2)
        add_chimney(house, "chimney", foot, house.kind.choices["bricks"][0])


def _chimney_breast(wall: WallFrame, x: float, top: float) -> Mesh:
    """Returns a chimney that narrows at its shoulders, in front of a wall.

    `x` is the middle of the chimney along the wall, and `top` the height of its
    top [m].
    """
    width, reach = _BREAST_M, _BREAST_REACH_M
    neck = 0.62 * width / 2
    shoulder = 0.5 * top
    low = outlines.rectangle(x - width / 2, -0.05, x + width / 2, reach)
    high = outlines.rectangle(x - neck, -0.05, x + neck, reach)
    breast = merge_meshes(
        solids.skirt(low, low, z0=-solids.FOUNDATION_M, z1=shoulder),
        solids.skirt(low, high, z0=shoulder, z1=shoulder + 0.6),
        solids.prism(high, z0=shoulder + 0.6, z1=top),
        solids.box(
            x=(x - neck - 0.08, x + neck + 0.08),
            y=(-0.05, reach + 0.06),
            z=(top - 0.35, top - 0.15),
        ),
    )
    return wall.place(breast)
