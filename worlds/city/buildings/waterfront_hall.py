"""The waterfront hall: a long shed with a loading dock."""

import itertools
import math

import numpy as np

from worlds.city.facades import (
    Building,
    WallFrame,
    around,
    bays,
    foot_band,
    piers,
    porches,
    solids,
    top_band,
)
from worlds.city.facades.walls import Facade, facade_mesh, glass_mesh
from worlds.shapes import Mesh, merge_meshes, outlines

# Greatest number of bays of the front and one side together.
_MOST_BAYS = 15
# Height of the band below the eaves, where piers end [m].
_FRIEZE_M = 0.5
# Distance of the bays from the ends of a wall [m].
_END_M = 0.5
# Height of the sills of the windows [m].
_SILL_M = 2.2
# Distance of the dock from the ends of the front [m].
_DOCK_END_M = 2.0
# Distance of the dock from the front of the site [m].
_DOCK_EDGE_M = 0.4
# Number of steps at either end of the dock.
_DOCK_STEPS = 5
# Height of the canopy above the dock [m].
_CANOPY_M = 5.2
# By how much the ridge is below the monitor's top [m].
_MONITOR_ROOM_M = 0.6
# Part of the roof beside the monitor, at either end, as a share of its length.
_MONITOR_END = 0.15
# Length of a tooth of a sawtooth roof, approximately [m].
_TOOTH_M = 7.0
# Number of chords of a barrel roof.
_BARREL_CHORDS = 8


class WaterfrontHall(Building):
    """The waterfront hall: a long shed with a loading dock and big doors.

    `roof` is `gable`, `barrel` or `sawtooth`; the ridge is at `height`.
    """

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        self.roof = self.pick(("gable", "barrel", "sawtooth"))
        self.dock_depth = self.uniform(2.5, 4.0, digits=1)
        depth = site.depth - self.dock_depth
        self.eaves = round(self.height * self.uniform(0.6, 0.7), 1)
        self.spans = max(1, round(depth / self.uniform(16.0, 22.0)))
        self.pitch = max(
            self.uniform(4.5, 6.0), (site.width + depth) / _MOST_BAYS
        )
        self.pier_width = self.uniform(0.6, 0.9, digits=2)
        self.pier_reach = self.uniform(0.2, 0.34, digits=2)
        self.window_depth = self.uniform(0.2, 0.35, digits=2)
        self.door_every = self.whole(2, 4)
        self.dock_height = self.uniform(0.9, 1.2, digits=2)
        self.ventilators = self.whole(3, 7)

    def build(self) -> None:
        """Adds all parts of the waterfront hall, with its dock in front.

        The building's site must be a rectangle.
        """
        x0, y0, x1, y1 = self.site.bounds
        front = y0 + self.dock_depth
        plan = outlines.rectangle(x0, front, x1, y1)
        facade = _walls(self)
        pieces = [
            solids.foundation(plan),
            facade_mesh(plan, facade),
            piers.wall_piers(
                plan,
                pitch=self.pitch,
                width=self.pier_width,
                reach=self.pier_reach,
                z0=0.0,
                z1=self.eaves - _FRIEZE_M,
                margin=_END_M + self.pier_width / 2,
            ),
            *_dock(self, x0, x1, y0, front),
        ]
        self.add("walls", *pieces)
        self.add_glass("glass", glass_mesh(plan, facade))
        self.add("roof", _roof(self, plan), finish=self.colours["roof"])


def _walls(hall: WaterfrontHall) -> Facade:
    """Returns walls with tall windows between piers, and doors among them."""
    eaves, pitch = hall.eaves, hall.pitch
    head = eaves - 1.0
    window = bays.window(
        width=pitch - 1.6,
        sill=_SILL_M,
        head=head,
        depth=hall.window_depth,
        mullions=1,
        transom=round((_SILL_M + head) / 2, 2),
    )
    side_gate = bays.gate(width=pitch - 1.4, height=min(4.6, head - 0.3))
    dock_gate = bays.gate(
        width=pitch - 1.4, height=min(4.2 + hall.dock_height, head - 0.3)
    )
    front_bays = [dock_gate] + [window] * (hall.door_every - 1)
    rows = bays.rhythm(pitch, [window], margin=_END_M)
    layouts = {0: bays.rhythm(pitch, front_bays, margin=_END_M), 2: rows}
    sides = bays.with_middle(rows, side_gate, width=pitch)
    return Facade(
        eaves,
        bands=(
            foot_band(height=0.6, reach=0.1),
            top_band(eaves, height=_FRIEZE_M, reach=0.3),
        ),
        layout=bays.by_edge(layouts, sides),
        glass=(hall.window_depth,),
    )


