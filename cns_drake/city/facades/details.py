"""Solid details of facades: canopies, balconies, steps, porches, bay windows.

A `WallFrame` places a detail on a wall. In its wall coordinates, x runs along
the wall, y outwards and z up.
"""

from collections.abc import Collection, Iterable, Sequence
import math

import numpy as np
from numpy.typing import ArrayLike

from cns_drake.city.facades import bays, massing, roofs, walls
from cns_drake.city.facades.assembly import Assembly
from cns_drake.city.geometry import Finish
from cns_drake.city.geometry.mesh import Mesh, box_mesh, merge_meshes

# Height of the shared mesh of fire stairs, which is scaled to the storey [m].
FIRE_STAIRS_STOREY_M = 3.4


class WallFrame:
    """Converts geometry from wall coordinates to the building's frame [m].

    In wall coordinates, x runs along the wall, y outwards and z up. The origin
    is on the ground at the start of the wall: at the left, as seen from
    outside. The wall is the edge number `edge` of `outline` (N, 2), which
    contains the corners of all walls, counter-clockwise [m].
    """

    def __init__(self, outline: ArrayLike, edge: int):
        outline = np.asarray(outline, dtype=float)
        edge %= len(outline)
        start, end = outline[edge], outline[(edge + 1) % len(outline)]
        self.length = float(np.hypot(*(end - start)))
        self._start = start
        self._along = (end - start) / self.length
        self._outward = np.array([self._along[1], -self._along[0]])

    def place(self, mesh: Mesh, z: float = 0.0) -> Mesh:
        """Converts a mesh from wall coordinates to the building's frame [m].

        The mesh is also raised by `z` [m]. As wall coordinates are left-handed,
        the order of the corners of each face is reversed.
        """
        x, y, height = mesh.vertices.T
        xy = self._start + np.outer(x, self._along) + np.outer(y, self._outward)
        vertices = np.column_stack([xy, height + z])
        return Mesh(vertices, mesh.faces).turned()

    def box(self, *limits: float, bottom: bool = True) -> Mesh:
        """Returns a box in the building's frame, given in wall coordinates.

        The limits are x0, x1, y0, y1, z0 and z1 in wall coordinates [m]. The
        box has a lower side if `bottom` is set.
        """
        return self.place(massing.box(*limits, bottom=bottom))

    def standing(self, *limits: float, bottom: bool = False) -> Mesh:
        """Returns a box that stands on the ground, in the building's frame.

        The limits are x0, x1, y0, y1 and z1 in wall coordinates [m]. The box
        reaches below the ground, and has a lower side if `bottom` is set.
        """
        return self.place(massing.standing(*limits, bottom=bottom))

    @property
    def heading(self) -> float:
        """Direction of the wall in the building's frame, left to right [rad].

        Left and right are as seen from outside.
        """
        return math.atan2(self._along[1], self._along[0])

    def point(self, x: float, y: float) -> np.ndarray:
        """Returns a place in the building's frame as x and y [m].

        The place is given in wall coordinates: `x` along the wall, and `y`
        outwards.
        """
        return self._start + x * self._along + y * self._outward


def canopy(x0: float, x1: float, reach: float, z: float) -> Mesh:
    """Returns a flat canopy with a fascia, hung on two slanted rods.

    The mesh is in wall coordinates [m]. The canopy extends from x0 to x1 along
    the wall, and by `reach` out of the wall; the underside of the canopy is at
    the height `z`.
    """
    rods = [
        beam((x, 0.05, z + 1.2), (x, reach - 0.3, z + 0.3), 0.08)
        for x in (x0 + 0.4, x1 - 0.4)
    ]
    slab = box_mesh((x1 - x0, reach, 0.3), ((x0 + x1) / 2, reach / 2, z + 0.15))
    return merge_meshes(slab, *rods)


def front_canopy(
    outline: ArrayLike, half: float, reach: float, z: float
) -> Mesh:
    """Returns a canopy above a door in the middle of the front wall.

    The mesh is in the building's frame. `outline` contains the corners of the
    walls, `half` is half the canopy's width, `reach` is how far the canopy
    extends out of the wall, and `z` is the height of the canopy [m].
    """
    front = WallFrame(outline, 0)
    middle = front.length / 2
    return front.place(canopy(middle - half, middle + half, reach, z))


