"""The dressed walls and roofs of imported buildings.

A wall gets windows, of which some become doors and shops, and their faces;
a roof gets equipment or chimneys.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace
import math

import numpy as np
import shapely
from shapely.geometry import Polygon, box

from cns_drake.city.facades import details
from cns_drake.city.facades.assembly import Assembly, Site
from cns_drake.city.facades.roofs import add_chimney, equip_roof
from cns_drake.city.geometry.mesh import Mesh
from cns_drake.city.geometry.structures import Model
from cns_drake.city.geometry.upper_sides import (
    UpperSides,
    long_normals,
    unit_normals,
)
from cns_drake.imports.dressing.styles import Style, Use
from cns_drake.imports.dressing.wall_panels import (
    Openings,
    Panel,
    boxes_on,
    framed,
    open_wall,
)

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
        style: style of its building.
        openings: its openings.
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
        style: style of its building.
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


_PLINTH_REACH = 0.06
_CORNICE_REACH = 0.28
_GUTTER, _GUTTER_REACH = 0.15, 0.14
_SIGN_REACH, _SIGN_HEIGHT = 0.15, 0.5
_BALCONY_REACH, _BALCONY_WIDTH = 1.15, 3.0
_AWNING_REACH, _AWNING_HEIGHT = 1.1, 0.55
_SILL_HEIGHT, _SILL_BESIDE, _SILL_REACH = 0.08, 0.08, 0.07
# Windows farther from drives have no sills, or no frames, or lie on their wall
# and not in recesses, and walls have no plinths [m].
_SILLS_WITHIN, _FRAMES_WITHIN, _RECESSES_WITHIN = 12.0, 20.0, 25.0
# Nothing lower than this may hang over a car's path, within this distance of
# its middle [m].
_TALLEST_CAR, _BESIDE = 4.0, 2.5
# Cornices of lower walls would collide with doors [m].
_LEAST_WALL = 2.5


@dataclass
class Faces:
    """Faces of a building by material, and counts of added details.

    Attributes:
        quads: material -> (K, 4, 3) arrays [m].
        triangles: material -> (M, 3, 3) arrays [m].
        counts: kind of detail added at random -> number.
    """

    quads: dict[str, list[np.ndarray]] = field(default_factory=dict)
    triangles: dict[str, list[np.ndarray]] = field(default_factory=dict)
    counts: Counter[str] = field(default_factory=Counter)

    def add(self, material: str, faces: np.ndarray) -> None:
        """Adds quads (K, 4, 3) or triangles (M, 3, 3) [m]."""
        if len(faces):
            group = self.quads if faces.shape[1] == 4 else self.triangles
            group.setdefault(material, []).append(faces)

    def meshes(self) -> dict[str, Mesh]:
        """Returns a mesh for each material."""
        found = {}
        for material in sorted({*self.quads, *self.triangles}):
            quads = self.quads.get(material, [])
            triangles = self.triangles.get(material, [])
            vertices = np.concatenate(
                [some.reshape(-1, 3) for some in (*quads, *triangles)]
            )
            ends = 4 * sum(map(len, quads))
            four = np.arange(ends).reshape(-1, 4).tolist()
            three = np.arange(ends, len(vertices)).reshape(-1, 3).tolist()
            faces = (*map(tuple, four), *map(tuple, three))
            found[material] = Mesh(vertices, faces)
        return found


def add_facade(
    faces: Faces,
    plan: FacadePlan,
    to_drive: float,
    rng: np.random.Generator,
) -> None:
    """Adds all faces of a wall.

    Args:
        faces: faces of the building.
        plan: plan of the wall.
        to_drive: distance from the wall to the nearest drive [m].
        rng: random draws of the building.
    """
    panel, style = plan.panel, plan.style
    has_balconies = style.balconies and bool(rng.random() < 0.6)
    if has_balconies:
        plan = opened_to_floor(plan, balcony_windows(plan))
    has_recesses = to_drive < _RECESSES_WITHIN
    wall = open_wall(panel, plan.openings, has_recesses)
    if wall is None:
        faces.add("body", panel.triangles)
    else:
        plan = replace(plan, openings=wall.openings)
        faces.add("body", wall.quads)
        faces.add("body", wall.triangles)
        is_glass = ~plan.openings.is_door | plan.shop
        faces.add("doors", wall.backs[~is_glass])
        if to_drive < _FRAMES_WITHIN:
            frames, panes = framed(panel, plan.openings.chosen(is_glass))
            faces.add("frames", frames)
            faces.add("glass", panes)
        else:
            faces.add("glass", wall.backs[is_glass])
        if to_drive < _SILLS_WITHIN:
            _add_sills(faces, plan)
        faces.counts["windows"] += int((~plan.openings.is_door).sum())
        faces.counts["doors"] += int(plan.openings.is_door.sum())
        if has_balconies:
            _add_balconies(faces, plan, to_drive)
        if plan.shop:
            _add_signs(faces, plan, to_drive, rng)
    if to_drive < _RECESSES_WITHIN:
        _add_plinth(faces, plan)
    _add_cornice(faces, plan)


def _add_sills(faces: Faces, plan: FacadePlan) -> None:
    o = plan.openings.chosen(~plan.openings.is_door)
    low = o.z0 - _SILL_HEIGHT
    is_sill = low > 0.05
    x0, x1 = (o.x0 - _SILL_BESIDE)[is_sill], (o.x1 + _SILL_BESIDE)[is_sill]
    sills = boxes_on(
        plan.panel, x0, x1, low[is_sill], o.z0[is_sill], _SILL_REACH
    )
    faces.add("trim", sills)


def _add_plinth(faces: Faces, plan: FacadePlan) -> None:
    panel, style = plan.panel, plan.style
    top = plan.ground + style.plinth
    if (
        style.plinth
        and plan.stands_on_ground
        and plan.top_is_free
        and 0.1 < top < panel.height
        and panel.outline is None
    ):
        start, end = _between(plan, top)
        reach = _PLINTH_REACH
        start[start == 0.0] -= reach
        end[end == panel.length] += reach
        faces.add("trim", boxes_on(panel, start, end, 0.0, top, reach))
        faces.counts["plinths"] += 1


def _add_cornice(faces: Faces, plan: FacadePlan) -> None:
    panel, style = plan.panel, plan.style
    if (
        style.cornice
        and plan.top_is_free
        and panel.height > _LEAST_WALL
        and panel.outline is None
    ):
        is_gutter = style.cornice < _GUTTER
        reach = _GUTTER_REACH if is_gutter else _CORNICE_REACH
        low = panel.height - style.cornice
        cornice = boxes_on(
            panel, -reach, panel.length + reach, low, panel.height, reach
        )
        faces.add("trim", cornice)
        faces.counts["gutters" if is_gutter else "cornices"] += 1


def _between(plan: FacadePlan, top: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns the stretches of a wall without openings below a height."""
    o = plan.openings
    low = o.z0 < top + 0.05
    order = np.argsort(o.x0[low])
    start = np.append(0.0, o.x1[low][order])
    end = np.append(o.x0[low][order], plan.panel.length)
    wide = end - start > 0.05
    return start[wide], end[wide]


