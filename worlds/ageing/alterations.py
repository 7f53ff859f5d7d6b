"""Alterations of buildings, such as annexes, and scaffolds in front of them."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
import math

import numpy as np
import shapely
from shapely.geometry import box
from shapely.geometry.base import BaseGeometry

from worlds.ageing.plots import Plot
from worlds.shapes import (
    HIGHEST_SCAFFOLD,
    LONGEST_SCAFFOLD,
    MeshShape,
    Part,
    Rgb,
    Structure,
    assemble,
    block,
    from_above,
    largest_rectangle,
    placed,
    polygons_of,
    scaffold,
    unit_normals,
)

# Height of a storey [m].
_STOREY = 3.0
# Thickness of an insulation layer [m].
_INSULATION = 0.15
# Random places at which an annex is tried.
_ANNEX_TRIES = 6
# Colours of plaster and of additions.
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
    z = float(levels[int(np.argmax(np.round(sums, 6)))])
    if max(sums) < 0.4 * plot.area.area:
        return None
    roof = shapely.union_all(from_above(flat[heights == z]), grid_size=0.01)
    pieces = polygons_of(roof.buffer(0.1).buffer(-1.3))
    if not pieces:
        return None
    lot = largest_rectangle(max(pieces, key=lambda one: round(one.area, 6)))
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
    return plot.structure(name, "building", model)


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
    for _ in range(_ANNEX_TRIES):
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
        return plot.structure(name, "building", model)
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
    return plot.structure(name, "building", assemble(*parts))


def renovated(
    building: Structure, rng: np.random.Generator, *, insulated: bool
) -> Structure:
    """Returns a building with renovated walls: plaster of another colour.

    A building without coloured walls stays the same.

    Args:
        building: the building.
        rng: random generator for the colour.
        insulated: whether the walls also get an insulation layer, which moves
            the surface of the walls outwards by 15 cm.
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
    if insulated:
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


def scaffold_before(
    plot: Plot, height: float, name: str, rng: np.random.Generator
) -> Structure:
    """Returns a scaffold that stands in front of a building.

    Args:
        plot: plot of the building.
        height: height of the building [m]. The scaffold is as high as the
            building, unless the building is higher than scaffolds can be.
        name: name of the scaffold.
        rng: random generator for the scaffold.
    """
    x0, y0, x1, _ = plot.inside(plot.area).bounds
    length = min(x1 - x0, LONGEST_SCAFFOLD)
    xy = plot.place((x0 + x1) / 2, y0)
    moved = Plot(plot.area, xy, round(plot.yaw + math.pi, 5), plot.z)
    model = scaffold(length, min(height, HIGHEST_SCAFFOLD), rng)
    return moved.structure(name, "other-structure", model)


def _draw_colour(rng: np.random.Generator) -> Rgb:
    return _COLOURS[int(rng.integers(len(_COLOURS)))]


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