def awning(x0: float, x1: float, reach: float, z0: float, z1: float) -> Mesh:
    """Returns a sloped shop awning with a hanging front edge.

    The mesh is in wall coordinates: x along the wall, y outwards, z up.

    Args:
        x0: left end [m].
        x1: right end [m].
        reach: how far it reaches out of the wall [m].
        z0: lower edge of the front [m].
        z1: height at the wall [m].
    """
    lip = 0.25
    profile = [(0.0, z1), (reach, z0 + lip), (reach, z0), (0.0, z1 - 0.12)]
    vertices = [(x, y, z) for x in (x0, x1) for y, z in profile]
    faces: list[tuple[int, ...]]
    faces = [(k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k) for k in range(4)]
    faces += [(3, 2, 0), (2, 1, 0), (4, 5, 6), (4, 6, 7)]
    return Mesh(np.array(vertices), tuple(faces)).turned()


def awnings(
    wall: WallFrame,
    cells: Iterable[bays.Span],
    rng: np.random.Generator,
    share: float,
    shape: tuple[float, float, float, float],
    door: float = -math.inf,
) -> list[Mesh]:
    """Returns awnings above some of the shops along a wall.

    Args:
        wall: the wall.
        cells: start and end of each shop along the wall [m].
        rng: random generator that chooses the shops with an awning.
        share: probability that a shop has an awning.
        shape: four lengths of an awning [m]: how much narrower the awning is
            than its shop on each side; how far the awning reaches out of the
            wall; height of the lower edge; height of the upper edge.
        door: half the width of the stretch for the door in the middle of the
            wall [m]. Shops that reach into this stretch get no awning. By
            default there is no stretch for a door.
    """
    narrower, reach, z0, z1 = shape
    middle = wall.length / 2
    pieces = []
    for a, b in cells:
        free = b < middle - door or a > middle + door
        if rng.random() < share and free:
            shade = awning(a + narrower, b - narrower, reach, z0, z1)
            pieces.append(wall.place(shade))
    return pieces


def balcony(
    x0: float, x1: float, reach: float, z: float, rail: float = 1.05
) -> Mesh:
    """Returns a slab with a solid balustrade on its three free sides.

    The mesh is in wall coordinates: x along the wall, y outwards, z up.

    Args:
        x0: left end [m].
        x1: right end [m].
        reach: how far it reaches out of the wall [m].
        z: height of its floor [m].
        rail: height of the balustrade above the floor [m].
    """
    t = 0.12
    low = z - 0.2
    high = z + rail
    outer = [(x0, 0.0), (x0, reach), (x1, reach), (x1, 0.0)]
    inner = [(x0 + t, 0.0), (x0 + t, reach - t)]
    inner += [(x1 - t, reach - t), (x1 - t, 0.0)]
    rings = ((outer, low), (outer, high), (inner, high), (inner, z))
    vertices = np.array([(x, y, h) for ring, h in rings for x, y in ring])
    faces = [
        (4 * ring + k, 4 * ring + 4 + k, 4 * ring + 5 + k, 4 * ring + 1 + k)
        for ring in range(3)
        for k in range(3)
    ]
    faces += [(0, 1, 2, 3), (12, 15, 14, 13)]
    return Mesh(vertices, tuple(faces))


