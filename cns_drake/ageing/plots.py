"""Plots of land, the buildings on them, and additions to buildings."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
import math

import numpy as np
import shapely
from shapely import affinity
from shapely.geometry import Polygon, box
from shapely.geometry.base import BaseGeometry

from cns_drake.city.buildings import ARCHETYPES, sample
from cns_drake.city.dice import Rgb
from cns_drake.city.geometry import (
    MeshShape,
    Model,
    Part,
    Structure,
    assemble,
    block,
    from_above,
    part_triangles,
    placed,
    polygons_of,
    unit_normals,
)
from cns_drake.city.geometry.rectangles import largest_rectangle
from cns_drake.city.growth.building_sites import building_site
from cns_drake.city.growth.lot_uses import lot_objects
from cns_drake.city.growth.lowering import lowered, top_of
from cns_drake.city.placement.objects import OBJECTS
from cns_drake.transient.scaffolds import scaffold

# Archetypes that are built today -> their weight in the random choice among
# those that fit.
_BUILT_TODAY = {
    "balcony_flats": 4,
    "gallery_flats": 2,
    "garden_flats": 3,
    "walk_up": 2,
    "brick_block": 2,
    "office": 3,
    "court_block": 2,
    "terrace": 2,
    "row_house": 2,
    "shop_house": 1,
    "semi_detached": 1,
    "detached_house": 1,
    "bungalow": 1,
    "grid_tower": 2,
    "banded_tower": 2,
    "slab_tower": 1,
    "podium_tower": 1,
}
# Neighbours closer than this have blank walls towards each other [m].
PARTY_WALL = 3.1
# A frame is at least this high, about one storey [m].
_LEAST_FRAME = 4.0
_STOREY = 3.0
# Greatest length of a scaffold [m].
_LONGEST_SCAFFOLD = 25.0
# Greatest height of a scaffold [m].
_HIGHEST_SCAFFOLD = 16.0
_COLOURS: tuple[Rgb, ...] = (
    (0.93, 0.91, 0.86),
    (0.86, 0.79, 0.66),
    (0.8, 0.62, 0.48),
    (0.72, 0.42, 0.32),
    (0.62, 0.66, 0.68),
    (0.45, 0.47, 0.5),
    (0.7, 0.76, 0.68),
    (0.9, 0.82, 0.55),
    (0.78, 0.8, 0.84),
    (0.55, 0.36, 0.3),
)
_GLASS: Rgb = (0.25, 0.3, 0.35)
_CONCRETE: Rgb = (0.7, 0.69, 0.67)
_STEEL: Rgb = (0.5, 0.52, 0.54)
_INSULATION = 0.15


@dataclass(frozen=True)
class Plot:
    """The ground of one building.

    The x axis of the plot's frame S runs along the street, and its y axis
    points away from the street.

    Attributes:
        area: area of the plot in W [m].
        xy: origin of S in W [m].
        yaw: heading of the x axis of S [rad].
        z: height of the ground [m].
    """

    area: BaseGeometry
    xy: tuple[float, float]
    yaw: float
    z: float

    @classmethod
    def facing(
        cls, area: BaseGeometry, streets: BaseGeometry, z: float
    ) -> Plot:
        """Returns the plot on an area in W [m], facing the nearest street.

        `z` is the height of the ground [m].
        """
        rectangle = shapely.orient_polygons(area.minimum_rotated_rectangle)
        corners = shapely.get_coordinates(rectangle)
        middles = shapely.points((corners[:-1] + corners[1:]) / 2)
        shapely.prepare(streets)
        k = int(np.argmin(shapely.distance(middles, streets).round(2)))
        along = corners[k + 1] - corners[k]
        x, y = area.centroid.coords[0]
        xy = (round(float(x), 3), round(float(y), 3))
        yaw = round(math.atan2(along[1], along[0]), 5)
        return cls(area, xy, yaw, round(z, 3))

    def place(self, x: float, y: float) -> tuple[float, float]:
        """Converts a point in S to W [m], rounded to millimetres."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return (
            round(self.xy[0] + c * x - s * y, 3),
            round(self.xy[1] + s * x + c * y, 3),
        )

    def inside(self, area: BaseGeometry) -> BaseGeometry:
        """Converts an area from the world W to the plot's frame S."""
        moved = affinity.translate(area, -self.xy[0], -self.xy[1])
        return affinity.rotate(moved, -self.yaw, (0, 0), use_radians=True)

    def triangles(self, p_W: np.ndarray) -> np.ndarray:
        """Converts triangles `p_W` (M, 3, 3) from the world W to S [m].

        Heights in S are above the plot's ground.
        """
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        x, y, z = np.moveaxis(p_W - [*self.xy, self.z], -1, 0)
        return np.stack([c * x + s * y, c * y - s * x, z], axis=-1)

    def room(self) -> Polygon:
        """Returns a large rectangle inside the plot, in S [m]."""
        return largest_rectangle(self.inside(self.area))

    def thing(self, name: str, kind: str, model: Model) -> Structure:
        """Returns a structure that stands on the plot.

        Args:
            name: name of the structure.
            kind: semantic class of the structure.
            model: shape of the structure, expressed in S.
        """
        return Structure(name, kind, model, (*self.xy, self.z), self.yaw)


