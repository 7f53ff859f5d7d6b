"""Shapes of parked vehicles: lower body, cabin, glass, wheels.

Vehicle frame: x forward, y left, z up; the origin is on the ground below the
middle of the vehicle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cns_drake.city.geometry.lofts import along_y, beam, lathe, loft
from cns_drake.city.geometry.mesh import Mesh, box_mesh, merge_meshes

# Where along a wheel arch the lower body has cross sections, in arch radii.
_ARCH_STATIONS = (-1.0, -0.92, -0.55, 0.0, 0.55, 0.92, 1.0)
_ARCH_GAP = 0.06
_TYRE_WIDTH = 0.2


@dataclass(frozen=True)
class CarForm:
    """The outline of a vehicle.

    Attributes:
        length: overall [m].
        width: overall, without mirrors [m].
        height: of the roof [m].
        axles: x of the rear and of the front axle [m].
        wheel_radius: [m].
        sill: height of the body's underside [m].
        line: (x, z) of the upper edge of the lower body from the rear to
            the front: boot, belt line, bonnet [m].
        cabin_base: x of the rear and front end of the cabin at the belt [m].
        cabin_roof: x of the rear and front end of the roof [m].
        pillars: x at the belt of the pillars between the first and the
            last one [m].
        panelled: side windows only beside the front seats, as on vans.
        bed_wall: height of the walls around an open bed behind the cabin,
            0 for none [m].
    """

    length: float
    width: float
    height: float
    axles: tuple[float, float]
    wheel_radius: float
    sill: float
    line: tuple[tuple[float, float], ...]
    cabin_base: tuple[float, float]
    cabin_roof: tuple[float, float]
    pillars: tuple[float, ...]
    panelled: bool = False
    bed_wall: float = 0.0

    def belt(self, x: float) -> float:
        """Returns the height of the lower body's upper edge at `x` [m]."""
        xs, zs = zip(*self.line, strict=True)
        return float(np.interp(x, xs, zs))

    def half_width(self, x: float) -> float:
        """Returns half the width at `x`: the ends are drawn in [m]."""
        straight = 0.34 * self.length
        over = max(abs(x) - straight, 0.0) / (self.length / 2 - straight)
        return self.width / 2 * (1 - 0.13 * over**2)


def car_meshes(form: CarForm) -> tuple[Mesh, Mesh]:
    """Returns the painted body and the dark trim (glass, wheels)."""
    paint = [_lower_body(form), _roof(form), *_mirrors(form)]
    trim = [*_wheels(form), *_lamps(form)]
    if form.bed_wall > 0:
        paint += _bed(form)
    if form.panelled:
        paint.append(_cabin(form, 0.0))
        trim += _van_windows(form)
    else:
        paint += _pillars(form)
        trim.append(_cabin(form, 0.025))
    return merge_meshes(*paint), merge_meshes(*trim)


def _lower_body(form: CarForm) -> Mesh:
    """Returns the closed skin up to the belt line, with wheel arches."""
    arch = form.wheel_radius + _ARCH_GAP
    # The arch meets the sill below the axle, where it is narrower.
    reach = np.sqrt(arch**2 - (form.wheel_radius - form.sill) ** 2)
    stations = {x for x, _ in form.line}
    for axle in form.axles:
        stations = {x for x in stations if abs(x - axle) > reach + 0.03}
        stations |= {axle + share * reach for share in _ARCH_STATIONS}
    sections = []
    for x in sorted(stations):
        bottom = form.sill
        end = form.length / 2 - abs(x)
        if end < 0.1:
            bottom += 0.12
        for axle in form.axles:
            off = (x - axle) / reach
            if abs(off) < 0.999:
                # A low ellipse through the sill points and the arch top.
                top = form.wheel_radius + arch
                rise = (top - form.sill) * np.sqrt(1 - off**2)
                bottom = form.sill + rise
        top = form.belt(x)
        waist = max(0.62 * top + 0.04, bottom + 0.03)
        w = form.half_width(x)
        right = [
            (0.93 * w, bottom),
            (w, waist),
            (w - 0.07, top),
            (0.55 * w, top + 0.025),
        ]
        ring = [*right, *((-y, z) for y, z in reversed(right))]
        sections.append([(x, y, z) for y, z in ring])
    return loft(sections)


def _cabin_outline(form: CarForm, level: float, inset: float) -> np.ndarray:
    """Returns the cabin's outline, 0 at the belt to 1 at the roof, (6, 3)."""
    rear, front = (
        (1 - level) * base + level * roof
        for base, roof in zip(form.cabin_base, form.cabin_roof, strict=True)
    )
    rear, front = rear + inset, front - inset
    slope = 0.1 if form.panelled else 0.17
    half = form.width / 2 - 0.08 - slope * level - inset
    bow = 0.07
    x = np.array(
        [front - bow, rear + bow, rear, rear + bow, front - bow, front]
    )
    y = half * np.array([1.0, 1.0, 0.0, -1.0, -1.0, 0.0])
    # One slanted plane from the rear to the front.
    low = [form.belt(end) - 0.03 for end in form.cabin_base]
    belt = low[0] + (low[1] - low[0]) * (x - rear) / (front - rear)
    z = (1 - level) * belt + level * (form.height - 0.06)
    return np.column_stack([x, y, z])