def _add_balconies(faces: Faces, plan: FacadePlan, to_drive: float) -> None:
    o, panel = plan.openings, plan.panel
    width = min(_BALCONY_WIDTH, 1.5 * plan.spacing)
    for k in np.flatnonzero(balcony_windows(plan)):
        middle = (o.x0[k] + o.x1[k]) / 2.0
        x0 = max(0.1, middle - width / 2.0)
        x1 = min(panel.length - 0.1, middle + width / 2.0)
        z = float(o.z0[k]) - 0.02
        if _in_the_way(z - plan.ground, _BALCONY_REACH, to_drive):
            continue
        mesh = details.balcony(x0, x1, _BALCONY_REACH, z)
        faces.add("trim", _placed(mesh, panel))
        faces.counts["balconies"] += 1


def _add_signs(
    faces: Faces,
    plan: FacadePlan,
    to_drive: float,
    rng: np.random.Generator,
) -> None:
    """Adds the signs and awnings above shop windows."""
    o, panel = plan.openings, plan.panel
    shops = np.flatnonzero(plan.street_openings)
    if not len(shops):
        return
    z = float(o.z1[shops].max()) + 0.06
    height = min(_SIGN_HEIGHT, panel.height - z - 0.05)
    if height > 0.15:
        start, end = float(o.x0[shops].min()), float(o.x1[shops].max())
        sign = boxes_on(panel, start, end, z, z + height, _SIGN_REACH)
        faces.add("sign", sign)
    faces.counts["shop windows"] += len(shops)
    low = z - _AWNING_HEIGHT
    has_awning = rng.random(len(shops)) < 0.4
    if _in_the_way(low - plan.ground, _AWNING_REACH, to_drive):
        return
    for k in shops[has_awning]:
        limits = (float(o.x0[k]), float(o.x1[k]), _AWNING_REACH, low, z)
        faces.add("sign", _placed(details.awning(*limits), panel))
        faces.counts["awnings"] += 1


def _in_the_way(height: float, reach: float, to_drive: float) -> bool:
    return height < _TALLEST_CAR and to_drive < reach + _BESIDE


def _placed(mesh: Mesh, panel: Panel) -> np.ndarray:
    """Returns a mesh (x along a wall, y outwards, z up) as (M, 3, 3) [m]."""
    x, y, z = mesh.vertices.T
    return panel.place(x, z, y)[mesh.triangles()[:, ::-1]]


