"""The strip of shops."""

import numpy as np

from cns_drake.city.facades import (
    Building,
    Openings,
    Roof,
    Wing,
    around,
    bays,
    equip_roof,
    foot_band,
    wing_openings,
)

# Kept free in front for canopies [m].
_FRONT_M = 0.4
# Kept free behind for gutters [m].
_BACK_M = 0.1
# Least height above the shops for an upper floor [m].
_UPPER_M = 3.4


class ShopStrip(Building):
    """The strip of shops: low flat-roofed units side by side, all different."""

    def draw(self) -> None:
        """Samples sizes and style."""
        # Height of the shops without their parapets.
        self.ground = round(min(self.uniform(3.6, 4.2), self.height - 0.5), 2)
        self.unit_width = self.uniform(5.5, 9.0)
        # Share of the units with upper floors, if the strip is high enough.
        self.upper = self.uniform(0.2, 0.7)
        # Whether one canopy runs along all shops; otherwise shops have awnings.
        self.canopy = self.chance(0.45)
        self.canopy_reach = self.uniform(0.9, 1.3, digits=2)
        # Step from one height of a parapet to the next.
        self.steps = self.uniform(0.3, 0.6, digits=2)
        self.roof_items = self.draw_roof_items(
            "ac_unit ac_unit vents skylight", low=1, high=5
        )

    def build(self) -> None:
        """Adds all parts of the shops, side by side along the front.

        The building's site must be a rectangle.
        """
        site = self.site
        x0, y0, x1, y1 = site.bounds
        count = max(1, round((x1 - x0) / self.unit_width))
        shares = self.rng.uniform(0.8, 1.2, count)
        bounds = x0 + (x1 - x0) * np.cumsum([0.0, *shares]) / shares.sum()
        highest = self.whole(0, count)
        for k in range(count):
            blind = self.site.blind_edges_of_unit(k, count)
            tall = self.height > self.ground + _UPPER_M and (
                k == highest or self.chance(self.upper)
            )
            top = self.height if k == highest else _parapet_top(self, tall)
            back = y1 - _BACK_M - self.uniform(0.0, 0.12) * (y1 - y0)
            area = (bounds[k], y0 + _FRONT_M, bounds[k + 1], back)
            roof = Roof("flat", parapet=min(0.5, top - self.ground - 0.1))
            wing = Wing.at(
                area, wall_top=top - 0.1, top=top, roof=roof, blind=blind
            )
            _add_unit(self, wing, tall)
            # Only every third unit has equipment on its roof.
            if k % 3 == 0:
                part = f"unit_{k}_"
                equip_roof(
                    self, wing.outline, wing.floor, self.roof_items, prefix=part
                )


def _parapet_top(strip: ShopStrip, tall: bool) -> float:
    """Returns the parapet's height for a unit that is not the highest [m]."""
    drop = strip.steps * strip.whole(0, 3)
    if tall or strip.height < strip.ground + _UPPER_M:
        return round(max(strip.height - drop, strip.ground + 0.4), 2)
    return round(strip.ground + 0.5 + 0.5 * drop, 2)


def _add_unit(strip: ShopStrip, wing: Wing, tall: bool) -> None:
    openings = Openings(strip, wing)
    wall = wing.wall(0)
    cladding = "walls" if strip.chance(0.5) else "facing"
    upper_floors = round((wing.top - strip.ground - 0.6) / 3.0) if tall else 0
    storey = (wing.top - 0.5 - strip.ground) / max(upper_floors, 1)
    width = strip.uniform(1.1, 2.2, digits=2)
    wing_openings.add_window_storeys(
        openings,
        (0, 2),
        floor=strip.ground,
        storey=storey,
        count=upper_floors,
        pitch=width + 1.1,
        width=width,
        head=min(2.3, storey - 0.4),
    )
    wing_openings.add_shops(
        openings,
        0,
        start=0.2,
        end=wall.length - 0.2,
        height=strip.ground,
        width=9.0,
        awnings=0.0 if strip.canopy else 0.7,
        reach=strip.canopy_reach,
    )
    back = [
        bays.gate(width=2.0, height=2.2, depth=0.2),
        wing_openings.sash(width=1.0, z=0.0, sill=1.6, head=2.3),
    ]
    openings.add_bays((2,), z=0.5, pitch=3.6, choices=back, margin=0.7)
    glass = (wing_openings.GLASS_M, *wing_openings.SHOP_GLASS_M)
    openings.enclose(
        glass, bands=(foot_band(height=0.3, reach=0.05),), material=cladding
    )
    if strip.canopy:
        z = strip.ground - 0.95
        reach = strip.canopy_reach
        strip.add_to(
            "awning",
            wall.box(
                x=(0.05, wall.length - 0.05), y=(-0.02, reach), z=(z, z + 0.22)
            ),
        )
    _add_parapet(strip, wing, cladding)


def _add_parapet(strip: ShopStrip, wing: Wing, cladding: str) -> None:
    """Adds a coping along the parapet's front, or piers at its ends."""
    wall = wing.wall(0)
    top = wing.top
    length = wall.length
    if strip.chance(0.5):
        strip.add_to(
            "trim",
            wall.box(
                x=(0.02, length - 0.02),
                y=(-0.05, 0.12),
                z=(top - 0.2, top - 0.02),
            ),
        )
    else:
        for x in (0.25, length - 0.25):
            strip.add_to(
                cladding,
                wall.box(
                    x=around(x, 0.22), y=(-0.05, 0.15), z=(0.0, top - 0.03)
                ),
            )
    visible = top - strip.ground - 0.1 > 0.6 and top < strip.height - 3.0
    if strip.chance(0.4) and visible:
        strip.add_to(
            "sign",
            wall.box(
                x=(0.25 * length, 0.75 * length),
                y=(-0.15, 0.1),
                z=(top - 0.3, top + 0.7),
            ),
        )
