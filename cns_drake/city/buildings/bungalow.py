"""The bungalow: one long low storey."""

import numpy as np

from cns_drake.city.buildings.family_house import (
    FamilyHouse,
    add_walls_and_roof,
    window_rows,
)
from cns_drake.city.buildings.house_heights import ROOF_M
from cns_drake.city.facades import (
    Openings,
    Roof,
    Wing,
    add_chimney,
    around,
    outlines,
    porches,
    solids,
    wing_openings,
)

# Width of the free strip around the walls, for wide eaves [m].
_MARGIN_M = 0.75


class Bungalow(FamilyHouse):
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
        self.wing_share = self.uniform(0.3, 0.4)
        # How far the front wings stand out from the house.
        self.reach = self.uniform(2.0, 4.0, digits=2)
        self.floor = self.uniform(0.1, 0.35, digits=2)
        self.window_pitch = self.uniform(2.6, 3.6)
        self.window_width = self.uniform(1.2, 1.7, digits=2)
        # Width of the large window beside the door.
        self.picture = self.uniform(2.2, 3.4, digits=2)
        self.casing = self.pick(("frame", "sill", "shutters"))
        self.veranda = self.chance(0.5)
        self.chimney_at = self.uniform(0.25, 0.75)

    def build(self) -> None:
        """Adds all parts of the bungalow, which lies along the front.

        The building's site must be a rectangle.
        """
        self._lay_out()
        main, *fronts = self.boxes
        openings = window_rows(self, main, 1)
        _add_main(self, main, openings)
        for k, wing in enumerate(fronts):
            openings = window_rows(self, wing, 1)
            if self.parking == "garage" and k == 0:
                width = min(wing.width - 0.8, 4.8)
                wing_openings.add_garage_door(
                    openings, 0, x=wing.width / 2, width=width
                )
            add_walls_and_roof(self, wing, openings)
        if self.carport is not None:
            _add_carport(self, self.carport)
        x = main.x0 + self.chimney_at * main.width
        spot, scale = (x, main.center[1], main.top - 1.3), (1.5, 1.2, 0.95)
        add_chimney(self, "chimney", spot, self.colours["base"], scale=scale)

    def _lay_out(self) -> None:
        """Chooses the main wing, the wings in front of it and the carport.

        `free` is the stretch in x on which no other wing hides the main wing's
        front [m].
        """
        x0, y0, x1, y1 = self.site.bounds
        left, right = x0 + _MARGIN_M, x1 - _MARGIN_M
        back = y1 - _MARGIN_M
        width, depth = right - left, back - y0
        wanted = {"long": 0, "ell": 1, "court": 2}[self.plan]
        count = min(wanted, int(width / 6.5))
        ahead = min(1.9, 0.2 * depth)
        reach = min(self.reach, 0.3 * depth) if count else 0.0
        front = y0 + max(ahead, _MARGIN_M + reach)
        deep = min(back - front, 8.5)
        carport: outlines.Area | None = None
        if self.parking == "carport" and width > 13.0:
            carport = (right - 3.4, front + 0.4, right, front + min(6.0, deep))
            right -= 3.6
        top = self.height
        wall_top = min(
            self.floor + 2.75, top - ROOF_M - 0.1 * deep, 0.8 * (top - ROOF_M)
        )
        shape = Roof(self.roof, eaves=0.6, verge=0.4, thickness=ROOF_M)
        main = Wing.at(
            (left, front, right, front + deep),
            wall_top=wall_top,
            top=top,
            roof=shape,
        )
        slope = 2 * (top - main.wall_top - ROOF_M) / deep
        wide = max(3.4, self.wing_share * (right - left))
        end = min(top - 0.2, main.wall_top + ROOF_M + slope * wide / 2)
        cross = Roof(
            self.roof, along_y=True, eaves=0.5, verge=0.4, thickness=ROOF_M
        )
        boxes = [main]
        taken = [left, right]
        for k in range(count):
            a = left - 0.02 if k == 0 else right - wide
            area = (a, front - reach, a + wide + 0.02, front + deep / 2)
            boxes.append(
                Wing.at(area, wall_top=main.wall_top, top=end, roof=cross)
            )
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


def _add_main(bungalow: Bungalow, main: Wing, openings: Openings) -> None:
    wall = main.wall(0)
    a, b = (x - main.x0 for x in bungalow.free)
    door = a + 0.3 * (b - a)
    if b - door > bungalow.picture + 1.6:
        x = (door + 0.6 + b) / 2
        pane = wing_openings.sash(
            width=bungalow.picture,
            z=bungalow.floor,
            sill=0.45,
            head=2.15,
            bars=2,
        )
        openings.replace_by_bay(0, x=x, width=bungalow.picture + 0.7, bay=pane)
    wing_openings.add_door(
        openings, 0, x=door, floor=bungalow.floor, lights=0.3
    )
    add_walls_and_roof(bungalow, main, openings)
    reach = min(1.6, main.y0 - bungalow.site.bounds[1] - 0.4)
    if bungalow.veranda and b - a > 4.0 and reach > 0.9:
        eaves = min(bungalow.floor + 2.25, main.wall_top - 0.35)
        porches.add_porch(
            bungalow,
            wall,
            x0=a + 0.25,
            x1=b - 0.25,
            reach=reach,
            deck=bungalow.floor,
            eaves=eaves,
            top=eaves + 0.4,
            posts=max(3, round((b - a) / 2.4)),
        )
    else:
        bungalow.add_to(
            "base",
            wall.standing(
                x=around(door, 1.0),
                y=(-0.05, min(1.2, reach)),
                z1=bungalow.floor,
                bottom=True,
            ),
        )


def _add_carport(bungalow: Bungalow, area: outlines.Area) -> None:
    """Adds a flat roof on six posts, with a shed at its end."""
    x0, y0, x1, y1 = area
    top = 2.65
    bungalow.add_to(
        "roof", solids.box(x=(x0, x1), y=(y0, y1), z=(top - 0.25, top))
    )
    for x in (x0 + 0.15, x1 - 0.15):
        for y in np.linspace(y0 + 0.3, y1 - 2.0, 3).tolist():
            bungalow.add_to("trim", solids.post(x, y, half=0.08, z1=top - 0.2))
    bungalow.add_to(
        "walls",
        solids.standing(
            x=(x0 + 0.1, x1 - 0.1),
            y=(y1 - 1.6, y1 - 0.1),
            z1=top - 0.2,
            bottom=True,
        ),
    )
