"""Outlines and solids from which buildings are put together.

Outlines are (N, 2) corners [m], counter-clockwise, with the front edge first.
The faces of a solid face outwards, and all sides that can be seen are closed.
"""

from collections.abc import Callable, Collection, Sequence
import itertools
import math

import numpy as np
from numpy.typing import ArrayLike

from cns_drake.city.geometry import Mesh, merge_meshes
from cns_drake.city.geometry.triangulation import cut_ears

Point = tuple[float, float]
Corners = list[np.ndarray]
# x0, y0, x1, y1.
Area = tuple[float, float, float, float]
# Buildings reach this far below their own ground level, since the ground is not
# flat [m].
FOUNDATION_M = 0.5


def rectangle(x0: float, y0: float, x1: float, y1: float) -> np.ndarray:
    """Returns the corners (4, 2) of a rectangle [m], first the edge at y0."""
    return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], dtype=float)


def regular_polygon(
    radius: float,
    count: int,
    center: ArrayLike = (0.0, 0.0),
    phase: float = 0.0,
) -> np.ndarray:
    """Returns the corners (count, 2) of a regular polygon [m].

    Args:
        radius: distance of the corners from the centre [m].
        count: number of corners.
        center: x and y of the centre [m].
        phase: direction from the centre to the first corner [rad].
    """
    angles = phase + np.arange(count) * 2 * math.pi / count
    return np.asarray(center) + radius * np.column_stack(
        [np.cos(angles), np.sin(angles)]
    )


def square(x: float, y: float, half: float) -> np.ndarray:
    """Returns the corners (4, 2) of a square with the centre (x, y) [m].

    `half` is half the length of a side.
    """
    return rectangle(x - half, y - half, x + half, y + half)


def inset(points: ArrayLike, distance: ArrayLike) -> np.ndarray:
    """Returns an outline with each edge moved inwards.

    The corners keep their order.

    Args:
        points: (N, 2) corners of the outline, counter-clockwise [m].
        distance: one number for all edges, or (N,) one for each edge [m]; a
            negative distance moves an edge outwards. Distances must be small
            compared with the lengths of the edges.
    """
    points = np.asarray(points, dtype=float)
    distances = np.broadcast_to(np.asarray(distance, float), len(points))
    along = np.roll(points, -1, axis=0) - points
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    moved = np.empty_like(points)
    for k, p in enumerate(points):
        (ax, ay), (bx, by) = a, b = along[k - 1], along[k]
        sine = ax * by - ay * bx
        if abs(sine) < 1e-9:  # The two edges are one line.
            moved[k] = p + distances[k] * np.array([-by, bx])
        else:
            moved[k] = p + (b * distances[k - 1] - a * distances[k]) / sine
    return moved


def inset_limit(points: ArrayLike) -> float:
    """Returns the smallest inset at which an edge loses 70 % of its length [m].

    `points` contains the corners (N, 2) of an outline [m].
    """
    points = np.asarray(points, dtype=float)
    probe = 1e-3
    length = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
    moved = inset(points, probe)
    after = np.linalg.norm(np.roll(moved, -1, axis=0) - moved, axis=1)
    loss = np.maximum((length - after) / probe, 1e-9)
    return float((0.7 * length / loss).min())


def rounded(
    points: ArrayLike, corners: dict[int, float], step: float
) -> np.ndarray:
    """Returns an outline whose convex corners are rounded by chords.

    The first edge of the result is the part of the outline's first edge that
    remains between the arcs.

    Args:
        points: (N, 2) corners of the outline [m].
        corners: number of a corner -> radius of the corner [m]; all other
            corners stay unchanged.
        step: greatest length of a chord [m].
    """

    def arc(
        k: int, p: np.ndarray, into: np.ndarray, out: np.ndarray
    ) -> Corners:
        radius = corners[k]
        cross = into[0] * out[1] - into[1] * out[0]
        turn = math.atan2(cross, float(into @ out))
        center = (
            p
            - into * radius * math.tan(turn / 2)
            + radius * np.array([-into[1], into[0]])
        )
        start = math.atan2(-into[0], into[1])
        count = max(1, math.ceil(radius * turn / step))
        angles = (start + turn * i / count for i in range(count + 1))
        return [
            center + radius * np.array([math.cos(a), math.sin(a)])
            for a in angles
        ]

    return _with_replaced_corners(points, arc, corners)


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
    """Returns the corners (N, 3) of an outline, at one height or one each."""
    return np.column_stack([points, np.broadcast_to(z, len(points))])


