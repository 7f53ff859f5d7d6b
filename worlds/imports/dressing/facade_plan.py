"""Plans of walls: where imported buildings get windows, shops and doors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
import math
from typing import NamedTuple

import numpy as np

from worlds.city import stretches
from worlds.imports.dressing.styles import Style
from worlds.imports.dressing.wall_panels import Panel
from worlds.shapes import UpperSides

# Distance from the end of a wall to its first bay [m].
_END_MARGIN = 0.5
# Windows keep this distance from the foot of their wall [m].
_FROM_FOOT = 0.3
# Windows keep this distance from the top of their wall [m].
_FROM_TOP = 0.12
# Windows keep this distance from the ground [m].
_FROM_GROUND = 0.4
# Below a roof, a window may shrink to this share of its height.
_LEAST_HEIGHT_SHARE = 0.7
# Probes are this far in front of a wall [m].
_PROBE_BEFORE = 0.4
# The probe of a wall's top is this far below the top [m].
_PROBE_BELOW_TOP = 0.3
# The height of the paving is taken this far in front of a door's wall [m].
_PAVING_BEFORE = 0.15
# Width of the walls beside a door [m].
JAMB_WIDTH = 0.3
# A front has one door for every such length [m].
_DOOR_EVERY = 16.0
_DOOR_HEIGHT = 2.2
# Least distance from the top of a door to the windows above [m].
_DOOR_BELOW_WINDOW = 0.2
# Least height of a door or a shop window [m].
_LEAST_DOOR_HEIGHT = 1.8
DOOR_WIDTH = 1.15
GATE_WIDTH = 2.5
# Height of a threshold above the paving [m].
_THRESHOLD = 0.04
# Greatest height of the top of a shop window above the ground [m].
_SHOP_TOP = 2.9
# Least distance from the top of a shop window to the floor above [m].
_BELOW_CEILING = 0.75
# Least width of a shop window [m].
_LEAST_SHOP_WIDTH = 2.2
# Doors are this much deeper than windows [m].
DOOR_DEEPER = 0.1
SHOP_DEPTH = 0.35
GATE_DEPTH = 0.3
# A wall stands on the ground if it begins at most this high above the ground
# [m].
_ON_GROUND = 0.6
# Nothing below this height may extend over a car's path [m].
_TALLEST_CAR = 4.0
# A car's path extends this far to each side of its middle [m].
_HALF_PATH = 2.5


class Opening(NamedTuple):
    """A window or a door in a wall, in the wall's panel coordinates [m].

    Attributes:
        row: number of the storey, from 0.
        nth: number of bays between the opening and the nearer end of the wall.
        x0: left end, seen from outside.
        x1: right end.
        z0: height of the lower edge.
        z1: height of the upper edge.
        kind: `window`, `shop`, `door` or `gate`.
    """

    row: int
    nth: int
    x0: float
    x1: float
    z0: float
    z1: float
    kind: str = "window"


@dataclass(frozen=True)
class FacadePlan:
    """The plan of a wall: its panel, style and openings.

    Attributes:
        panel: the wall.
        style: the style of the building.
        openings: the wall's windows and doors.
        floor: height of the lowest floor above the panel's origin [m].
        ground: height of the ground in front, above the panel's origin [m].
        to_drive: distance from the wall to the nearest drive [m].
        top_is_free: whether no building touches the wall's upper edge.
    """

    panel: Panel
    style: Style
    openings: Sequence[Opening]
    floor: float
    ground: float
    to_drive: float
    top_is_free: bool = True

    @property
    def stands_on_ground(self) -> bool:
        """Whether the wall begins at the ground, and not above a roof."""
        return self.ground > -_ON_GROUND

    @property
    def on_street(self) -> list[Opening]:
        """Openings at ground level; none if the wall starts above ground."""
        on_ground = self.stands_on_ground
        return [o for o in self.openings if o.row == 0 and on_ground]

    def is_in_the_way(self, z: float, reach: float) -> bool:
        """Returns whether a part on the wall would block a car on a drive.

        `z` is the height of the part above the panel's origin, and `reach` is
        how far the part protrudes from the wall [m].
        """
        is_low = z - self.ground < _TALLEST_CAR
        return is_low and self.to_drive < reach + _HALF_PATH

    def probes(self) -> np.ndarray:
        """Returns a point in front of each opening and of the wall's top.

        The result contains (N + 1, 3) points in W, for N openings [m]; the last
        point belongs to the top. An opening, or the top, is occluded if the
        corresponding point cannot be seen.
        """
        panel = self.panel
        at = [((o.x0 + o.x1) / 2, (o.z0 + o.z1) / 2) for o in self.openings]
        at.append((panel.length / 2, panel.height - _PROBE_BELOW_TOP))
        x, z = np.transpose(at)
        return panel.place(x, z, _PROBE_BEFORE)

    def threshold(self, door: Opening, paving: UpperSides) -> float:
        """Returns the height of a door's threshold in panel coordinates [m].

        The threshold is one step above the highest paving in front of the door
        and in its recess. Paving far above or below the ground is ignored.
        """
        depths = {"shop": SHOP_DEPTH, "gate": GATE_DEPTH}
        depth = depths.get(door.kind, self.style.recess + DOOR_DEEPER)
        middle = (door.x0 + door.x1) / 2
        x, out = np.meshgrid(
            [door.x0 + JAMB_WIDTH, middle, door.x1 - JAMB_WIDTH],
            [_PAVING_BEFORE, -depth / 2, -depth],
        )
        places = self.panel.place(x, np.zeros(x.shape), out).reshape(-1, 3)
        low = float(paving.heights(places[:, :2]).max()) - self.panel.origin[2]
        is_near = abs(low - self.ground) < _ON_GROUND
        return max((low if is_near else self.ground) + _THRESHOLD, 0.0)

    def without(self, is_hidden: np.ndarray) -> FacadePlan:
        """Returns the plan without its occluded openings.

        The field `top_is_free` of the result is false if the top is occluded.

        Args:
            is_hidden: (N + 1,) bool, which of the points that `probes` returns
                are occluded: N points of openings, and last the point of the
                top.
        """
        pairs = zip(self.openings, is_hidden[:-1], strict=True)
        return replace(
            self,
            openings=[o for o, is_occluded in pairs if not is_occluded],
            top_is_free=not is_hidden[-1],
        )


def plan_facade(
    panel: Panel, style: Style, base: float, ground: float, to_drive: float
) -> FacadePlan:
    """Returns a plan with a window in each bay and storey of a wall.

    Args:
        panel: the wall.
        style: the style of the building.
        base: height of the building's lowest floor in W [m].
        ground: height of the ground in front of the wall in W [m].
        to_drive: distance from the wall to the nearest drive [m].
    """
    floor, ground = base - panel.origin[2], ground - panel.origin[2]
    cells = stretches(panel.length, style.window_pitch, _END_MARGIN)
    first = max(0, math.floor(-floor / style.storey))
    last = math.ceil((panel.height - floor) / style.storey)
    if style.use == "church":
        last = min(last, 1)
    top = panel.height - _FROM_TOP - style.cornice
    openings = []
    for row in range(first, last):
        low = floor + row * style.storey + style.window_sill
        if (
            low >= max(_FROM_FOOT, ground + _FROM_GROUND)
            and low + _LEAST_HEIGHT_SHARE * style.window_height <= top
        ):
            high = min(low + style.window_height, top)
            openings += [
                Opening(row, min(k, len(cells) - 1 - k), x0, x1, low, high)
                for k, (x0, x1) in enumerate(cells)
            ]
    return FacadePlan(panel, style, openings, floor, ground, to_drive)


def with_shops(plan: FacadePlan, paving: UpperSides) -> FacadePlan:
    """Returns the plan with shop windows on the ground floor, where possible.

    Only wide openings towards the street become shop windows.

    Args:
        plan: plan of the wall.
        paving: upper sides of the paving in front of the wall.
    """
    top = plan.floor + plan.style.storey - _BELOW_CEILING
    top = min(top, plan.ground + _SHOP_TOP)
    street = set(plan.on_street)
    openings = []
    for o in plan.openings:
        if o in street and o.x1 - o.x0 >= _LEAST_SHOP_WIDTH:
            shop = o._replace(kind="shop", z1=top)
            low = plan.threshold(shop, paving)
            if top >= low + _LEAST_DOOR_HEIGHT:
                o = shop._replace(z0=low)
        openings.append(o)
    return replace(plan, openings=openings)


def with_doors(plan: FacadePlan, paving: UpperSides) -> FacadePlan:
    """Returns a wall's plan with doors in place of some ground-floor windows.

    `paving` is the paving in front of the wall.
    """
    street = plan.on_street
    if not street or any(o.kind == "shop" for o in street):
        return plan
    is_gate = plan.style.use in ("shed", "industrial")
    kind, width = ("gate", GATE_WIDTH) if is_gate else ("door", DOOR_WIDTH)
    # A door must not extend into the windows above.
    above = min((o.z0 for o in plan.openings if o.row > 0), default=np.inf)
    most = min(plan.panel.height - JAMB_WIDTH, above - _DOOR_BELOW_WINDOW)
    number = max(1, round(plan.panel.length / _DOOR_EVERY))
    wanted = (np.arange(number) + 0.5) * plan.panel.length / number
    middles = np.array([(o.x0 + o.x1) / 2 for o in street])
    nearest = np.abs(middles - wanted[:, None]).round(6).argmin(axis=1)
    doors = {street[k] for k in nearest.tolist()}
    openings = []
    for o in plan.openings:
        middle = (o.x0 + o.x1) / 2
        has_room = middle - o.x0 >= width + 2 * JAMB_WIDTH
        # Otherwise a house would have a door but no window to the street.
        is_alone = len(doors) == len(street) and has_room
        door = o._replace(kind=kind, x1=middle if is_alone else o.x1)
        low = plan.threshold(door, paving) if o in doors else np.inf
        high = min(low + _DOOR_HEIGHT, most)
        if high < low + _LEAST_DOOR_HEIGHT:
            openings.append(o)
            continue
        openings.append(door._replace(z0=low, z1=high))
        if is_alone:
            openings.append(o._replace(x0=middle))
    return replace(plan, openings=openings)