# A roof is level if the z of its unit normal is at least the first; level parts
# of one height differ by less than the second [m].
_LEVEL, _SAME_HEIGHT = 0.999, 0.1
_FLAT_PART = 0.6
_LEAST_ROOF = 40.0  # [m^2]
# Roof area for each piece of equipment [m^2], and the most pieces.
_ROOF_EACH, _MOST = 90.0, 6
_ITEMS = {
    Use.FLATS: "stair_house vents skylight tank vents dish",
    Use.OFFICE: "lift_house air_handler ac_unit ac_unit vents cooling_tower",
    Use.RETAIL: "air_handler ac_unit skylight vents ac_unit dish",
    Use.PUBLIC: "stair_house air_handler skylight vents ac_unit mast",
    Use.INDUSTRIAL: "skylight vents skylight vents air_handler tank",
    Use.HOUSE: "vents dish",
}
_CHIMNEYS = (Use.HOUSE, Use.FLATS, Use.PUBLIC)
_BRICK = (0.45, 0.27, 0.22)
# Depth of a chimney's foot below the ridge, and its scale against the shared
# mesh.
_BELOW_RIDGE, _CHIMNEY_SCALE = 0.35, 0.6
# Points of a ridge are at most this much below its highest one [m].
_RIDGE = 0.15


def is_flat_roof(roof: np.ndarray) -> bool:
    """Returns whether most of a roof (M, 3, 3) is level."""
    above = np.abs(long_normals(roof)[:, 2])
    level = np.abs(unit_normals(roof)[:, 2]) > _LEVEL
    return bool(above[level].sum() >= _FLAT_PART * above.sum())


def roof_pieces(
    roof: np.ndarray,
    style: Style,
    is_flat: bool,
    rng: np.random.Generator,
    name: str,
) -> Model:
    """Returns the equipment of a roof, in the world.

    Args:
        roof: (M, 3, 3) its upper sides [m].
        style: style of the building.
        is_flat: whether its roof is flat.
        rng: random draws of the building.
        name: name of the structure.
    """
    footprint = box(0.0, 0.0, 1.0, 1.0)
    out = Assembly(Site(footprint, name), rng)
    if is_flat:
        _equip(out, roof, style)
    elif style.use in _CHIMNEYS:
        _add_chimneys(out, roof)
    return Model(tuple(out.parts), out.meshes, footprint)


def _equip(out: Assembly, roof: np.ndarray, style: Style) -> None:
    items = _ITEMS.get(style.use, "").split()
    found = _largest_level(roof)
    if found is None or not items:
        return
    area, z = found
    count = min(_MOST, len(items), int(area.area / _ROOF_EACH) + 1)
    ring = np.array(area.exterior.coords)[:-1]
    equip_roof(out, ring, z, items[:count])


def _largest_level(roof: np.ndarray) -> tuple[Polygon, float] | None:
    """Returns the largest level part of a roof without holes, and its z."""
    level = roof[unit_normals(roof)[:, 2] > _LEVEL]
    best: tuple[Polygon, float] | None = None
    if not len(level):
        return None
    steps = np.round(level[:, :, 2].mean(axis=1) / _SAME_HEIGHT)
    for step in np.unique(steps):
        some = level[steps == step]
        whole = shapely.union_all(
            [Polygon(one) for one in np.round(some[:, :, :2], 3)],
            grid_size=1e-3,
        )
        for part in shapely.get_parts(whole):
            if isinstance(part, Polygon) and part.area > _LEAST_ROOF:
                part = _without_holes(part)
                if best is None or part.area > best[0].area:
                    best = part, float(some[:, :, 2].max())
    return best


def _without_holes(area: Polygon) -> Polygon:
    """Returns the largest piece of an area that is cut through its holes."""
    while area.interiors:
        x0, y0, x1, y1 = area.bounds
        x = Polygon(area.interiors[0]).centroid.x
        halves = [
            part
            for half in (box(x0, y0, x, y1), box(x, y0, x1, y1))
            for part in shapely.get_parts(area.intersection(half))
            if isinstance(part, Polygon)
        ]
        area = max(halves, key=lambda part: part.area)
    return area


def _add_chimneys(out: Assembly, roof: np.ndarray) -> None:
    corners = roof.reshape(-1, 3)
    ridge = corners[corners[:, 2] > corners[:, 2].max() - _RIDGE]
    start = ridge[np.lexsort([ridge[:, 1], ridge[:, 0]])[0]]
    end = ridge[np.linalg.norm(ridge - start, axis=1).argmax()]
    length = float(np.linalg.norm(end - start))
    yaw = math.atan2(end[1] - start[1], end[0] - start[0])
    sides = UpperSides(roof)
    count = 1 + int(length > 15.0)
    for k, share in enumerate(out.rng.uniform(0.12, 0.88, 2)[:count]):
        x, y, z = start + share * (end - start)
        height = float(sides.heights(np.array([[x, y]]))[0])
        # Two gables may have no ridge between them.
        if height > z - 1.0:
            item = "chimney_row" if out.rng.random() < 0.3 else "chimney"
            scale = (_CHIMNEY_SCALE, _CHIMNEY_SCALE, _CHIMNEY_SCALE)
            xyz = (x, y, height - _BELOW_RIDGE)
            part = f"chimney_{k}"
            add_chimney(out, part, xyz, _BRICK, item=item, yaw=yaw, scale=scale)