def new_building(
    plot: Plot,
    height: float,
    banned: str,
    neighbours: Sequence[BaseGeometry],
    rng: np.random.Generator,
    ending: str,
) -> Structure | None:
    """Returns a random new building for a plot; None if none fits.

    Args:
        plot: plot on which the building stands.
        height: approximate height of the building [m].
        banned: archetype (kind of building) that must not be used.
        neighbours: footprints of the neighbouring buildings in W.
        rng: random generator for the choice of the building.
        ending: end of the building's name, after the archetype.
    """
    x0, y0, x1, y1 = plot.room().bounds
    names = [name for name in _BUILT_TODAY if name != banned]
    weights = np.array([_BUILT_TODAY[name] for name in names], float)
    order = rng.choice(len(names), len(names), False, weights / weights.sum())
    near = [plot.inside(one) for one in neighbours]
    # The ground of a tower may have room for a lower building only.
    for name, height in (
        (names[k], part * height) for part in (1.0, 0.7, 0.45) for k in order
    ):
        kind = ARCHETYPES[name]
        w, d = (
            math.floor(10 * min(side, kind.widths[1])) / 10
            for side in (x1 - x0, y1 - y0)
        )
        h = round(float(np.clip(height, *kind.heights)), 1)
        if min(w, d) < kind.widths[0] or not 0.75 < h / height < 1.3:
            continue
        # The front of the new building is at the street, like that of the old
        # one.
        middle = ((x0 + x1) / 2, y0 + d / 2)
        footprint = box(-w / 2, -d / 2, w / 2, d / 2)
        blind = _blind_edges(placed(footprint, middle, 0.0), near)
        try:
            model = sample(name, footprint, h, rng, f"{name}_{ending}", blind)
        except ValueError:
            continue
        at = replace(plot, xy=plot.place(*middle))
        built = at.thing(f"{name}_{ending}", "building", model)
        return replace(built, tags=(name,))
    return None


def _blind_edges(footprint: Polygon, near: Sequence[BaseGeometry]) -> set[int]:
    """Returns the edges of a rectangle that have neighbours.

    They are numbered from the front on.
    """
    x0, y0, x1, y1 = footprint.bounds
    g, e = PARTY_WALL, 0.5
    strips = (
        box(x0 + e, y0 - g, x1 - e, y0),
        box(x1, y0 + e, x1 + g, y1 - e),
        box(x0 + e, y1, x1 - e, y1 + g),
        box(x0 - g, y0 + e, x0, y1 - e),
    )
    return {
        k for k, strip in enumerate(strips) if any(map(strip.intersects, near))
    }


def building_plot(building: Structure) -> Plot:
    """Returns the plot of land that a building's footprint covers."""
    area = building.footprint_W
    return Plot(area, building.xyz[:2], building.yaw, building.xyz[2])


