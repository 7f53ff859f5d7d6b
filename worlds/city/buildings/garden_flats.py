"""The garden flats: staggered houses with verandas."""

import numpy as np

from worlds.city.buildings.house_heights import (
    ROOF_M,
    storeys_for,
    wall_top_for,
)
from worlds.city.facades import (
    Building,
    Openings,
    Roof,
    WallFrame,
    Wing,
    around,
    balconies,
    bays,
    foot_band,
    top_band,
    wing_openings,
    wing_roofs,
)
from worlds.shapes import Mesh, MeshShape, add_chimney, merge_meshes

# Free strip around the walls, for eaves [m].
_MARGIN_M = 0.5
# Height of the ground floor above the ground [m].
_FLOOR_M = 0.3

# Distance between the windows of the sides [m].
_SIDE_PITCH_M = 4.5
# Greatest number of windows in front.
_MOST_BAYS = 12
# Wider groups have no frames around their windows [m].
_CASINGS_WIDTH_M = 20.0
# Greatest depth of a house [m].
_MOST_DEPTH_M = 13.0
# Houses with lower walls have no window above the entrance [m].
_STAIR_WALL_M = 6.0
# Half the width of the canopy and the landing at the door [m].
_LANDING_HALF_M = 1.4
# How far canopy and landing reach out of the wall [m].
_LANDING_REACH_M = 1.3
# Least width of a veranda [m].
_LEAST_VERANDA_M = 2.0
# Distance of the verandas from the ends of the front [m].
_VERANDA_END_M = 0.9


class GardenFlats(Building):
    """Flats in a garden: staggered houses under gables, stacks of verandas."""

    def draw(self) -> None:
        site = self.site
        self.roof = self.pick(("gable", "gable", "hip"))
        # Wanted pitch of the roofs.
        self.pitch_deg = self.uniform(22.0, 34.0)
        # Wanted length of front for each house of the group.
        self.section = self.uniform(11.0, 15.0)
        # Distance by which every other house stands back.
        self.stagger = round(self.uniform(0.0, 0.16) * site.depth, 2)
        # Whether every other house turns its gable to the front.
        self.crossed = self.chance(0.5)
        self.window_pitch = max(self.uniform(2.6, 3.4), site.width / _MOST_BAYS)
        self.window_width = self.uniform(1.1, 1.6, digits=2)
        self.veranda_width = self.uniform(2.8, 4.0, digits=2)
        self.veranda_reach = self.uniform(1.4, 1.9, digits=2)
        self.casing = "sill"
        if site.width < _CASINGS_WIDTH_M:
            self.casing = self.pick(("frame", "sill"))

    def build(self) -> None:
        """Adds all parts of the houses, side by side along the front."""
        x0, y0, x1, y1 = self.site.bounds
        left, right = x0 + _MARGIN_M, x1 - _MARGIN_M
        count = max(1, round((right - left) / self.section))
        bounds = np.linspace(left, right, count + 1)
        front = y0 + self.veranda_reach + 0.4
        deep = min(y1 - _MARGIN_M - front - self.stagger, _MOST_DEPTH_M)
        storeys = storeys_for(self.height, _FLOOR_M, deep, self.pitch_deg)
        storeys = max(2, storeys)
        wall_top = wall_top_for(self.height, _FLOOR_M, deep, storeys)
        boxes = []
        for k in range(count):
            is_odd = k % 2 == 1
            y = front + self.stagger if is_odd else front
            # Houses overlap a little, so that no gap remains between them.
            x = bounds[k] - 0.05 if k > 0 else bounds[k]
            top = self.height
            crossed = is_odd and self.crossed
            if crossed:
                run = (bounds[1] - bounds[0]) / 2
                slope = 2 * (self.height - wall_top - ROOF_M) / deep
                top = min(wall_top + ROOF_M + slope * run, self.height - 0.1)
            roof = Roof(
                self.roof,
                along_y=crossed,
                eaves=0.4,
                verge=0.35,
                thickness=ROOF_M,
            )
            area = (x, y, bounds[k + 1], y + deep)
            boxes.append(Wing.at(area, wall_top=wall_top, top=top, roof=roof))
        for k, wing in enumerate(boxes):
            _add_house(self, wing, boxes, storeys, k)


