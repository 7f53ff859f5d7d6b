"""Solids over outlines, from which buildings are put together.

The faces of a solid face outwards, and all sides that can be seen are closed.
"""

from collections.abc import Sequence
import itertools

import numpy as np
from numpy.typing import ArrayLike

from evaluation.base import rotated
from worlds.shapes import Mesh, box_mesh, cut_ears, merge_meshes, outlines

# Least and greatest coordinate along an axis [m].
Range = tuple[float, float]
# Buildings reach this far below their own ground level, since the ground is not
# flat [m].
FOUNDATION_M = 0.5


def flat(points: ArrayLike, z: float, *, up: bool = True) -> Mesh:
    """Returns a horizontal surface that fills an outline, at the height z.

    The surface faces upwards or, if `up` is False, downwards.
    """
    points = np.asarray(points, dtype=float)
    if _is_convex(points):
        n = len(points)
        faces = [
            tuple(i for i in (0, k, k + 1, k + 2) if i < n)
            for k in range(1, n - 1, 2)
        ]
    else:
        thousandths = np.rint(1e3 * points).astype(int).tolist()
        faces = cut_ears([(x, y) for x, y in thousandths], fans=True)
    if not up:
        faces = [face[::-1] for face in faces]
    return Mesh(_corners_at(points, z), tuple(faces))


def _corners_at(points: np.ndarray, z: float | np.ndarray) -> np.ndarray:
    """Returns the corners (N, 3) of an outline at heights `z` [m].

    `z` is one height for all corners, or (N,) one height for each corner.
    """
    return np.column_stack([points, np.broadcast_to(z, len(points))])


def skirt(lower: ArrayLike, upper: ArrayLike, z0: float, z1: float) -> Mesh:
    """Returns the walls from an outline at z0 to another at z1.

    The walls face outwards. The two outlines, `lower` and `upper` (N, 2) [m],
    must have the same number of corners, and each edge must be parallel to the
    same edge of the other outline, so that the walls are plane.
    """
    lower, upper = np.asarray(lower, float), np.asarray(upper, float)
    n = len(lower)
    vertices = np.vstack([_corners_at(lower, z0), _corners_at(upper, z1)])
    faces = []
    for k in range(n):
        m = (k + 1) % n
        face: tuple[int, ...] = (k, m, n + m, n + k)
        # Edges of no length (a ridge, a spire's tip) leave triangles.
        if np.allclose(upper[k], upper[m]):
            face = (k, m, n + k)
        elif np.allclose(lower[k], lower[m]):
            face = (k, n + m, n + k)
        faces.append(face)
    return Mesh(vertices, tuple(faces))


def prism(
    points: ArrayLike, z0: float, z1: float, *, bottom: bool = False
) -> Mesh:
    """Returns an upright solid over an outline, from z0 to z1 [m].

    It has a lower side only if `bottom` is set.
    """
    pieces = [skirt(points, points, z0, z1), flat(points, z1)]
    if bottom:
        pieces.append(flat(points, z0, up=False))
    return merge_meshes(*pieces)


def frustum(lower: ArrayLike, upper: ArrayLike, z0: float, z1: float) -> Mesh:
    """Returns a tapering solid between two outlines, without a lower side.

    The outlines are `lower` (N, 2) at the height z0, and `upper` (N, 2) at z1
    [m]. Each edge must be parallel to the same edge of the other outline.
    """
    return merge_meshes(skirt(lower, upper, z0, z1), flat(upper, z1))


def sloped_prism(
    points: ArrayLike, z0: float, height: float, low: float
) -> Mesh:
    """Returns a solid over an outline, with a top that slopes up along y.

    Args:
        points: (N, 2) corners of the outline [m].
        z0: height of the bottom [m].
        height: height above z0 at the outline's greatest y [m].
        low: height above z0 at the outline's least y, as a share of `height`.
    """
    points = np.asarray(points, dtype=float)
    n, y = len(points), points[:, 1]
    share = (y - y.min()) / (y.max() - y.min())
    top = flat(points, 0.0)
    z1 = z0 + height * (low + (1.0 - low) * share)
    vertices = np.vstack([_corners_at(points, z0), _corners_at(points, z1)])
    walls = tuple((k, (k + 1) % n, n + (k + 1) % n, n + k) for k in range(n))
    roof = tuple(tuple(n + i for i in face) for face in top.faces)
    return Mesh(vertices, (*walls, *roof))