def building_site_on(
    plot: Plot, name: str, rng: np.random.Generator
) -> list[Structure]:
    """Returns the structures of a building site: fences, machines and so on."""
    inner = plot.inside(plot.area.buffer(-0.4))
    lot = largest_rectangle(max(polygons_of(inner), key=lambda one: one.area))
    x0, y0, x1, y1 = lot.bounds
    things = []
    for k, (x, y, turn, length) in enumerate(
        (
            ((x0 + x1) / 2, y0, 0.0, x1 - x0),
            (x1, (y0 + y1) / 2, math.pi / 2, y1 - y0),
            ((x0 + x1) / 2, y1, math.pi, x1 - x0),
            (x0, (y0 + y1) / 2, -math.pi / 2, y1 - y0),
        )
    ):
        fence = OBJECTS["site_fence"].build(rng, length=length)
        moved = Plot(plot.area, plot.place(x, y), plot.yaw + turn, plot.z)
        things.append(moved.thing(f"{name}_fence_{k}", "fence", fence))
    empty = plot.thing(name, "building", Model((), {}, lot.buffer(-0.8)))
    digger = OBJECTS["excavator"]
    middle = plot.place(*lot.centroid.coords[0])
    turned = Plot(plot.area, middle, float(rng.uniform(-3.1, 3.1)), plot.z)
    model = digger.build(rng)
    digging = turned.thing(f"{name}_digger", digger.semantic_class, model)
    if plot.area.buffer(-0.8).contains(digging.footprint_W):
        things.append(digging)
    return things + list(lot_objects(empty, "yard", {}, rng))


def unfinished_frame(building: Structure, seed: int) -> Model:
    """Returns the unfinished frame of a building under construction."""
    model, name = building.model, building.name
    height = max(0.55 * top_of(model), _LEAST_FRAME)
    try:
        return building_site(model, height, name, seed)
    except ValueError:  # The plot is too small for a crane.
        return lowered(model, height, f"{name}_frame", seed)


def scaffold_before(
    plot: Plot, height: float, name: str, rng: np.random.Generator
) -> Structure:
    """Returns a scaffold that stands in front of a building.

    Args:
        plot: plot of the building.
        height: height of the building [m]. The scaffold has the same height, up
            to the greatest height of scaffolds.
        name: name of the scaffold.
        rng: random generator for the scaffold.
    """
    x0, y0, x1, _ = plot.inside(plot.area).bounds
    length = min(x1 - x0, _LONGEST_SCAFFOLD)
    xy = plot.place((x0 + x1) / 2, y0)
    moved = Plot(plot.area, xy, round(plot.yaw + math.pi, 5), plot.z)
    model = scaffold(length, min(height, _HIGHEST_SCAFFOLD), rng)
    return moved.thing(name, "other-structure", model)


def storey_on(
    plot: Plot, triangles: np.ndarray, name: str, rng: np.random.Generator
) -> Structure | None:
    """Returns an additional storey for a building; None without a flat roof.

    Args:
        plot: plot on which the building stands.
        triangles: (M, 3, 3) triangles of the building in W [m].
        name: name of the storey, which is a structure of its own.
        rng: random generator for the colour.
    """
    inside = plot.triangles(triangles)
    flat = inside[np.abs(unit_normals(inside)[:, 2]) > 0.99]
    heights = flat[:, :, 2].mean(axis=1).round(1)
    areas = shapely.area(from_above(flat))
    levels = np.unique(heights[heights > 0.5 * inside[:, :, 2].max(initial=0)])
    if len(levels) == 0:
        return None
    sums = [areas[heights == level].sum() for level in levels]
    z = float(levels[int(np.argmax(sums))])
    if max(sums) < 0.4 * plot.area.area:
        return None
    roof = shapely.union_all(from_above(flat[heights == z]), grid_size=0.01)
    pieces = polygons_of(roof.buffer(0.1).buffer(-1.3))
    if not pieces:
        return None
    lot = largest_rectangle(max(pieces, key=lambda one: one.area))
    x0, y0, x1, y1 = lot.bounds
    w, d = x1 - x0, y1 - y0
    if min(w, d) < 5.0:
        return None
    rgb = _draw_colour(rng)
    middle = ((x0 + x1) / 2, (y0 + y1) / 2)
    model = assemble(
        block("wall", (w, d, 3.2), (*middle, z + 1.5), rgb=rgb),
        block(
            "glass",
            (w + 0.06, d + 0.06, 1.4),
            (*middle, z + 1.7),
            rgb=_GLASS,
            material="glass",
        ),
        block(
            "roof", (w + 0.5, d + 0.5, 0.25), (*middle, z + 3.2), rgb=_CONCRETE
        ),
    )
    return plot.thing(name, "building", model)