def _corner_turns(points: np.ndarray) -> np.ndarray:
    """Returns (N,) the cross product of the two edges at each corner [m^2].

    It is positive where the outline turns left.
    """
    into = points - np.roll(points, 1, axis=0)
    out = np.roll(points, -1, axis=0) - points
    return into[:, 0] * out[:, 1] - into[:, 1] * out[:, 0]


def _is_convex(points: np.ndarray) -> bool:
    return bool((_corner_turns(points) > -1e-9).all())


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
    profile: Sequence[Point], count: int, center: ArrayLike = (0.0, 0.0)
) -> Mesh:
    """Returns the surface that a profile sweeps around a vertical axis.

    The profile is a list of (radius, z) pairs from the bottom up [m]. If the
    last radius is zero, the surface ends in a tip; otherwise a lid closes the
    top. The circle is approximated by a polygon of `count` sides. `center`
    contains x and y of the axis [m].
    """

    def ring(radius: float) -> np.ndarray:
        return regular_polygon(radius, count, center)

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


def extruded(profile: Sequence[Point], x0: float, x1: float) -> Mesh:
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
    """Returns a mirrored mesh: x and y are exchanged, and it faces outwards."""
    return Mesh(mesh.vertices[:, [1, 0, 2]], mesh.faces).turned()


def shortest_side(points: ArrayLike) -> float:
    """Returns the shorter side of an outline's bounding box [m]."""
    span = np.ptp(np.asarray(points, dtype=float), axis=0)
    return float(min(span))


def extent(points: np.ndarray) -> Area:
    """Returns x0, y0, x1, y1 of an outline's bounding box [m]."""
    return (*points.min(axis=0), *points.max(axis=0))


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
    inner = inset(points, thickness)
    coping = skirt(points, inner, z_top, z_top)
    # Inner walls face inwards: the outline is run through backwards.
    wall = skirt(inner[::-1], inner[::-1], z_floor, z_top)
    return merge_meshes(coping, wall, flat(inner, z_floor))


def box(*limits: float, bottom: bool = True) -> Mesh:
    """Returns an upright box between x0, x1, y0, y1, z0 and z1 [m]."""
    x0, x1, y0, y1, z0, z1 = limits
    return prism(rectangle(x0, y0, x1, y1), z0, z1, bottom=bottom)


def standing(*limits: float, bottom: bool = False) -> Mesh:
    """Returns a box that stands on the ground, from x0, x1, y0, y1, z1 [m].

    The box reaches down to `FOUNDATION_M` below the ground. The box has a lower
    side if `bottom` is set.
    """
    *spot, z1 = limits
    return box(*spot, -FOUNDATION_M, z1, bottom=bottom)


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
    return box(x - half, x + half, y - half, y + half, z0, z1, bottom=False)


def foundation(points: ArrayLike) -> Mesh:
    """Returns the walls of a foundation, below the outline of a building.

    The walls reach from the ground down to `FOUNDATION_M` below the ground.
    `points` contains the corners (N, 2) of the outline [m].
    """
    return skirt(points, points, -FOUNDATION_M, 0.0)


def chamfered(points: np.ndarray, cut: float) -> np.ndarray:
    """Returns an outline (M, 2) with its convex corners cut off [m].

    Each cut starts `cut` metres from the corner on both edges.
    """
    return _with_replaced_corners(
        points, lambda k, p, a, b: [p - a * cut, p + b * cut]
    )


def notched(points: np.ndarray, depth: float) -> np.ndarray:
    """Returns an outline (M, 2) with its convex corners notched [m].

    A square with the side `depth` is cut out of each convex corner.
    """
    d = depth
    return _with_replaced_corners(
        points, lambda k, p, a, b: [p - a * d, p - a * d + b * d, p + b * d]
    )


