"""Shops along a wall: glass, a recessed door, a fascia, an awning, signs."""

from __future__ import annotations

from cns_drake.city.buildings.house_parts.openings import Openings
from cns_drake.city.buildings.parts import bays, details
from cns_drake.city.buildings.parts.facades import Relief
from cns_drake.city.buildings.parts.site import Assembly

# Depths of shop windows and of the doors between them [m].
SHOP_GLASS_M = (0.35, 0.95)


def add_shops(
    out: Assembly,
    wall: details.WallFrame,
    openings: Openings,
    edge: int,
    start: float,
    end: float,
    height: float,
    *,
    width: float = 5.5,
    awnings: float = 0.6,
    reach: float = 1.2,
) -> None:
    """Adds shops side by side between two points of a wall.

    Args:
        out: gets `trim` (fascias), `awning` and `sign`; its `rng` draws the
            differences between shops.
        wall, openings, edge: the wall.
        start, end: the stretch [m].
        height: of the ground floor [m].
        width: wanted, of a shop [m].
        awnings: part of the shops with an awning.
        reach: of awnings out of the wall [m].
    """
    head, rng = round(height - 1.15, 2), out.rng
    for a, b in bays.stretches(end - start, width, 0.1):
        x0, x1 = round(start + a, 2), round(start + b, 2)
        if x1 - x0 < 2.4:
            continue
        shop = bays.shop_front(head, SHOP_GLASS_M[0], pier=0.25)
        if rng.random() < 0.5:
            shop = _reversed(shop)
        openings.put(edge, (x0 + x1) / 2, x1 - x0, shop)
        z, tall = head + 0.08, round(float(rng.uniform(0.55, 0.8)), 2)
        fascia = wall.box(x0 + 0.15, x1 - 0.15, -0.02, 0.14, z, z + tall)
        out.add_to("sign", fascia)
        if rng.random() < awnings:
            shade = details.awning(
                x0 + 0.3, x1 - 0.3, reach, max(2.4, head - 0.8), head + 0.05
            )
            out.add_to("awning", wall.place(shade))
        if rng.random() < 0.4:
            x = x0 + 0.25 if rng.random() < 0.5 else x1 - 0.25
            # Blades hang above heads, like awnings.
            z = max(2.4, head + 0.1)
            blade = wall.box(x - 0.06, x + 0.06, 0.1, 0.9, z, z + 0.8)
            out.add_to("trim", blade)


def _reversed(bay: bays.Bay) -> bays.Bay:
    """Returns a bay mirrored left to right."""

    def mirrored(x0: float, x1: float) -> list[Relief]:
        return [
            r._replace(x0=round(x0 + x1 - r.x1, 2), x1=round(x0 + x1 - r.x0, 2))
            for r in bay(x0, x1)
        ]

    return mirrored