def piers(
    outline: ArrayLike,
    pitch: float,
    width: float,
    reach: float,
    z0: float,
    z1: float,
    *,
    depth: float = 0.05,
    margin: float = 0.4,
    entrance: float = 0.0,
    skip: Collection[int] = (),
) -> Mesh:
    """Returns upright fins or pilasters along all walls of an outline.

    Args:
        outline: (N, 2) corners of the walls in the building's frame,
            counter-clockwise [m].
        pitch: approximate distance from one pier to the next [m].
        width: width of each pier [m].
        reach: how far the piers reach out of the wall [m].
        z0: height of the feet of the piers [m].
        z1: height of the tops of the piers [m].
        depth: how far the piers reach into the wall, past recessed glass [m].
        margin: distance of the middle of the outermost piers from the wall's
            ends [m].
        entrance: width in the middle of the front that stays free [m].
        skip: edges of the outline that get no piers.
    """
    pieces = []
    for edge in range(len(np.asarray(outline))):
        wall = WallFrame(outline, edge)
        if edge in skip or wall.length < 2 * width:
            continue
        room = wall.length - 2 * margin
        count = round(room / pitch)
        if count < 1:  # A chord of a curve: one pier in its middle.
            places = [wall.length / 2]
        else:
            places = [margin + k * room / count for k in range(count + 1)]
        if edge == 0 and entrance > 0:
            half = (entrance + width) / 2
            places = [x for x in places if abs(x - wall.length / 2) >= half]
        for x in places:
            pier = _pier(round(x, 2), width, depth, reach, z0, z1)
            pieces.append(wall.place(pier))
    return merge_meshes(*pieces)


def pilasters(
    outline: ArrayLike,
    pitch: float,
    margin: float,
    every: int,
    width: float,
    reach: float,
    z0: float,
    z1: float,
    skip: Collection[int] = (),
) -> Mesh:
    """Returns pilasters between the bays of a wall with a regular layout.

    The layout comes from `cns_drake.city.facades.bays.rhythm`.

    Args:
        outline: (N, 2) corners of the walls in the building's frame,
            counter-clockwise [m].
        pitch: width of a bay, as given to `rhythm` [m].
        margin: distance of the bays from corners, as given to `rhythm` [m].
        every: number of bays from one pilaster to the next.
        width: width of a pilaster [m].
        reach: how far a pilaster reaches out of the wall [m].
        z0: height of its foot [m].
        z1: height of its top [m].
        skip: edges of the outline that get no pilasters.
    """
    pieces = []
    for edge in range(len(np.asarray(outline))):
        wall = WallFrame(outline, edge)
        cells = bays.stretches(wall.length, pitch, margin)
        if edge not in skip and len(cells) > 2:
            for x, _ in cells[every::every]:
                pier = _pier(round(x, 2), width, 0.02, reach, z0, z1)
                pieces.append(wall.place(pier))
    return merge_meshes(*pieces)


def corner_piers(
    outline: ArrayLike,
    width: float,
    reach: float,
    depth: float,
    z0: float,
    z1: float,
    skip: Collection[int] = (),
) -> Mesh:
    """Returns angled piers around the convex corners of an outline.

    Args:
        outline: (N, 2) corners of the walls in the building's frame,
            counter-clockwise [m].
        width: length of the pier along each of the two walls [m].
        reach: how far the piers reach out of the walls [m].
        depth: how far the piers reach into the walls, past recessed glass [m].
        z0: height of the feet of the piers [m].
        z1: height of the tops of the piers [m].
        skip: edges whose corners get no piers.
    """
    outline = np.asarray(outline, dtype=float)
    outer = massing.inset(outline, -reach)
    inner = massing.inset(outline, depth)
    pieces = []
    for k, p in enumerate(outline):
        before = WallFrame(outline, k - 1)
        after = WallFrame(outline, k)
        a, b = p - outline[k - 1], outline[(k + 1) % len(outline)] - p
        if a[0] * b[1] - a[1] * b[0] < 0.1:
            continue
        if k in skip or (k - 1) % len(outline) in skip:
            continue
        low, high = before.length - width, width
        plan = [
            before.point(low, -depth),
            before.point(low, reach),
            outer[k],
            after.point(high, reach),
            after.point(high, -depth),
            inner[k],
        ]
        pieces.append(massing.prism(plan, z0, z1, bottom=True))
    return merge_meshes(*pieces)


