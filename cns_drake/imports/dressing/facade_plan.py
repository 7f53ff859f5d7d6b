"""Plans a wall: its windows, and which of them become doors and shops."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cns_drake.imports.dressing.reliefs import Openings
from cns_drake.imports.dressing.styles import Style, Use
from cns_drake.imports.dressing.wall_panels import Panel

# Between the end of a wall and its first window [m].
_MARGIN = 0.5
# Windows keep this distance from the foot and the top of their wall, and from
# the ground [m].
_FROM_FOOT, _FROM_TOP, _FROM_GROUND = 0.3, 0.12, 0.4
# Below a roof a window may shrink to this part of its height.
_LEAST_PART = 0.7
# Probes are this far in front of a wall [m].
_BEFORE = 0.4
# The paving before a door is looked at this far from its wall [m].
_STEP = 0.15
# One door for each such length of a front [m].
_DOOR_EVERY = 16.0
_DOOR_HEIGHT, _LEAST_DOOR = 2.2, 1.8
_DOOR_WIDTH = 1.15
_GATE_WIDTH = 2.5
# Least wall between a door and the window beside it [m].
_BESIDE_DOOR = 0.3
_SILL, _THRESHOLD = 0.45, 0.04
_SHOP_HEIGHT = 2.9
_PIER = 0.5
# A door is this much deeper than a window [m].
_DOOR_DEEPER = 0.12
# A wall stands on the ground if it begins at most this high above it [m].
_ON_GROUND = 0.6


@dataclass(frozen=True)
class FacadePlan:
    """A wall with its openings.

    Attributes:
        panel: the wall.
        style: of its building.
        openings: of it.
        spacing: from one window to the next [m].
        floor: height of the lowest floor in the panel [m].
        ground: height of the ground in front, in the panel's coordinates [m].
        top_is_free: whether nothing is built against its upper edge.
        shop: whether its ground floor is a shop.
    """

    panel: Panel
    style: Style
    openings: Openings
    spacing: float
    floor: float
    ground: float
    top_is_free: bool = True
    shop: bool = False

    @property
    def stands_on_ground(self) -> bool:
        return self.ground > -_ON_GROUND

    @property
    def street_openings(self) -> np.ndarray:
        """Returns which (N,) openings are on the ground floor."""
        return np.asarray(self.openings.row == 0) & self.stands_on_ground

    def probes(self) -> np.ndarray:
        """Returns places (N + 1, 3) before the openings, and at the top."""
        o, panel = self.openings, self.panel
        x = np.append((o.x0 + o.x1) / 2.0, panel.length / 2.0)
        z = np.append((o.z0 + o.z1) / 2.0, panel.height - _FROM_FOOT)
        return panel.place(x, z, _BEFORE)

    def thresholds(self) -> np.ndarray:
        """Returns places (D, 9, 3) before and in the recesses of its doors."""
        o = self.openings.chosen(self.openings.is_door)
        x = np.stack([o.x0, (o.x0 + o.x1) / 2.0, o.x1])[:, None]
        deep = np.stack([np.full(len(o.depth), -_STEP), o.depth / 2, o.depth])
        x, out = np.broadcast_arrays(x, -deep)
        at = np.moveaxis(np.stack([x, out]).reshape(2, 9, -1), 2, 1)
        return self.panel.place(at[0], np.zeros(at[0].shape), at[1])

    def standing_on(self, heights: np.ndarray) -> FacadePlan:
        """Returns the plan with doors a step above the paving before them.

        Args:
            heights: (D,) of the highest paving at each door; one far above or
                below the ground does not count [m].
        """
        o = self.openings
        z0, low = o.z0.copy(), heights - self.panel.origin[2]
        is_near = np.abs(low - self.ground) < _ON_GROUND
        low = np.where(is_near, np.maximum(low + _THRESHOLD, 0.0), -np.inf)
        top = o.z1[o.is_door]
        fits = is_near & (top - low > _LEAST_DOOR)
        z0[o.is_door] = np.where(fits, low, z0[o.is_door])
        return replace(self, openings=o._replace(z0=z0))

    def without(self, is_hidden: np.ndarray) -> FacadePlan:
        """Returns the plan without hidden openings.

        Args:
            is_hidden: (N + 1,) whether something stands at the probes.
        """
        return replace(
            self,
            openings=self.openings.chosen(~is_hidden[:-1]),
            top_is_free=not is_hidden[-1],
        )


def plan_facade(
    panel: Panel, style: Style, base: float, ground: float
) -> FacadePlan:
    """Returns a wall full of windows.

    Args:
        panel: the wall.
        style: of its building.
        base: height of the lowest floor of the building [m].
        ground: height of the ground before the panel [m].
    """
    floor, ground = base - panel.origin[2], ground - panel.origin[2]
    room = panel.length - 2.0 * _MARGIN
    count = int(room / style.pitch + 0.5)
    if count == 0 and room >= style.width:
        count = 1
    spacing = room / max(count, 1)
    first = max(0, int(np.floor(-floor / style.storey)))
    last = int(np.ceil((panel.height - floor) / style.storey))
    if style.use is Use.CHURCH:
        last = min(last, 1)
    rows = np.arange(first, max(first, last))
    low = floor + rows * style.storey + style.sill
    top = panel.height - _FROM_TOP - style.cornice
    lowest = max(_FROM_FOOT, ground + _FROM_GROUND)
    fits = (low >= lowest) & (low + _LEAST_PART * style.height <= top)
    rows, low = rows[fits], low[fits]
    middles = _MARGIN + (np.arange(count) + 0.5) * spacing
    row, x = (v.ravel() for v in np.meshgrid(rows, middles, indexing="ij"))
    z0 = np.repeat(low, count)
    half = min(style.width, spacing - 0.3, panel.length - 0.4) / 2.0
    openings = Openings(
        row,
        x - half,
        x + half,
        z0,
        np.minimum(z0 + style.height, top),
        np.full(len(row), style.depth),
        np.zeros(len(row), dtype=bool),
    )
    if half < 0.2:
        openings = openings.chosen(np.zeros(len(row), dtype=bool))
    return FacadePlan(panel, style, openings, spacing, floor, ground)


def with_shops(plan: FacadePlan) -> FacadePlan:
    """Returns a wall whose windows on the ground floor are shop windows."""
    is_shop = plan.street_openings
    half = min(plan.spacing - _PIER, 4.0) / 2.0
    top = plan.floor + plan.style.storey - 0.75
    top = min(top, plan.ground + _SHOP_HEIGHT)
    if not is_shop.any() or half < 0.6 or top < plan.ground + _LEAST_DOOR:
        return plan
    o = plan.openings
    middle = (o.x0 + o.x1) / 2.0
    is_door = is_shop & (np.cumsum(is_shop) % 3 == 2)
    low = np.where(is_door, plan.ground + _THRESHOLD, plan.ground + _SILL)
    changed = o._replace(
        x0=np.where(is_shop, middle - half, o.x0),
        x1=np.where(is_shop, middle + half, o.x1),
        z0=np.where(is_shop, np.maximum(low, 0.0), o.z0),
        z1=np.where(is_shop, top, o.z1),
        depth=np.where(is_door, o.depth + _DOOR_DEEPER, o.depth),
        is_door=o.is_door | is_door,
    )
    return replace(plan, openings=changed, shop=True)


def with_doors(plan: FacadePlan) -> FacadePlan:
    """Returns a wall with doors in place of windows on its ground floor."""
    o = plan.openings
    places = np.flatnonzero(plan.street_openings)
    if plan.shop or not len(places):
        return plan
    number = max(1, round(plan.panel.length / _DOOR_EVERY))
    wanted = (np.arange(number) + 0.5) * plan.panel.length / number
    middle = (o.x0 + o.x1) / 2.0
    nearest = np.abs(middle[places] - wanted[:, None]).argmin(axis=1)
    is_door = np.zeros(len(middle), dtype=bool)
    is_door[places[nearest]] = True
    is_gate = plan.style.use in (Use.SHED, Use.INDUSTRIAL)
    width = _GATE_WIDTH if is_gate else _DOOR_WIDTH
    aside = 0.0
    room = plan.spacing / 2.0 - _BESIDE_DOOR
    if is_door[places].all() and room >= width:
        # A house with a door only would have no window to the street.
        aside = plan.spacing / 4.0
    half = min(width, plan.spacing - 0.3, plan.panel.length - 0.4) / 2.0
    low = max(plan.ground + _THRESHOLD, 0.0)
    high = min(low + _DOOR_HEIGHT, plan.panel.height - 0.2)
    # A door must not reach into the windows above.
    above = o.z0[o.row > 0]
    high = min(high, float(above.min(initial=np.inf)) - 0.2)
    if high < low + _LEAST_DOOR:
        return plan
    changed = o._replace(
        x0=np.where(is_door, middle - aside - half, o.x0),
        x1=np.where(is_door, middle - aside + half, o.x1),
        z0=np.where(is_door, low, o.z0),
        z1=np.where(is_door, high, o.z1),
        depth=np.where(is_door, o.depth + _DOOR_DEEPER, o.depth),
        is_door=o.is_door | is_door,
    )
    if aside > 0.0:
        narrow = np.minimum(o.x1 - o.x0, room)[is_door] / 2.0
        windows = o.chosen(is_door)._replace(
            x0=middle[is_door] + aside - narrow,
            x1=middle[is_door] + aside + narrow,
        )
        changed = changed.joined(windows)
    return replace(plan, openings=changed)


def balcony_windows(plan: FacadePlan) -> np.ndarray:
    """Returns which (N,) windows have a balcony: every other above ground."""
    o = plan.openings
    column = np.round(((o.x0 + o.x1) / 2.0 - _MARGIN) / plan.spacing - 0.5)
    count = round((plan.panel.length - 2.0 * _MARGIN) / plan.spacing)
    from_end = np.minimum(column, count - 1 - column)
    return np.asarray((o.row >= 1) & (from_end % 2 == 1))


def opened_to_floor(plan: FacadePlan, which: np.ndarray) -> FacadePlan:
    """Returns a wall some of whose windows begin at their floor."""
    o = plan.openings
    floor = plan.floor + o.row * plan.style.storey + 0.1
    return replace(
        plan,
        openings=o._replace(
            z0=np.where(which, np.maximum(np.minimum(floor, o.z0), 0.0), o.z0)
        ),
    )