def spire(points: ArrayLike, tip: ArrayLike, z0: float, z1: float) -> Mesh:
    """Returns a pyramid over an outline, without a lower side.

    The outline `points` (N, 2) is at the height z0; the tip is at the place
    `tip` (2,) and the height z1 [m].
    """
    points = np.asarray(points, dtype=float)
    n = len(points)
    apex = [*np.asarray(tip, dtype=float), z1]
    vertices = np.vstack([_corners_at(points, z0), apex])
    return Mesh(vertices, tuple((k, (k + 1) % n, n) for k in range(n)))


def tent(eaves: ArrayLike, tip: ArrayLike, z0: float, z1: float) -> Mesh:
    """Returns a pyramid over an outline, closed by a base.

    The outline `eaves` (N, 2) is at the height z0; the tip is at the place
    `tip` (2,) and the height z1 [m].
    """
    return merge_meshes(flat(eaves, z0, up=False), spire(eaves, tip, z0, z1))


def revolved(
    profile: Sequence[outlines.Point],
    count: int,
    center: ArrayLike = (0.0, 0.0),
) -> Mesh:
    """Returns the surface that a profile sweeps around a vertical axis.

    The profile is a list of (radius, z) pairs from the bottom up [m]. If the
    last radius is zero, the surface ends in a tip; otherwise a lid closes the
    top. The circle is approximated by a polygon of `count` sides. `center`
    contains x and y of the axis [m].
    """

    def ring(radius: float) -> np.ndarray:
        return outlines.regular_polygon(radius, count, center)

    pieces = []
    for (r0, z0), (r1, z1) in itertools.pairwise(profile):
        if r1 > 0:
            pieces.append(skirt(ring(r0), ring(r1), z0, z1))
        else:
            pieces.append(spire(ring(r0), center, z0, z1))
    radius, z = profile[-1]
    if radius > 0:
        pieces.append(flat(ring(radius), z))
    return merge_meshes(*pieces)


def extruded(profile: Sequence[outlines.Point], x0: float, x1: float) -> Mesh:
    """Returns a roof: a line in y and z, extruded along x, with end walls.

    The line consists of (y, z) points with increasing y [m]. The line is
    extruded from x = `x0` to x = `x1` [m]. The end walls reach down to the
    height of the first point.
    """
    base = profile[0][1]
    faces = Faces()
    for (ya, za), (yb, zb) in itertools.pairwise(profile):
        faces.add((x0, ya, za), (x1, ya, za), (x1, yb, zb), (x0, yb, zb))
        if yb - ya < 1e-6:
            continue
        right = [(x1, ya, base), (x1, yb, base), (x1, yb, zb), (x1, ya, za)]
        corners = [c for k, c in enumerate(right) if c != right[k - 1]]
        faces.add(*corners)
        faces.add(*((x0, y, z) for _, y, z in reversed(corners)))
    if profile[-1][1] > base:
        ya, za = profile[-1]
        faces.add((x0, ya, za), (x1, ya, za), (x1, ya, base), (x0, ya, base))
    return faces.mesh()


class Faces:
    """Builds a mesh face by face; faces without area are left out.

    `add` takes the corners of one face, and `mesh` returns the mesh.
    """

    def __init__(self) -> None:
        self._vertices: list[tuple[float, float, float]] = []
        self._faces: list[tuple[int, ...]] = []

    def add(self, *corners: tuple[float, float, float]) -> None:
        kept = [c for k, c in enumerate(corners) if c != corners[k - 1]]
        if len(kept) > 2:
            first = len(self._vertices)
            self._faces.append(tuple(range(first, first + len(kept))))
            self._vertices.extend(kept)

    def mesh(self) -> Mesh:
        vertices = np.array(self._vertices, dtype=float).reshape(-1, 3)
        return Mesh(vertices, tuple(self._faces))