def annex_to(
    plot: Plot,
    triangles: np.ndarray,
    name: str,
    is_free: Callable[[BaseGeometry], bool],
    rng: np.random.Generator,
) -> Structure | None:
    """Returns a one-storey annex behind a building, or None without space.

    Args:
        plot: plot of the building.
        triangles: (M, 3, 3) triangles of the building in W [m].
        name: name of the annex.
        is_free: function that returns whether an area in W may be built on.
        rng: random generator for the size of the annex.
    """
    cut = horizontal_section(plot.triangles(triangles), 1.3)
    x0, _, x1, _ = plot.inside(plot.area).bounds
    for _ in range(6):
        w = float(np.clip(rng.uniform(0.35, 0.65) * (x1 - x0), 3.0, 9.0))
        d = float(rng.uniform(2.8, 4.5))
        x = float(rng.uniform(x0 + w / 2, max(x1 - w / 2, x0 + w / 2 + 0.01)))
        walls = [
            greatest_y(cut, x + part * w) for part in (-0.48, -0.2, 0.2, 0.48)
        ]
        if not np.ptp(walls) < 0.5:  # There is no wall, or no plane one.
            continue
        y = min(walls) - 0.05
        area = placed(
            box(x - w / 2, max(walls) + 0.02, x + w / 2, y + d),
            plot.xy,
            plot.yaw,
        )
        if not is_free(area):
            continue
        y += d / 2
        rgb = _draw_colour(rng)
        model = assemble(
            block("wall", (w, d, 3.6), (x, y, 1.2), rgb=rgb),
            block(
                "glass",
                (0.7 * w, d + 0.06, 1.9),
                (x, y, 1.3),
                rgb=_GLASS,
                material="glass",
            ),
            block("roof", (w + 0.3, d + 0.3, 0.2), (x, y, 3.1), rgb=_CONCRETE),
        )
        return plot.thing(name, "building", model)
    return None


def balconies_on(
    plot: Plot, triangles: np.ndarray, name: str, rng: np.random.Generator
) -> Structure | None:
    """Returns new balconies for the front of a building.

    The result is None if the front is not plane, or the building is too high or
    too small for balconies.

    Args:
        plot: plot of the building.
        triangles: (M, 3, 3) triangles of the building in W [m].
        name: name of the balconies.
        rng: random generator for the choice of the balconies.
    """
    inside = plot.triangles(triangles)
    x0, y0, x1, _ = plot.inside(plot.area).bounds
    pitch = float(rng.uniform(4.0, 6.0))
    number = int((x1 - x0 - 2.0) / pitch)
    xs = (x0 + x1) / 2 + pitch * (np.arange(number) - (number - 1) / 2)
    parts: list[Part] = []
    for k, z in enumerate(
        np.arange(_STOREY + 0.2, inside[:, :, 2].max() - 3.5, _STOREY)
    ):
        # Existing balconies or bays show at one of these heights.
        cuts = [
            horizontal_section(inside, z + up) for up in (-0.3, 0.4, 1.0, 1.8)
        ]
        for j, x in enumerate(xs):
            walls = [
                -greatest_y(-cut, -x - at)
                for cut in cuts
                for at in (-1.7, -0.8, 0.8, 1.7)
            ]
            if np.ptp(walls) < 0.3 and abs(min(walls) - y0) < 1.0:
                y = max(walls) - 0.6
                slab, rail = (2.5, 1.3, 0.18), (2.5, 0.06, 1.0)
                at = (float(x), y, float(z))
                above = (at[0], y - 0.6, at[2] + 0.6)
                parts += [
                    block(f"slab_{k}_{j}", slab, at, rgb=_CONCRETE),
                    block(f"rail_{k}_{j}", rail, above, rgb=_STEEL),
                ]
    if len(parts) < 4 or z > 45.0:
        return None
    return plot.thing(name, "building", assemble(*parts))