def _dock(
    hall: WaterfrontHall, x0: float, x1: float, y0: float, front: float
) -> list[Mesh]:
    """Returns a loading platform under a canopy, with steps at both ends.

    Args:
        hall: the building.
        x0: least x of the site [m].
        x1: greatest x of the site [m].
        y0: least y of the site [m].
        front: y of the front wall [m].
    """
    height = hall.dock_height
    left, right = x0 + _DOCK_END_M, x1 - _DOCK_END_M
    edge = y0 + _DOCK_EDGE_M
    platform = solids.standing(
        x=(left, right), y=(edge, front), z1=height, bottom=True
    )
    steps = porches.steps(
        x0=0.0,
        x1=hall.dock_depth - 0.6,
        reach=1.6,
        rise=height,
        count=_DOCK_STEPS,
    )
    plan = outlines.rectangle(left, edge, right, front)
    pieces = [platform]
    pieces += [WallFrame(plan, side).place(steps) for side in (1, 3)]
    eaves = min(hall.eaves - 0.8, height + _CANOPY_M)
    outer = (front - hall.dock_depth + 0.1, eaves - 0.5)
    pieces.append(_dock_canopy((left, right), outer, (front, eaves)))
    cells = bays.stretches(right - left, pitch=1.5 * hall.pitch, margin=0.3)
    for start, _ in cells[1:]:
        post = solids.box(
            x=around(left + start, 0.12),
            y=(y0 + 0.6, y0 + 0.84),
            z=(height - 0.1, eaves - 0.2),
        )
        pieces.append(post)
    return pieces


def _dock_canopy(
    xs: bays.Span, outer: outlines.Point, inner: outlines.Point
) -> Mesh:
    """Returns a canopy that rises towards the wall.

    Args:
        xs: least and greatest x [m].
        outer: y and height of the lower edge of the underside [m].
        inner: y and height of the upper edge of the underside, at the wall [m].
    """
    (y_outer, z_outer), (y_inner, z_inner) = outer, inner
    section = [
        outer,
        inner,
        (y_inner, z_inner + 0.2),
        (y_outer, z_outer + 0.25),
    ]
    vertices = np.array([(x, y, z) for x in xs for y, z in section])
    faces = [(k, 4 + k, 4 + (k + 1) % 4, (k + 1) % 4) for k in range(4)]
    faces += [(0, 1, 2, 3), (7, 6, 5, 4)]
    return Mesh(vertices, tuple(faces)).inside_out()


def _roof(hall: WaterfrontHall, plan: np.ndarray) -> Mesh:
    """Returns the roof: one span or several, or the teeth of a sawtooth roof.

    `plan` contains the corners (4, 2) of the walls [m].
    """
    (x0, y0), (x1, y1) = plan[0], plan[2]
    rise = hall.height - hall.eaves
    if hall.roof == "sawtooth":
        teeth = solids.extruded(_sawtooth_line(x0, x1, rise), x0=y0, x1=y1)
        return solids.swapped(teeth).moved((0.0, 0.0, hall.eaves))
    pieces = []
    edges = np.linspace(y0, y1, hall.spans + 1)
    for front, back in itertools.pairwise(edges):
        line = _span_line(hall.roof, front, back, rise)
        span = solids.extruded(line, x0=x0, x1=x1)
        pieces.append(span.moved((0.0, 0.0, hall.eaves)))
        pieces += _monitor(hall, x0, x1, (front + back) / 2)
    return merge_meshes(*pieces)


def _monitor(
    hall: WaterfrontHall, x0: float, x1: float, y: float
) -> list[Mesh]:
    """Returns a monitor along the ridge with evenly spaced ventilators.

    Args:
        hall: the building.
        x0: least x of the roof [m].
        x1: greatest x of the roof [m].
        y: y of the ridge [m].
    """
    top, low = hall.height - 0.25, hall.height - 1.1
    length = x1 - x0
    start, end = x0 + _MONITOR_END * length, x1 - _MONITOR_END * length
    monitor = solids.box(
        x=(start, end), y=around(y, 0.7), z=(low, top), bottom=False
    )
    pieces = [monitor]
    for k in range(hall.ventilators):
        x = start + (k + 0.5) * (end - start) / hall.ventilators
        ventilator = solids.box(
            x=around(x, 0.5),
            y=around(y, 0.9),
            z=(low, hall.height),
            bottom=False,
        )
        pieces.append(ventilator)
    return pieces


def _sawtooth_line(x0: float, x1: float, rise: float) -> list[outlines.Point]:
    """Returns the roof line: upright glazing, and slopes that fall from it.

    The points are x and the height above the eaves; the line extends from `x0`
    to `x1`, and the teeth rise by `rise` [m].
    """
    teeth = max(2, round((x1 - x0) / _TOOTH_M))
    step = (x1 - x0) / teeth
    line = [(x0, 0.0)]
    for k in range(teeth):
        line += [(x0 + k * step, rise), (x0 + (k + 1) * step, 0.0)]
    return line


def _span_line(
    roof: str, front: float, back: float, rise: float
) -> list[outlines.Point]:
    """Returns the roof line of a span under a `gable` or `barrel` roof.

    The points are y and the height above the eaves; the line extends from
    `front` to `back`. The monitor rises by `rise` above the eaves, and the
    ridge by less [m].
    """
    ridge = rise - _MONITOR_ROOM_M
    half, middle = (back - front) / 2, (front + back) / 2
    if roof == "gable":
        return [(front, 0.0), (middle, ridge), (back, 0.0)]
    angles = np.linspace(np.pi, 0.0, _BARREL_CHORDS + 1)[1:-1]
    arc = [(middle + half * math.cos(t), ridge * math.sin(t)) for t in angles]
    return [(front, 0.0), *arc, (back, 0.0)]