def _add_house(
    flats: GardenFlats, wing: Wing, boxes: list[Wing], storeys: int, number: int
) -> None:
    """Adds one house of the group."""
    openings = Openings(flats, wing, boxes)
    storey = (wing.wall_top - 0.15 - _FLOOR_M) / storeys
    pitches = (((0, 2), flats.window_pitch), ((1, 3), _SIDE_PITCH_M))
    wing_openings.add_window_storeys(
        openings,
        pitches,
        floor=_FLOOR_M,
        storey=storey,
        count=storeys,
        width=flats.window_width,
        head=min(2.2, storey - 0.4),
    )
    _add_entrance(flats, openings)
    _add_verandas(flats, wing, storeys, storey, number)
    wing_openings.add_casings(openings, flats.casing)
    first_floor = round(_FLOOR_M + storey, 2)
    bands = (
        foot_band(height=_FLOOR_M, reach=0.05),
        top_band(first_floor, height=0.2, reach=0.05),
    )
    glass = wing_openings.GLASS_M
    sill = wing.wall_top + 0.4
    attic = wing_roofs.attic_window(
        width=0.9, z0=sill, z1=sill + 1.0, depth=glass, count=2
    )
    openings.enclose((glass,), bands=bands, attic=attic)
    if not wing.roof.along_y:
        x, y = wing.x0 + 0.3 * wing.wall(0).length, wing.center[1]
        foot = (x, y, wing.top - 1.3)
        brick = flats.kind.choices["bricks"][0]
        add_chimney(flats, f"chimney_{number}", foot, brick)


def _add_entrance(flats: GardenFlats, openings: Openings) -> None:
    """Adds the door in the middle of the front, and a window of the stair."""
    wing = openings.wing
    wall = wing.wall(0)
    middle = wall.length / 2
    openings.clear(
        0, x0=middle - 1.1, x1=middle + 1.1, z0=0.0, z1=wing.wall_top
    )
    if wing.wall_top > _STAIR_WALL_M:
        stair = bays.window(
            width=1.8,
            sill=_FLOOR_M + 2.6,
            head=wing.wall_top - 0.7,
            depth=wing_openings.GLASS_M,
        )
        openings.replace_by_bay(0, x=middle, width=2.6, bay=stair)
    wing_openings.add_door(
        openings, x=middle, floor=_FLOOR_M, width=1.2, lights=0.4
    )
    across, reach = around(middle, _LANDING_HALF_M), (-0.05, _LANDING_REACH_M)
    canopy = wall.box(across, reach, z=(_FLOOR_M + 2.3, _FLOOR_M + 2.5))
    landing = wall.standing(across, reach, z1=_FLOOR_M, bottom=True)
    flats.add_to("trim", canopy)
    flats.add_to("base", landing)


def _add_verandas(
    flats: GardenFlats, wing: Wing, storeys: int, storey: float, number: int
) -> None:
    """Adds verandas above one another, left and right of the entrance."""
    wall = wing.wall(0)
    width = min(flats.veranda_width, wall.length / 2 - 2.2)
    if width < _LEAST_VERANDA_M:
        return
    reach = flats.veranda_reach
    top = wing.wall_top - 0.1
    from_end = _VERANDA_END_M + width / 2
    floors, frames = [], []
    for x in (from_end, wall.length - _VERANDA_END_M - width / 2):
        x0, x1 = round(x - width / 2, 2), round(x + width / 2, 2)
        floor = balconies.balcony(x0=x0, x1=x1, reach=reach, z=0.0, rail=1.0)
        floors.append(wall.place(floor))
        frames += _veranda_frame(wall, x0, x1, reach, top)
    part = f"house_{number}"
    trim = flats.colours["trim"]
    mesh = merge_meshes(*floors)
    shape = MeshShape(flats.define(f"{part}_verandas", mesh))
    for k in range(1, storeys):
        at = (0.0, 0.0, _FLOOR_M + k * storey)
        flats.place(f"{part}_verandas_{k}", shape, at, finish=trim)
    flats.add(f"{part}_posts", *frames, finish=trim)


def _veranda_frame(
    wall: WallFrame, x0: float, x1: float, reach: float, top: float
) -> list[Mesh]:
    """Returns two posts as high as the verandas, and a roof on them.

    Args:
        wall: the wall with the verandas.
        x0: left end along the wall [m].
        x1: right end along the wall [m].
        reach: how far the verandas reach out of the wall [m].
        top: height of the roof's top [m].
    """
    posts = [
        wall.standing(
            x=around(x, 0.09), y=(reach - 0.2, reach - 0.02), z1=top - 0.1
        )
        for x in (x0 + 0.1, x1 - 0.1)
    ]
    roof = wall.box(
        x=(x0 - 0.1, x1 + 0.1), y=(-0.05, reach + 0.1), z=(top - 0.25, top)
    )
    return [*posts, roof]