def swapped(mesh: Mesh) -> Mesh:
    """Returns a mirrored mesh: x and y exchanged, faces still outwards."""
    return Mesh(mesh.vertices[:, [1, 0, 2]], mesh.faces).inside_out()


def roof_pan(
    points: ArrayLike, z_floor: float, z_top: float, thickness: float
) -> Mesh:
    """Returns the coping, the inner walls and the floor of a flat roof.

    Args:
        points: (N, 2) outer corners of the parapet [m].
        z_floor: height of the roof's surface [m].
        z_top: height of the parapet's top [m].
        thickness: thickness of the parapet [m].
    """
    points = np.asarray(points, dtype=float)
    inner = outlines.inset(points, thickness)
    coping = skirt(points, inner, z_top, z_top)
    # Inner walls face inwards: the outline is run through backwards.
    wall = skirt(inner[::-1], inner[::-1], z_floor, z_top)
    return merge_meshes(coping, wall, flat(inner, z_floor))


def around(middle: float, half: float) -> Range:
    """Returns the range from `middle` - `half` to `middle` + `half` [m]."""
    return middle - half, middle + half


def box(
    x: Range,
    y: Range,
    z: Range,
    *,
    bottom: bool = True,
) -> Mesh:
    """Returns an upright box.

    Args:
        x: least and greatest x [m].
        y: least and greatest y [m].
        z: heights of the bottom and the top [m].
        bottom: whether the box has a lower side.
    """
    plan = outlines.rectangle(x[0], y[0], x[1], y[1])
    return prism(plan, z[0], z[1], bottom=bottom)


def standing(x: Range, y: Range, z1: float, *, bottom: bool = False) -> Mesh:
    """Returns a box that stands on the ground.

    The box reaches down to `FOUNDATION_M` below the ground.

    Args:
        x: least and greatest x [m].
        y: least and greatest y [m].
        z1: height of the top [m].
        bottom: whether the box has a lower side.
    """
    return box(x, y, (-FOUNDATION_M, z1), bottom=bottom)


def post(
    x: float, y: float, half: float, z1: float, z0: float = -FOUNDATION_M
) -> Mesh:
    """Returns a square post that stands on the ground.

    Args:
        x: x of the post's axis in the building's frame [m].
        y: y of the post's axis in the building's frame [m].
        half: half the side of the square [m].
        z1: height of the top [m].
        z0: height of the foot [m]; by default hidden below the ground.
    """
    return box(
        (x - half, x + half), (y - half, y + half), (z0, z1), bottom=False
    )


def beam(start: ArrayLike, end: ArrayLike, width: float) -> Mesh:
    """Returns a bar of square section between two points.

    Args:
        start, end: (3,) middles of the two ends [m]. One end must not lie
            vertically above the other end.
        width: side of the square [m].
    """
    start, end = np.asarray(start, float), np.asarray(end, float)
    length = float(np.linalg.norm(end - start, axis=0))
    along = (end - start) / length
    side = np.cross(along, (0.0, 0.0, 1.0))
    side /= np.linalg.norm(side, axis=0)
    up = np.cross(side, along)
    unit = box_mesh((length, width, width))
    R = np.column_stack([along, -side, up])
    return Mesh(rotated(R, unit.vertices) + (start + end) / 2, unit.faces)


def foundation(points: ArrayLike) -> Mesh:
    """Returns the walls of a foundation, below the outline of a building.

    The walls reach from the ground down to `FOUNDATION_M` below the ground.
    `points` contains the corners (N, 2) of the outline [m].
    """
    return skirt(points, points, -FOUNDATION_M, 0.0)


def _corner_turns(points: np.ndarray) -> np.ndarray:
    """Returns the cross product (N,) of the two edges at each corner [m^2].

    It is positive where the outline turns left.
    """
    into = points - np.roll(points, 1, axis=0)
    out = np.roll(points, -1, axis=0) - points
    return into[:, 0] * out[:, 1] - into[:, 1] * out[:, 0]


def _is_convex(points: np.ndarray) -> bool:
    return bool((_corner_turns(points) > -1e-9).all())