def renovated(
    building: Structure, moves: bool, rng: np.random.Generator
) -> Structure:
    """Returns a building with renovated walls: plaster of another colour.

    A building without coloured walls stays the same.

    Args:
        building: the building.
        moves: whether the walls get an insulation layer as well, and thus move
            outwards by 15 cm.
        rng: random generator for the colour.
    """
    model = building.model
    walls = [p for p in model.parts if p.material != "glass" and p.rgb]
    if not walls:
        return building
    sizes: Counter[Rgb] = Counter()
    for part in walls:
        assert part.rgb is not None
        mesh = model.meshes.get(getattr(part.shape, "mesh", ""))
        sizes[part.rgb] += 12 if mesh is None else mesh.num_triangles
    old, new = max(sizes, key=lambda rgb: sizes[rgb]), _draw_colour(rng)
    parts = [
        replace(p, rgb=new, material=None) if p.rgb == old else p
        for p in model.parts
    ]
    if moves:
        x0, y0, x1, y1 = model.footprint.bounds
        share = 1.0 + 4.0 * _INSULATION / (x1 - x0 + y1 - y0)
        middle = np.array([(x0 + x1) / 2, (y0 + y1) / 2])
        parts = [_widened(part, middle, share) for part in parts]
    return replace(building, model=replace(model, parts=tuple(parts)))


def _widened(part: Part, middle: np.ndarray, share: float) -> Part:
    x, y = (middle + share * (np.array(part.xyz[:2]) - middle)).round(4)
    shape = part.shape
    if isinstance(shape, MeshShape) and part.rpy[:2] == (0.0, 0.0):
        sx, sy, sz = shape.scale
        scale = (round(sx * share, 5), round(sy * share, 5), sz)
        shape = MeshShape(shape.mesh, scale)
    return replace(part, shape=shape, xyz=(float(x), float(y), part.xyz[2]))


def horizontal_section(triangles: np.ndarray, z: float) -> np.ndarray:
    """Returns where triangles cut a horizontal plane: segments (N, 2, 2) [m].

    Each row of a segment contains x and y of an end of the segment.

    Args:
        triangles: (M, 3, 3) triangles [m].
        z: height of the plane [m].
    """
    z += 1e-4  # Not exactly at a vertex, whose heights are whole millimetres.
    a, b = triangles, np.roll(triangles, -1, axis=1)
    rise = b[..., 2] - a[..., 2]
    cut = (a[..., 2] - z) * (b[..., 2] - z) < 0
    t = (z - a[..., 2]) / np.where(cut, rise, 1.0)
    points = a[..., :2] + t[..., None] * (b - a)[..., :2]
    both = cut.sum(axis=1) == 2
    return points[both][cut[both]].reshape(-1, 2, 2)


def greatest_y(segments: np.ndarray, x: float) -> float:
    """Returns the greatest y at which segments cross a line of constant x.

    Args:
        segments: (N, 2, 2) segments; each row is x and y of an end [m].
        x: x of all points of the line [m].

    Returns:
        The coordinate y [m]; NaN if no segment crosses the line.
    """
    a, b = segments[:, 0], segments[:, 1]
    meets = (a[:, 0] - x) * (b[:, 0] - x) < 0
    a, b = a[meets], b[meets]
    y = a[:, 1] + (x - a[:, 0]) / (b[:, 0] - a[:, 0]) * (b[:, 1] - a[:, 1])
    return float(y.max()) if len(y) else math.nan


def structure_triangles(structure: Structure) -> np.ndarray:
    """Returns the triangles (M, 3, 3) of a structure in W [m]."""
    found = [np.zeros((0, 3, 3))]
    for part in structure.model.parts:
        vertices, triangles = part_triangles(part, structure.model.meshes)
        found.append(vertices[triangles])
    p = np.concatenate(found)
    c, s = math.cos(structure.yaw), math.sin(structure.yaw)
    x, y, z = np.moveaxis(p, -1, 0)
    return np.stack([c * x - s * y, s * x + c * y, z], -1) + structure.xyz


def _draw_colour(rng: np.random.Generator) -> Rgb:
    return _COLOURS[int(rng.integers(len(_COLOURS)))]