def _with_replaced_corners(
    points: ArrayLike,
    corner: Callable[[int, np.ndarray, np.ndarray, np.ndarray], Corners],
    chosen: Collection[int] | None = None,
) -> np.ndarray:
    """Returns an outline with several corners in place of some corners.

    All convex corners are replaced, or those `chosen` by number. The function
    `corner` returns the new ones. It gets the corner's number, its place, and
    the directions of the edges before and after it. The first edge stays the
    first one.
    """
    points = np.asarray(points, dtype=float)
    result: Corners = []
    for k, p in enumerate(points):
        a = p - points[k - 1]
        b = points[(k + 1) % len(points)] - p
        a, b = a / np.hypot(*a), b / np.hypot(*b)
        if chosen is None:
            replace = a[0] * b[1] - a[1] * b[0] > 0.1
        else:
            replace = k in chosen
        result.extend(corner(k, p, a, b) if replace else [p])
        if k == 0:
            front = len(result) - 1
    return np.roll(np.array(result), -front, axis=0)


def stadium(
    x0: float, y0: float, x1: float, y1: float, step: float = 3.0
) -> np.ndarray:
    """Returns the outline (N, 2) of a rectangle with half circles as ends [m].

    The longer sides of the rectangle are along x.

    Args:
        x0: left end [m].
        y0: front [m].
        x1: right end [m].
        y1: back [m].
        step: longest chord of the half circles [m].
    """
    radius, middle = (y1 - y0) / 2, (y0 + y1) / 2
    count = max(2, math.ceil(math.pi * radius / step))
    angles = np.linspace(-math.pi / 2, math.pi / 2, count + 1)
    arc = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    right = np.array([x1 - radius, middle]) + arc
    left = np.array([x0 + radius, middle]) - arc
    # The arc on the left ends where the front begins.
    return np.roll(np.vstack([right, left]), 1, axis=0)


def u_shape(
    x0: float, y0: float, x1: float, y1: float, wing: float, back: float
) -> np.ndarray:
    """Returns the outline (8, 2) of a U, whose court is open to the back [m].

    Args:
        x0: left end [m].
        y0: front [m].
        x1: right end [m].
        y1: back [m].
        wing: width of the two wings, left and right of the court [m].
        back: depth of the part in front of the court, which joins the wings
            [m].
    """
    a, b, c = x0 + wing, x1 - wing, y0 + back
    xs = (x0, x1, x1, b, b, a, a, x0)
    return np.column_stack([xs, (y0, y0, y1, y1, c, c, y1, y1)])


def l_shape(
    x0: float, y0: float, x1: float, y1: float, wing: float, back: float
) -> np.ndarray:
    """Returns the outline (6, 2) of an L: a front part and a left wing [m].

    Args:
        x0: left end [m].
        y0: front [m].
        x1: right end [m].
        y1: back [m].
        wing: width of the wing behind the front part [m].
        back: depth of the front part [m].
    """
    a, c = x0 + wing, y0 + back
    return np.column_stack([(x0, x1, x1, a, a, x0), (y0, y0, c, c, y1, y1)])


def mirrored(points: np.ndarray) -> np.ndarray:
    """Returns an outline (N, 2) mirrored left to right at its middle.

    The front edge is still the first edge, and the corners are still
    counter-clockwise.
    """
    points = np.asarray(points, dtype=float)
    middle = (points[:, 0].min() + points[:, 0].max()) / 2
    flipped = np.column_stack([2 * middle - points[:, 0], points[:, 1]])
    # Mirroring turns it clockwise; the front edge stays first.
    return np.roll(flipped[::-1], 2 - len(points), axis=0)


def edges_on(
    plan: np.ndarray, outline: np.ndarray, edges: Collection[int]
) -> frozenset[int]:
    """Returns which edges of a plan lie along given edges of an outline.

    Args:
        plan: (M, 2) corners of the plan [m].
        outline: (N, 2) corners of the outline [m].
        edges: numbers of the outline's edges.

    Returns:
        Numbers of the plan's edges that are at most 1 cm from the straight line
        through one of the given edges.
    """
    found = set()
    ends = np.roll(plan, -1, axis=0)
    for k, (a, b) in enumerate(zip(plan, ends, strict=True)):
        for edge in edges:
            start = outline[edge]
            along = outline[(edge + 1) % len(outline)] - start
            normal = np.array([-along[1], along[0]]) / np.hypot(*along)
            if max(abs(normal @ (a - start)), abs(normal @ (b - start))) < 0.01:
                found.add(k)
    return frozenset(found)