def _pier(
    x: float, width: float, depth: float, reach: float, z0: float, z1: float
) -> Mesh:
    """Returns a box with a back, in wall coordinates.

    It needs a back because piers are deeper than walls: near a corner their
    backs show in the recesses of the next wall.
    """
    a, b = x - width / 2, x + width / 2
    plan = [(a, -depth), (b, -depth), (b, reach), (a, reach)]
    vertices = np.array([(x, y, z) for z in (z0, z1) for x, y in plan])
    sides = ((0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
    return Mesh(vertices, (*sides, (4, 5, 6, 7), (0, 3, 2, 1)))


def steps(x0: float, x1: float, reach: float, rise: float, count: int) -> Mesh:
    """Returns entrance steps that rise towards a wall.

    The mesh is in wall coordinates: x along the wall, y outwards, z up.

    Args:
        x0: left end [m].
        x1: right end [m].
        reach: distance of the lowest step from the wall [m].
        rise: height of the top step [m].
        count: number of treads.
    """
    pieces = []
    for k in range(count):
        y = reach * (count - k) / count
        top = rise * (k + 1) / count
        pieces.append(massing.box(x0, x1, 0.0, y, -massing.FOUNDATION_M, top))
    return merge_meshes(*pieces)


def beam(start: ArrayLike, end: ArrayLike, width: float) -> Mesh:
    """Returns a bar of square section between two points.

    Args:
        start, end: (3,) middles of the two ends [m]. One end must not lie
        vertically above the other end.
        width: side of the square [m].
    """
    start, end = np.asarray(start, float), np.asarray(end, float)
    length = float(np.linalg.norm(end - start))
    along = (end - start) / length
    side = np.cross(along, (0.0, 0.0, 1.0))
    side /= np.linalg.norm(side)
    up = np.cross(side, along)
    unit = box_mesh((length, width, width))
    R = np.column_stack([along, -side, up])
    return Mesh(unit.vertices @ R.T + (start + end) / 2, unit.faces)


_POST_M = 0.16
# Depth of the windows in bay windows [m].
_RECESS = 0.1
# Length of the shared mesh of a railing [m].
RAILING_M = 2.0


def add_porch(
    out: Assembly,
    wall: WallFrame,
    x0: float,
    x1: float,
    reach: float,
    deck: float,
    eaves: float,
    top: float,
    *,
    roof: str = "shed",
    posts: int = 2,
) -> None:
    """Adds a roofed porch in front of a wall.

    The parts have the materials `trim` and `roof`. The roof extends 0.25 m
    beyond the posts.

    Args:
        out: the building under assembly, which gets the parts.
        wall: the wall.
        x0: left end along the wall [m].
        x1: right end along the wall [m].
        reach: distance of the posts from the wall [m].
        deck: height of the floor [m].
        eaves: height of the underside of the beam on the posts [m].
        top: height of the top of the roof [m].
        roof: `shed`, `gable` (a pediment across the full width) or `flat`.
        posts: number of posts, at least 2.
    """
    pieces = [massing.box(x0, x1, -0.05, reach, -massing.FOUNDATION_M, deck)]
    y, half = reach - 0.15, _POST_M / 2
    for x in np.linspace(x0 + 0.15, x1 - 0.15, posts).tolist():
        spot = (x - half, x + half, y - half, y + half)
        pieces.append(massing.box(*spot, deck, eaves + 0.02, bottom=False))
    pieces.append(massing.box(x0, x1, y - 0.1, y + 0.1, eaves, eaves + 0.22))
    for x in (x0 + 0.1, x1 - 0.1):
        pieces.append(
            massing.box(x - 0.1, x + 0.1, -0.05, y, eaves, eaves + 0.22)
        )
    lid = _porch_roof(x0, x1, reach, eaves + 0.2, top, roof)
    out.add_to("roof", wall.place(lid))
    if roof == "gable":
        z = eaves + 0.2
        line = roofs.gable_line(0.0, x1 - x0, z, top - 0.12)
        shield = roofs.gable_wall(line, 0.0, x1 - x0, z)
        pieces.append(shield.moved((x0, y + 0.08, 0.0)))
    out.add_to("trim", *(wall.place(piece) for piece in pieces))


def add_steps(
    out: Assembly,
    wall: WallFrame,
    x0: float,
    x1: float,
    start: float,
    rise: float,
    room: float = 9.0,
) -> None:
    """Adds steps of the material `base` that lead down and away from a wall.

    Args:
        out: the building under assembly, which gets the parts.
        wall: the wall.
        x0: left end along the wall [m].
        x1: right end along the wall [m].
        start: distance of the top step from the wall [m].
        rise: height of the top step [m].
        room: greatest length of the steps away from the wall [m].
    """
    count = max(1, round(rise / 0.17))
    run = min(0.29 * count, room)
    if run > 0.05 and rise > 0.05:
        flight = steps(x0, x1, run, rise, count)
        out.add_to("base", wall.place(flight.moved((0.0, start, 0.0))))


def _porch_roof(
    x0: float, x1: float, reach: float, z: float, top: float, roof: str
) -> Mesh:
    a, b, out = x0 - 0.15, x1 + 0.15, reach + 0.25
    if roof == "gable":
        line = roofs.gable_line(x0, x1, z + 0.1, top)
        line = roofs.with_eaves(line, 0.2, 0.2)
        return roofs.shell(line, -0.1, out, 0.12, along_y=True)
    if roof == "flat":
        return massing.box(a, b, -0.05, out, z, top)
    line = [(-0.05, top), (out, z + 0.1)]
    return roofs.shell(line, a, b, 0.12)


def add_railing(
    out: Assembly,
    part: str,
    wall: WallFrame,
    start: tuple[float, float],
    end: tuple[float, float],
    z: float,
    finish: Finish,
) -> None:
    """Places the shared mesh of a railing between two points at a wall.

    Args:
        out: the building under assembly, which gets the parts.
        part: name of the part.
        wall: the wall.
        start: first point: distances along the wall and out of the wall [m].
        end: last point: distances along the wall and out of the wall [m].
        z: height of the floor [m].
        finish: colour and material.
    """
    p, q = wall.point(*start), wall.point(*end)
    length = float(np.hypot(*(q - p)))
    out.place(
        part,
        out.shared("railing_panel", (round(length / RAILING_M, 3), 1.0, 1.0)),
        (*((p + q) / 2), z),
        math.atan2(*(q - p)[::-1]),
        finish=finish,
    )


def add_bay_window(
    out: Assembly,
    wall: WallFrame,
    x: float,
    width: float,
    reach: float,
    z0: float,
    z1: float,
    *,
    storeys: int = 1,
    canted: bool = True,
) -> None:
    """Adds a bay window that stands on the ground or hangs on the wall.

    The bay window has a row of windows for each storey, and the materials
    `glass`, `roof` and `walls`.

    Args:
        out: the building under assembly, which gets the parts.
        wall: the wall.
        x: middle of the window along the wall [m].
        width: width along the wall [m].
        reach: how far it reaches out of the wall [m].
        z0: height of the foot of the bay window [m]; at 0 the bay window stands
            on the ground.
        z1: height of its top [m].
        storeys: number of storeys between foot and top.
        canted: whether the sides are slanted; otherwise the bay window is a
            box.
    """
    a, b = x - width / 2, x + width / 2
    if canted:
        slant = min(reach, 0.28 * width)
        plan = [(a, -0.1), (a, 0.0), (a + slant, reach), (b - slant, reach),
                (b, 0.0), (b, -0.1)]  # fmt: skip
        flush = frozenset({0, 4, 5})
    else:
        plan = [(a, -0.1), (a, reach), (b, reach), (b, -0.1)]
        flush = frozenset({3})
    points = np.array([wall.point(*p) for p in plan])
    height = round(z1 - z0, 3)
    step = height / storeys

    def layout(edge: int, length: float) -> list[walls.Relief]:
        relief: list[walls.Relief] = []
        for k in range(storeys if edge not in flush and length >= 0.7 else 0):
            z = k * step
            pane = bays.window(
                length - 0.3, round(z + 0.75, 2), round(z + step - 0.45, 2),
                _RECESS, mullions=1 if length > 1.5 else 0, pier=0.15,
            )  # fmt: skip
            relief += pane(0.0, length)
        return relief

    bands = (walls.Band(height - 0.2, height, -0.08),)
    facade = walls.Facade(height, bands, layout, (_RECESS,), flush)
    if z0 == 0.0:
        under = massing.foundation(points)
    else:
        under = massing.flat(points, z0, up=False)
    out.add_to("walls", walls.facade_mesh(points, facade, z0), under)
    out.add_to("glass", walls.glass_mesh(points, facade, z0))
    reaches = [-0.12 * (k not in flush) for k in range(len(points))]
    outer = massing.inset(points, reaches)
    tip = (outer[0] + outer[-1]) / 2
    out.add_to(
        "roof",
        massing.flat(outer, z1, up=False),
        massing.skirt(outer, outer, z1, z1 + 0.15),
        massing.spire(outer, tip, z1 + 0.15, z1 + 0.15 + 0.7 * reach),
    )


def chimney_breast(
    wall: WallFrame, x: float, width: float, reach: float, top: float
) -> Mesh:
    """Returns a chimney in front of a wall, which narrows at its shoulders.

    Args:
        wall: the wall.
        x: middle of the chimney along the wall [m].
        width: width at the foot [m].
        reach: how far it reaches out of the wall [m].
        top: height of its top [m].
    """
    a, b = x - width / 2, x + width / 2
    neck = 0.62 * width / 2
    shoulder = 0.5 * top
    low = massing.rectangle(a, -0.05, b, reach)
    high = massing.rectangle(x - neck, -0.05, x + neck, reach)
    head = (x - neck - 0.08, x + neck + 0.08, -0.05, reach + 0.06)
    breast = merge_meshes(
        massing.skirt(low, low, -massing.FOUNDATION_M, shoulder),
        massing.skirt(low, high, shoulder, shoulder + 0.6),
        massing.prism(high, shoulder + 0.6, top),
        massing.box(*head, top - 0.35, top - 0.15),
    )
    return wall.place(breast)


def casings(
    reliefs: Sequence[walls.Relief],
    glass: Sequence[float],
    style: str,
    reach: float = 0.05,
) -> list[Mesh]:
    """Returns frames, sills or shutters for a wall's windows.

    The meshes are in wall coordinates [m].

    Args:
        reliefs: the reliefs of the wall.
        glass: depths of glazed reliefs; a relief with one of these depths is a
            window.
        style: `frame` (a ring of boards), `sill` or `shutters`.
        reach: how far the boards reach out of the wall [m]; sills reach twice
            as far.
    """
    pieces = []
    for r in reliefs:
        if r.depth not in glass or r.z1 - r.z0 < 0.5:
            continue
        if style == "frame":
            pieces.append(_ring(r, 0.12, reach))
        elif style == "sill":
            low = r.z0 - 0.1
            pieces.append(board(r.x0 - 0.1, r.x1 + 0.1, low, r.z0, 2 * reach))
        else:
            side = min((r.x1 - r.x0) / 2, 0.45)
            for a, b in ((r.x0 - side, r.x0), (r.x1, r.x1 + side)):
                pieces.append(board(a, b, r.z0, r.z1, reach))
    return pieces


def _ring(r: walls.Relief, width: float, reach: float) -> Mesh:
    """Returns boards around an opening, mitred at its corners."""
    w = width
    outer = [(r.x0 - w, r.z0 - w), (r.x0 - w, r.z1 + w),
             (r.x1 + w, r.z1 + w), (r.x1 + w, r.z0 - w)]  # fmt: skip
    inner = [(r.x0, r.z0), (r.x0, r.z1), (r.x1, r.z1), (r.x1, r.z0)]
    rings = ((outer, 0.0), (outer, reach), (inner, reach), (inner, 0.0))
    vertices = np.array([(x, y, z) for ring, y in rings for x, z in ring])
    faces = [
        (4 * n + k, 4 * n + (k + 1) % 4, 4 * n + 4 + (k + 1) % 4, 4 * n + 4 + k)
        for n in range(3)
        for k in range(4)
    ]
    return Mesh(vertices, tuple(faces))


def board(x0: float, x1: float, z0: float, z1: float, reach: float) -> Mesh:
    """Returns a board on a wall, in wall coordinates, without its back.

    Args:
        x0: left end [m].
        x1: right end [m].
        z0: height of the lower edge [m].
        z1: height of the upper edge [m].
        reach: thickness of the board [m].
    """
    v = [(x, y, z) for y in (0.0, reach) for z in (z0, z1) for x in (x0, x1)]
    faces = ((4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6),
             (0, 2, 6, 4), (1, 5, 7, 3))  # fmt: skip
    return Mesh(np.array(v), faces)
