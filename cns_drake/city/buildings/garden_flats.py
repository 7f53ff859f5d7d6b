"""The garden flats: staggered houses with verandas."""

import numpy as np

from cns_drake.city.buildings.house_heights import (
    ROOF_M,
    storeys_for,
    wall_top_for,
)
from cns_drake.city.facades import (
    Building,
    Openings,
    Roof,
    Wing,
    add_chimney,
    around,
    balconies,
    bays,
    foot_band,
    top_band,
    wing_openings,
    wing_roofs,
)
from cns_drake.city.geometry import MeshShape, merge_meshes

# Free strip around the walls, for eaves [m].
_MARGIN_M = 0.5
# Height of the ground floor above the ground [m].
_FLOOR_M = 0.3


class GardenFlats(Building):
    """Flats in a garden: staggered houses under gables, stacks of verandas."""

    def draw(self) -> None:
        """Samples sizes and style."""
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
        self.window_pitch = max(self.uniform(2.6, 3.4), site.width / 12)
        self.window_width = self.uniform(1.1, 1.6, digits=2)
        self.veranda_width = self.uniform(2.8, 4.0, digits=2)
        self.veranda_reach = self.uniform(1.4, 1.9, digits=2)
        self.casing = "sill"
        if site.width < 20.0:
            self.casing = self.pick(("frame", "sill"))

    def build(self) -> None:
        """Adds all parts of the houses, side by side along the front.

        The building's site must be a rectangle.
        """
        x0, y0, x1, y1 = self.site.bounds
        left, right = x0 + _MARGIN_M, x1 - _MARGIN_M
        count = max(1, round((right - left) / self.section))
        bounds = np.linspace(left, right, count + 1)
        front = y0 + self.veranda_reach + 0.4
        deep = min(y1 - _MARGIN_M - front - self.stagger, 13.0)
        storeys = storeys_for(self.height, _FLOOR_M, deep, self.pitch_deg)
        storeys = max(2, storeys)
        wall_top = wall_top_for(self.height, _FLOOR_M, deep, storeys)
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
            shape = Roof(
                self.roof,
                along_y=cross,
                eaves=0.4,
                verge=0.35,
                thickness=ROOF_M,
            )
            area = (bounds[k] - 0.05 * (k > 0), y, bounds[k + 1], y + deep)
            boxes.append(Wing.at(area, wall_top=wall_top, top=top, roof=shape))
        for k, wing in enumerate(boxes):
            _add_house(self, wing, boxes, storeys, k)


def _add_house(
    flats: GardenFlats, wing: Wing, boxes: list[Wing], storeys: int, number: int
) -> None:
    openings = Openings(flats, wing, boxes)
    storey = (wing.wall_top - 0.15 - _FLOOR_M) / storeys
    head = min(2.2, storey - 0.4)
    for edges, pitch in (((0, 2), flats.window_pitch), ((1, 3), 4.5)):
        wing_openings.add_window_storeys(
            openings,
            edges,
            floor=_FLOOR_M,
            storey=storey,
            count=storeys,
            pitch=pitch,
            width=flats.window_width,
            head=head,
        )
    wall = wing.wall(0)
    middle = wall.length / 2
    glass = wing_openings.GLASS_M
    openings.clear(
        0, x0=middle - 1.1, x1=middle + 1.1, z0=0.0, z1=wing.wall_top
    )
    if wing.wall_top > 6.0:
        stair = bays.window(
            width=1.8,
            sill=_FLOOR_M + 2.6,
            head=wing.wall_top - 0.7,
            depth=glass,
        )
        openings.replace_by_bay(0, x=middle, width=2.6, bay=stair)
    wing_openings.add_door(
        openings, 0, x=middle, floor=_FLOOR_M, width=1.2, lights=0.4
    )
    across, reach = around(middle, 1.4), (-0.05, 1.3)
    canopy = wall.box(across, reach, z=(_FLOOR_M + 2.3, _FLOOR_M + 2.5))
    landing = wall.standing(across, reach, z1=_FLOOR_M, bottom=True)
    flats.add_to("trim", canopy)
    flats.add_to("base", landing)
    _add_verandas(flats, wing, storeys, storey, number)
    wing_openings.add_casings(openings, (0,), flats.casing)
    z = round(_FLOOR_M + storey, 2)
    bands = (
        foot_band(height=_FLOOR_M, reach=0.05),
        top_band(z, height=0.2, reach=0.05),
    )
    low = wing.wall_top + 0.4
    attic = wing_roofs.attic_window(
        width=0.9, z0=low, z1=low + 1.0, depth=glass, count=2
    )
    openings.enclose((glass,), bands=bands, attic=attic)
    if not wing.roof.along_y:
        x, y = wing.x0 + 0.3 * wall.length, wing.center[1]
        spot = (x, y, wing.top - 1.3)
        brick = flats.kind.choices["bricks"][0]
        add_chimney(flats, f"chimney_{number}", spot, brick)


def _add_verandas(
    flats: GardenFlats, wing: Wing, storeys: int, storey: float, number: int
) -> None:
    """Adds verandas above one another, left and right of the entrance."""
    wall = wing.wall(0)
    width = min(flats.veranda_width, wall.length / 2 - 2.2)
    if width < 2.0:
        return
    reach = flats.veranda_reach
    top = wing.wall_top - 0.1
    pieces, frame = [], []
    for x in (0.9 + width / 2, wall.length - 0.9 - width / 2):
        a, b = round(x - width / 2, 2), round(x + width / 2, 2)
        pieces.append(
            wall.place(
                balconies.balcony(x0=a, x1=b, reach=reach, z=0.0, rail=1.0)
            )
        )
        for u in (a + 0.1, b - 0.1):
            frame.append(
                wall.standing(
                    x=around(u, 0.09),
                    y=(reach - 0.2, reach - 0.02),
                    z1=top - 0.1,
                )
            )
        frame.append(
            wall.box(
                x=(a - 0.1, b + 0.1),
                y=(-0.05, reach + 0.1),
                z=(top - 0.25, top),
            )
        )
    part = f"house_{number}"
    trim = flats.colours["trim"]
    mesh = merge_meshes(*pieces)
    shape = MeshShape(flats.define(f"{part}_verandas", mesh))
    for k in range(1, storeys):
        at = (0.0, 0.0, _FLOOR_M + k * storey)
        flats.place(f"{part}_verandas_{k}", shape, at, finish=trim)
    flats.add(f"{part}_posts", *frame, finish=trim)
