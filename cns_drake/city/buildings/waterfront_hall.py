"""The waterfront hall: a long shed with a loading dock."""

import itertools

import numpy as np

from cns_drake.city.facades import (
    Building,
    WallFrame,
    around,
    bays,
    foot_band,
    outlines,
    piers,
    porches,
    solids,
    top_band,
)
from cns_drake.city.facades.walls import Facade, facade_mesh, glass_mesh
from cns_drake.city.geometry.mesh import Mesh, merge_meshes


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
        self.pitch = max(self.uniform(4.5, 6.0), (site.width + depth) / 15)
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
                z1=self.eaves - 0.5,
                margin=0.5 + self.pier_width / 2,
            ),
            *_dock(self, x0, x1, y0, front),
        ]
        self.add("walls", *pieces)
        self.add_glass("glass", glass_mesh(plan, facade))
        self.add("roof", _roof(self, plan), finish=self.colours["roof"])


def _walls(hall: WaterfrontHall) -> Facade:
    """Returns walls with tall windows between piers, and doors among them."""
    head = hall.eaves - 1.0
    window = bays.window(
        width=hall.pitch - 1.6,
        sill=2.2,
        head=head,
        depth=hall.window_depth,
        mullions=1,
        transom=round((2.2 + head) / 2, 2),
    )
    door = bays.gate(width=hall.pitch - 1.4, height=min(4.6, head - 0.3))
    front = bays.gate(
        width=hall.pitch - 1.4, height=min(4.2 + hall.dock_height, head - 0.3)
    )
    choices = [front] + [window] * (hall.door_every - 1)
    rows = bays.rhythm(hall.pitch, [window], margin=0.5)
    layouts = {0: bays.rhythm(hall.pitch, choices, margin=0.5), 2: rows}
    layout = bays.by_edge(
        layouts, bays.with_middle(rows, door, width=hall.pitch)
    )
    bands = (
        foot_band(height=0.6, reach=0.1),
        top_band(hall.eaves, height=0.5, reach=0.3),
    )
    return Facade(
        hall.eaves, bands=bands, layout=layout, glass=(hall.window_depth,)
    )


def _dock(
    hall: WaterfrontHall, x0: float, x1: float, y0: float, front: float
) -> list[Mesh]:
    """Returns a loading platform under a canopy, with steps at both ends."""
    high = hall.dock_height
    a, b = x0 + 2.0, x1 - 2.0
    platform = solids.standing(
        x=(a, b), y=(y0 + 0.4, front), z1=high, bottom=True
    )
    steps = porches.steps(
        x0=0.0, x1=hall.dock_depth - 0.6, reach=1.6, rise=high, count=5
    )
    ends = outlines.rectangle(a, y0 + 0.4, b, front)
    pieces = [platform]
    pieces += [WallFrame(ends, k).place(steps) for k in (1, 3)]
    eaves = min(hall.eaves - 0.8, high + 5.2)
    ya, za = front - hall.dock_depth + 0.1, eaves - 0.5
    yb, zb = front, eaves
    section = [(ya, za), (yb, zb), (yb, zb + 0.2), (ya, za + 0.25)]
    vertices = np.array([(x, y, z) for x in (a, b) for y, z in section])
    faces = [(k, 4 + k, 4 + (k + 1) % 4, (k + 1) % 4) for k in range(4)]
    faces += [(0, 1, 2, 3), (7, 6, 5, 4)]
    pieces.append(Mesh(vertices, tuple(faces)).inside_out())
    for x, _ in bays.stretches(b - a, pitch=1.5 * hall.pitch, margin=0.3)[1:]:
        pieces.append(
            solids.box(
                x=(a + x - 0.12, a + x + 0.12),
                y=(y0 + 0.6, y0 + 0.84),
                z=(high - 0.1, eaves - 0.2),
            )
        )
    return pieces


def _roof(hall: WaterfrontHall, plan: np.ndarray) -> Mesh:
    (x0, y0), (x1, y1) = plan[0], plan[2]
    rise = hall.height - hall.eaves
    if hall.roof == "sawtooth":
        teeth = solids.extruded(_sawtooth_line(x0, x1, rise), x0=y0, x1=y1)
        return solids.swapped(teeth).moved((0.0, 0.0, hall.eaves))
    pieces = []
    edges = np.linspace(y0, y1, hall.spans + 1)
    for a, b in itertools.pairwise(edges):
        shed = solids.extruded(_span_line(hall.roof, a, b, rise), x0=x0, x1=x1)
        pieces.append(shed.moved((0.0, 0.0, hall.eaves)))
        pieces += _monitor(hall, x0, x1, (a + b) / 2)
    return merge_meshes(*pieces)


def _monitor(
    hall: WaterfrontHall, x0: float, x1: float, y: float
) -> list[Mesh]:
    """Returns a monitor along the ridge with evenly spaced ventilators."""
    top, low = hall.height - 0.25, hall.height - 1.1
    length = x1 - x0
    a, b = x0 + 0.15 * length, x1 - 0.15 * length
    pieces = [
        solids.box(x=(a, b), y=around(y, 0.7), z=(low, top), bottom=False)
    ]
    for k in range(hall.ventilators):
        x = a + (k + 0.5) * (b - a) / hall.ventilators
        pieces.append(
            solids.box(
                x=around(x, 0.5),
                y=around(y, 0.9),
                z=(low, hall.height),
                bottom=False,
            )
        )
    return pieces


def _sawtooth_line(x0: float, x1: float, rise: float) -> list:
    """Returns the roof line: upright glazing, and slopes that fall from it."""
    teeth = max(2, round((x1 - x0) / 7.0))
    step = (x1 - x0) / teeth
    line = [(x0, 0.0)]
    for k in range(teeth):
        line += [(x0 + k * step, rise), (x0 + (k + 1) * step, 0.0)]
    return line


def _span_line(roof: str, a: float, b: float, rise: float) -> list:
    # Leaves room for the monitor, which rises above the ridge.
    rise -= 0.6
    half, middle = (b - a) / 2, (a + b) / 2
    if roof == "gable":
        return [(a, 0.0), (middle, rise), (b, 0.0)]
    angles = np.linspace(np.pi, 0.0, 9)[1:-1]
    arc = [(middle + half * np.cos(t), rise * np.sin(t)) for t in angles]
    return [(a, 0.0), *arc, (b, 0.0)]