def _cabin(form: CarForm, inset: float) -> Mesh:
    """Returns the closed cabin from just below the belt to the roof."""
    return loft([_cabin_outline(form, t, inset) for t in (0.0, 0.6, 1.0)])


def _roof(form: CarForm) -> Mesh:
    """Returns the roof panel, a little wider than the cabin below it."""
    edge = _cabin_outline(form, 1.0, -0.01)
    middle = edge.mean(axis=0)
    low = edge - np.array([0.0, 0.0, 0.025])
    crown = middle + (edge - middle) * (0.9, 0.8, 1.0)
    crown[:, 2] = form.height
    return loft([low, edge, crown])


def _pillars(form: CarForm) -> list[Mesh]:
    low, high = (_cabin_outline(form, t, 0.012) for t in (0.0, 1.0))
    ends = ((0, 0.07), (1, 0.13))
    pieces = []
    for k, depth in ends:
        mirror = 4 if k == 0 else 3
        pieces += [beam(low[i], high[i], 0.04, depth) for i in (k, mirror)]
    front, rear = low[0], low[1]
    for x in form.pillars:
        share = (x - rear[0]) / (front[0] - rear[0])
        for side in (1, -1):
            a, b = (
                (line[1] + share * (line[0] - line[1])) * (1, side, 1)
                for line in (low, high)
            )
            pieces.append(beam(a, b, 0.04, 0.08))
    return pieces


def _van_windows(form: CarForm) -> list[Mesh]:
    """Returns windscreen and door windows as thin panes on the cabin."""
    at = {t: _cabin_outline(form, t, 0.0) for t in (0.12, 0.25, 0.78, 0.8)}
    panes = []
    for near, far in ((4, 5), (5, 0)):
        low, high = at[0.12], at[0.8]
        panes.append(_pane([low[near], low[far], high[far], high[near]], 0.94))
    low, high = at[0.25], at[0.78]
    door = min(0.9, 0.35 * (low[0, 0] - low[1, 0]))
    back = np.array([door, 0.0, 0.0])
    for side in (1, -1):
        a, b = low[0] * (1, side, 1), high[0] * (1, side, 1)
        ring = [a - 0.12 * back, b - 0.12 * back, b - back, a - back]
        panes.append(_pane(ring if side > 0 else ring[::-1], 0.97))
    return panes


def _pane(ring: Sequence[np.ndarray], size: float) -> Mesh:
    """Returns a thin plate on four corners, counter-clockwise from outside."""
    corners = np.array(ring)
    middle = corners.mean(axis=0)
    corners = middle + size * (corners - middle)
    normal = np.cross(corners[2] - corners[0], corners[3] - corners[1])
    normal /= np.linalg.norm(normal)
    # The average plane: the caps of a loft have to be plane.
    corners = corners - np.outer((corners - middle) @ normal, normal)
    return loft([corners - 0.03 * normal, corners + 0.012 * normal])


def _mirrors(form: CarForm) -> list[Mesh]:
    corner = _cabin_outline(form, 0.12, 0.0)[0]
    return [
        box_mesh(
            (0.09, 0.2, 0.14),
            (corner[0] - 0.12, side * (corner[1] + 0.1), corner[2] + 0.05),
        )
        for side in (1, -1)
    ]


def _bed(form: CarForm) -> list[Mesh]:
    """Returns the side walls and the tailgate of an open bed."""
    rear, front = 0.05 - form.length / 2, form.cabin_base[0]
    z = form.belt(rear + 0.3)
    half = form.width / 2 - 0.1
    long = (front - rear, 0.07, form.bed_wall)
    middle = z + form.bed_wall / 2
    walls = [
        box_mesh(long, ((rear + front) / 2, side * half, middle))
        for side in (1, -1)
    ]
    gate = (0.07, 2 * half + 0.07, form.bed_wall)
    return [*walls, box_mesh(gate, (rear + 0.035, 0.0, middle))]


def _lamps(form: CarForm) -> list[Mesh]:
    """Returns grille and number plate, head and rear lamps."""
    nose, tail = form.length / 2, -form.length / 2
    front, rear = form.belt(nose) - 0.04, form.belt(tail) - 0.02
    y = form.half_width(nose) - 0.22
    pieces = [
        box_mesh((0.06, 0.7, 0.16), (nose - 0.015, 0, front - 0.06)),
        box_mesh((0.06, 0.5, 0.11), (tail + 0.015, 0, rear - 0.12)),
    ]
    pieces += [
        box_mesh((0.1, 0.24, 0.1), (x, side * y, z))
        for x, z in ((nose - 0.045, front), (tail + 0.045, rear))
        for side in (1, -1)
    ]
    return pieces


def _wheels(form: CarForm) -> list[Mesh]:
    r, half = form.wheel_radius, _TYRE_WIDTH / 2
    left = along_y(lathe([(r, -half), (r, half - 0.03), (0.85 * r, half)], 10))
    track = form.width / 2 - half - 0.03
    return [
        left.moved((axle, side * track, r), yaw)
        for axle in form.axles
        for side, yaw in ((1, 0.0), (-1, np.pi))
    ]
