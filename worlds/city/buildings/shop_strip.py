"""The strip of shops."""

import numpy as np

from worlds.city.facades import (
    Building,
    Openings,
    Roof,
    Wing,
    around,
    bays,
    foot_band,
    wing_openings,
)
from worlds.shapes import equip_roof

# Kept free in front for canopies [m].
_FRONT_M = 0.4
# Kept free behind for gutters [m].
_BACK_M = 0.1
# Least height above the shops for an upper floor [m].
_UPPER_M = 3.4
# Height of an upper floor, approximately [m].
_FLOOR_M = 3.0
# Distance of the top of the walls below the parapet's top [m].
_RIM_M = 0.1
# Greatest width of a shop [m].
_MOST_SHOP_M = 9.0
# Share of the shops with an awning, if there is no canopy.
_AWNING_SHARE = 0.7
# Half the width of a pier at the ends of a parapet [m].
_PIER_HALF_M = 0.22
# Every unit of this many has equipment on its roof.
_EQUIPPED_EVERY = 3


class ShopStrip(Building):
    """The strip of shops: low flat-roofed units side by side, all different."""

    def draw(self) -> None:
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
        """Adds all parts of the shops, side by side along the front."""
        site = self.site
        x0, y0, x1, y1 = site.bounds
        count = max(1, round((x1 - x0) / self.unit_width))
        shares = self.rng.uniform(0.8, 1.2, count)
        bounds = x0 + (x1 - x0) * np.cumsum([0.0, *shares]) / shares.sum()
        highest = self.whole(0, count)
        has_upper_floors = self.height > self.ground + _UPPER_M
        for k in range(count):
            is_highest = k == highest
            tall = has_upper_floors and (is_highest or self.chance(self.upper))
            top = self.height if is_highest else _parapet_top(self, tall)
            back = y1 - _BACK_M - self.uniform(0.0, 0.12) * (y1 - y0)
            roof = Roof("flat", parapet=min(0.5, top - self.ground - 0.1))
            wing = Wing.at(
                (bounds[k], y0 + _FRONT_M, bounds[k + 1], back),
                wall_top=top - _RIM_M,
                top=top,
                roof=roof,
                blind=site.blind_edges_of_unit(k, count),
            )
            _add_unit(self, wing, tall)
            if k % _EQUIPPED_EVERY == 0:
                equip_roof(
                    self,
                    wing.outline,
                    wing.floor,
                    self.roof_items,
                    prefix=f"unit_{k}_",
                )


def _parapet_top(strip: ShopStrip, tall: bool) -> float:
    """Returns the parapet's height for a unit that is not the highest [m]."""
    drop = strip.steps * strip.whole(0, 3)
    if tall or strip.height < strip.ground + _UPPER_M:
        return round(max(strip.height - drop, strip.ground + 0.4), 2)
    return round(strip.ground + 0.5 + 0.5 * drop, 2)


def _add_unit(strip: ShopStrip, wing: Wing, tall: bool) -> None:
    """Adds one unit: shops, upper floors if it is tall, and its parapet."""
    openings = Openings(strip, wing)
    wall = wing.wall(0)
    cladding = "walls" if strip.chance(0.5) else "facing"
    upper_floors = 0
    if tall:
        upper_floors = round((wing.top - strip.ground - 0.6) / _FLOOR_M)
    storey = (wing.top - 0.5 - strip.ground) / max(upper_floors, 1)
    width = strip.uniform(1.1, 2.2, digits=2)
    wing_openings.add_window_storeys(
        openings,
        [((0, 2), width + 1.1)],
        floor=strip.ground,
        storey=storey,
        count=upper_floors,
        width=width,
        head=min(2.3, storey - 0.4),
    )
    wing_openings.add_shops(
        openings,
        start=0.2,
        end=wall.length - 0.2,
        height=strip.ground,
        width=_MOST_SHOP_M,
        awnings=0.0 if strip.canopy else _AWNING_SHARE,
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
        canopy = wall.box(
            x=(0.05, wall.length - 0.05),
            y=(-0.02, strip.canopy_reach),
            z=(z, z + 0.22),
        )
        strip.add_to("awning", canopy)
    _add_parapet(strip, wing, cladding)


def _add_parapet(strip: ShopStrip, wing: Wing, cladding: str) -> None:
    """Adds a coping along the parapet's front, or piers at its ends.

    Some parapets that stand out above the shops also get a sign.
    """
    wall = wing.wall(0)
    top, length = wing.top, wall.length
    if strip.chance(0.5):
        coping = wall.box(
            x=(0.02, length - 0.02), y=(-0.05, 0.12), z=(top - 0.2, top - 0.02)
        )
        strip.add_to("trim", coping)
    else:
        for x in (0.25, length - 0.25):
            pier = wall.box(
                x=around(x, _PIER_HALF_M), y=(-0.05, 0.15), z=(0.0, top - 0.03)
            )
            strip.add_to(cladding, pier)
    is_visible = top - strip.ground - 0.1 > 0.6 and top < strip.height - 3.0
    if strip.chance(0.4) and is_visible:
        sign = wall.box(
            x=(0.25 * length, 0.75 * length),
            y=(-0.15, 0.1),
            z=(top - 0.3, top + 0.7),
        )
        strip.add_to("sign", sign)
