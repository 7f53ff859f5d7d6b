"""The tower under construction."""

import itertools

import numpy as np

from cns_drake.city.facades import (
    Building,
    Facade,
    WallFrame,
    around,
    bays,
    facade_mesh,
    foot_band,
    glass_mesh,
    outlines,
    solids,
)
from cns_drake.city.geometry import Finish, Mesh, merge_meshes

_STEEL = Finish((0.52, 0.53, 0.55))
_TIMBER = Finish((0.72, 0.58, 0.38))
# Thickness of the slabs [m].
_SLAB_M = 0.28
# Room for scaffolds around the frame [m].
_SCAFFOLD_M = 1.7
# Cladding stands this far in front of the slabs [m].
_CLADDING_M = 0.35
# Height of a storey of a scaffold, a lift [m].
_SCAFFOLD_LIFT_M = 2.0


class UnfinishedTower(Building):
    """The tower under construction: core, frame, scaffolds, cladding."""

    def draw(self) -> None:
        """Samples sizes and style."""
        rise = self.height - self.uniform(3.5, 5.5)
        wanted = max(3, round(rise / self.uniform(3.4, 4.0)))
        # Number of storeys that together are one part.
        self.group = -(-wanted // 8)
        # Number of slabs above the ground.
        self.storeys = self.group * max(2, round(wanted / self.group))
        self.storey = round(rise / self.storeys, 3)
        self.pitch = self.uniform(6.0, 8.0)
        # Width and depth of the core, as shares of the tower's width and depth.
        self.core = (self.uniform(0.28, 0.4), self.uniform(0.28, 0.4))
        # Number of storeys with finished walls.
        self.clad = self.group * self.whole(
            0, max(1, self.storeys // self.group // 2)
        )
        # Numbers of the edges with a scaffold.
        self.scaffolds = self.pick(((0,), (0, 1), (0, 3), (1, 3)))
        # Number of storeys that a scaffold covers.
        self.scaffold_top = min(self.whole(self.storeys // 2, self.storeys), 8)
        # Share of a scaffold's bays that have a net.
        self.nets = self.uniform(0.2, 0.7)
        # Whether the top slab is still propped.
        self.props = self.chance(0.7)
        # Whether there is a hoist at the back.
        self.hoist = self.chance(0.6)

    def build(self) -> None:
        """Adds all parts of the tower under construction.

        The building's site must be a rectangle.
        """
        site = outlines.rectangle(*self.site.bounds)
        plan = np.round(outlines.inset(site, _SCAFFOLD_M + 0.2), 2)
        _add_frame(self, plan)
        _add_core(self, plan)
        if self.clad:
            _add_cladding(self, plan)
        if self.props:
            _add_props(self, plan)
        _add_scaffolds(self, plan)
        if self.hoist:
            _add_hoist(self, plan)


def _column_places(
    tower: UnfinishedTower, plan: np.ndarray
) -> list[outlines.Point]:
    """Returns the places of the columns."""
    x0, y0, x1, y1 = outlines.extent(plan)
    places = []
    for a, b in ((x0, x1), (y0, y1)):
        count = min(6, max(2, round((b - a) / tower.pitch) + 1))
        places.append(np.round(np.linspace(a + 0.5, b - 0.5, count), 2))
    xs, ys = (place.tolist() for place in places)
    return [(x, y) for x in xs for y in ys]


def _add_frame(tower: UnfinishedTower, plan: np.ndarray) -> None:
    """Adds the columns and the slab of every storey."""
    columns = _column_places(tower, plan)
    low = tower.storey - _SLAB_M
    top = tower.storeys * tower.storey
    pieces = [
        solids.post(x, y, half=0.25, z1=low + 0.02, z0=0.0) for x, y in columns
    ]
    pieces.append(solids.prism(plan, z0=low, z1=tower.storey, bottom=True))
    # The stubs of the next storey's columns, and their reinforcing bars.
    stubs = [solids.prism(plan, z0=-solids.FOUNDATION_M, z1=0.05)]
    for x, y in columns:
        bar = outlines.regular_polygon(
            radius=0.05, count=3, center=(x + 0.12, y)
        )
        stubs.append(
            solids.box(
                x=around(x, 0.25),
                y=around(y, 0.25),
                z=(top - 0.05, top + 0.5),
            )
        )
        stubs.append(solids.prism(bar, z0=top + 0.45, z1=top + 1.5))
    for edge in range(4):
        wall = WallFrame(plan, edge)
        for z in (tower.storey + 0.5, tower.storey + 1.0):
            pieces.append(
                wall.box(
                    x=(0.05, wall.length - 0.05),
                    y=(-0.08, -0.03),
                    z=(z, z + 0.06),
                )
            )
        for u in np.linspace(0.1, wall.length - 0.1, 6).tolist():
            stubs.append(
                wall.box(
                    x=around(u, 0.03), y=(-0.09, -0.03), z=(top, top + 1.1)
                )
            )
    group = _repeated_meshes(pieces, tower.group, tower.storey)
    step = tower.group * tower.storey
    tower.stack(
        "frame", group, z0=0.0, step=step, count=tower.storeys // tower.group
    )
    tower.add("stubs", *stubs)


def _add_core(tower: UnfinishedTower, plan: np.ndarray) -> None:
    """Adds the core with its doorways, and the climbing formwork on it."""
    x0, y0, x1, y1 = outlines.extent(plan)
    x, y = (x0 + x1) / 2, (y0 + y1) / 2
    a, b = tower.core[0] * (x1 - x0) / 2, tower.core[1] * (y1 - y0) / 2
    core = np.round(outlines.rectangle(x - a, y - b, x + a, y + b), 2)
    door = bays.alone(
        bays.window(width=1.2, sill=0.05, head=2.2, depth=0.35), width=2.0
    )
    layout = bays.by_edge({0: door, 2: door}, bays.plain)
    facade = Facade(tower.storey, bands=(), layout=layout).stacked(
        tower.storeys
    )
    top = round(tower.storeys * tower.storey, 3)
    high = tower.height
    tower.add(
        "core",
        facade_mesh(core, facade),
        solids.skirt(core, core, z0=top, z1=high - 0.4),
        solids.roof_pan(
            core, z_floor=high - 2.0, z_top=high - 0.4, thickness=0.3
        ),
    )
    form = outlines.inset(core, -0.3)
    tower.add(
        "form",
        solids.skirt(form, form, z0=high - 2.6, z1=high),
        solids.flat(form, high - 2.6, up=False),
        solids.roof_pan(form, z_floor=high - 0.6, z_top=high, thickness=0.3),
        finish=_TIMBER,
    )


def _add_cladding(tower: UnfinishedTower, plan: np.ndarray) -> None:
    """Adds the finished walls of the lower storeys."""
    outer = outlines.inset(plan, -_CLADDING_M)
    head = round(tower.storey - 0.5, 2)
    pitch = max(tower.pitch / 2, max(np.ptp(plan, axis=0)) / 8)
    rows = bays.rhythm(
        pitch,
        [bays.window(width=pitch - 0.5, sill=0.7, head=head, depth=0.2)],
        margin=0.5,
    )
    facade = Facade(
        tower.storey,
        bands=(foot_band(height=0.2, reach=0.08),),
        layout=rows,
        glass=(0.2,),
    )
    # The backs of the panels, which are seen from within, and their top edges.
    backs = solids.skirt(plan[::-1], plan[::-1], z0=0.0, z1=tower.storey)
    rim = solids.skirt(outer, plan, z0=tower.storey, z1=tower.storey)
    walls = [facade_mesh(outer, facade), backs, rim]
    panes = [glass_mesh(outer, facade)]
    groups, step = tower.clad // tower.group, tower.group * tower.storey
    for part, pieces, finish in (
        ("cladding", walls, tower.colours["clad"]),
        ("cladding_glass", panes, tower.glass),
    ):
        mesh = _repeated_meshes(pieces, tower.group, tower.storey)
        tower.stack(part, mesh, z0=0.0, step=step, count=groups, finish=finish)
    tower.add("foot", solids.foundation(outer), finish=tower.colours["clad"])


def _add_props(tower: UnfinishedTower, plan: np.ndarray) -> None:
    """Adds props below the top slab, along the front and the back."""
    x0, y0, x1, y1 = outlines.extent(plan)
    low = (tower.storeys - 1) * tower.storey
    high = tower.storeys * tower.storey - _SLAB_M + 0.02
    props = []
    for x in np.linspace(x0 + 1.5, x1 - 1.5, max(3, round((x1 - x0) / 3.0))):
        for y in (y0 + 1.2, y1 - 1.2):
            shaft = outlines.regular_polygon(
                radius=0.06, count=4, center=(x, y)
            )
            props.append(solids.skirt(shaft, shaft, z0=low - 0.02, z1=high))
    tower.add("props", *props, finish=_STEEL)


def _add_scaffolds(tower: UnfinishedTower, plan: np.ndarray) -> None:
    """Adds scaffolds: uprights of full height, with platforms between them."""
    lifts = max(2, int(tower.scaffold_top * tower.storey / _SCAFFOLD_LIFT_M))
    per_group = -(-lifts // 6)
    groups = -(-lifts // per_group)
    lifts = per_group * groups
    levels, standards, nets = [], [], []
    for edge in tower.scaffolds:
        wall = WallFrame(plan, edge)
        count = max(2, round((wall.length - 0.4) / max(2.8, wall.length / 11)))
        xs = np.round(
            np.linspace(0.2, wall.length - 0.2, count + 1), 2
        ).tolist()
        levels.append(wall.place(_scaffold_level(xs)))
        for x in xs:
            for y in (0.6, 1.45):
                pole = outlines.square(x, y, half=0.04)
                mesh = solids.prism(
                    pole,
                    z0=-solids.FOUNDATION_M,
                    z1=lifts * _SCAFFOLD_LIFT_M + 0.9,
                )
                standards.append(wall.place(mesh))
        for a, b in itertools.pairwise(xs):
            if tower.chance(tower.nets):
                first = tower.whole(0, lifts - 1)
                last = tower.whole(first + 1, lifts + 1)
                low = first * _SCAFFOLD_LIFT_M + 0.2
                high = last * _SCAFFOLD_LIFT_M - 0.2
                nets.append(
                    wall.box(
                        x=(round(a + 0.05, 2), round(b - 0.05, 2)),
                        y=(1.56, 1.6),
                        z=(low, high),
                    )
                )
    stack = _repeated_meshes(levels, per_group, _SCAFFOLD_LIFT_M)
    tower.stack(
        "scaffold",
        stack,
        z0=0.0,
        step=per_group * _SCAFFOLD_LIFT_M,
        count=groups,
        finish=_STEEL,
    )
    tower.add("standards", *standards, finish=_STEEL)
    tower.add("nets", *nets, finish=tower.colours["net"])


def _add_hoist(tower: UnfinishedTower, plan: np.ndarray) -> None:
    """Adds a hoist's mast and cage at the back."""
    wall = WallFrame(plan, 2)
    x = 0.5 * wall.length
    top = tower.storeys * tower.storey - 1.0
    pieces = [
        wall.standing(x=around(u, 0.05), y=around(v, 0.05), z1=top)
        for u in (x - 0.3, x + 0.3)
        for v in (0.3, 0.9)
    ]
    for z in np.arange(1.0, top, 4.5).tolist():
        pieces.append(
            wall.box(x=around(x, 0.3), y=(-0.05, 0.92), z=(z, z + 0.08))
        )
    z = round(0.55 * top, 1)
    cage = wall.box(x=(x + 0.4, x + 1.9), y=(0.15, 1.35), z=(z, z + 2.4))
    tower.add("hoist", *pieces, cage, finish=Finish((0.80, 0.62, 0.16)))


def _repeated_meshes(pieces: list[Mesh], count: int, step: float) -> Mesh:
    """Returns meshes repeated `count` times, one above another."""
    storey = merge_meshes(*pieces)
    copies = (storey.moved((0.0, 0.0, k * step)) for k in range(count))
    return merge_meshes(*copies)


def _scaffold_level(xs: list[float]) -> Mesh:
    """Returns one platform of a scaffold: boards, a guard rail and braces."""
    a = xs[0]
    b = xs[-1]
    top = _SCAFFOLD_LIFT_M
    pieces = [solids.box(x=(a, b), y=(0.55, 1.5), z=(top - 0.12, top - 0.05))]
    for z in (0.5, 1.0):
        pieces.append(solids.box(x=(a, b), y=(1.5, 1.54), z=(z, z + 0.06)))
    for x0, x1 in itertools.pairwise(xs[::3]):
        start, stop = (x0, 1.54, 0.05), (x1, 1.54, top - 0.15)
        pieces.append(solids.beam(start, stop, width=0.07))
    return merge_meshes(*pieces)
