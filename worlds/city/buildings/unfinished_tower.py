"""The tower under construction."""

import itertools

import numpy as np

from worlds.city.facades import (
    Building,
    Facade,
    WallFrame,
    around,
    bays,
    facade_mesh,
    foot_band,
    glass_mesh,
    solids,
)
from worlds.shapes import Finish, Mesh, merge_meshes, outlines

# Finish of scaffolds and props.
_STEEL = Finish((0.52, 0.53, 0.55))
# Finish of the formwork.
_TIMBER = Finish((0.72, 0.58, 0.38))
# Thickness of the slabs [m].
_SLAB_M = 0.28
# Room for scaffolds around the frame [m].
_SCAFFOLD_M = 1.7
# Cladding stands this far in front of the slabs [m].
_CLADDING_M = 0.35
# Height of a storey of a scaffold, a lift [m].
_SCAFFOLD_LIFT_M = 2.0
# Greatest number of parts of which the frame consists, approximately.
_MOST_GROUPS = 8
# Greatest number of parts of which a scaffold consists.
_MOST_SCAFFOLD_GROUPS = 6
# Greatest number of storeys that a scaffold covers.
_MOST_SCAFFOLD_STOREYS = 8
# Greatest number of columns in a row.
_MOST_COLUMNS = 6
# Distance of the columns from the edges of the slabs [m].
_COLUMN_EDGE_M = 0.5
# Half the width of a column [m].
_COLUMN_HALF_M = 0.25
# Height of the guard rails of a storey above its slab [m].
_RAILS_M = (0.5, 1.0)
# Number of posts of the guard rail along an edge of the topmost slab.
_RAIL_POSTS = 6
# Height of the formwork on the core [m].
_FORM_M = 2.6
# Distance of the formwork's outer side from the core [m].
_FORM_REACH_M = 0.3
# Depth of the windows of the cladding [m].
_RECESS_M = 0.2
# Distance between props below the topmost slab, approximately [m].
_PROP_PITCH_M = 3.0
# Distances of the uprights of a scaffold from the slabs [m].
_UPRIGHTS_M = (0.6, 1.45)
# Distance of the outermost uprights from the ends of an edge [m].
_SCAFFOLD_END_M = 0.2
# Least length of a scaffold's bay [m].
_SCAFFOLD_BAY_M = 2.8
# Greatest number of a scaffold's bays along an edge.
_MOST_SCAFFOLD_BAYS = 11
# Distance between the ties of the hoist's mast [m].
_TIE_PITCH_M = 4.5
# Half the side of the hoist's mast [m].
_MAST_HALF_M = 0.3
# Finish of the hoist.
_HOIST = Finish((0.80, 0.62, 0.16))


class UnfinishedTower(Building):
    """The tower under construction: core, frame, scaffolds, cladding."""

    def draw(self) -> None:
        rise = self.height - self.uniform(3.5, 5.5)
        wanted = max(3, round(rise / self.uniform(3.4, 4.0)))
        # Number of storeys that together are one part.
        self.group = -(-wanted // _MOST_GROUPS)
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
        wanted_top = self.whole(self.storeys // 2, self.storeys)
        self.scaffold_top = min(wanted_top, _MOST_SCAFFOLD_STOREYS)
        # Share of a scaffold's bays that have a net.
        self.nets = self.uniform(0.2, 0.7)
        # Whether the top slab is still propped.
        self.props = self.chance(0.7)
        # Whether there is a hoist at the back.
        self.hoist = self.chance(0.6)

    def build(self) -> None:
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
    """Returns the places of the columns, in a grid over the slab [m]."""
    x0, y0, x1, y1 = outlines.extent(plan)
    rows = []
    for low, high in ((x0, x1), (y0, y1)):
        wanted = max(2, round((high - low) / tower.pitch) + 1)
        count = min(_MOST_COLUMNS, wanted)
        row = np.linspace(low + _COLUMN_EDGE_M, high - _COLUMN_EDGE_M, count)
        rows.append(np.round(row, 2))
    xs, ys = (row.tolist() for row in rows)
    return [(x, y) for x in xs for y in ys]


def _add_frame(tower: UnfinishedTower, plan: np.ndarray) -> None:
    """Adds the columns and the slab of every storey."""
    columns = _column_places(tower, plan)
    ceiling = tower.storey - _SLAB_M
    storey = [
        solids.post(x, y, half=_COLUMN_HALF_M, z1=ceiling + 0.02, z0=0.0)
        for x, y in columns
    ]
    storey.append(solids.prism(plan, z0=ceiling, z1=tower.storey, bottom=True))
    storey += _guard_rails(tower, plan)
    group = _repeated_meshes(storey, tower.group, tower.storey)
    tower.stack(
        "frame",
        group,
        z0=0.0,
        step=tower.group * tower.storey,
        count=tower.storeys // tower.group,
    )
    ground = solids.prism(plan, z0=-solids.FOUNDATION_M, z1=0.05)
    top = tower.storeys * tower.storey
    stubs = [piece for x, y in columns for piece in _column_stub(x, y, top)]
    tower.add("stubs", ground, *stubs, *_rail_posts(plan, top))


def _guard_rails(tower: UnfinishedTower, plan: np.ndarray) -> list[Mesh]:
    """Returns the guard rails along all edges of a storey's slab."""
    rails = []
    for edge in range(4):
        wall = WallFrame(plan, edge)
        for height in _RAILS_M:
            z = tower.storey + height
            rail = wall.box(
                x=(0.05, wall.length - 0.05), y=(-0.08, -0.03), z=(z, z + 0.06)
            )
            rails.append(rail)
    return rails


def _rail_posts(plan: np.ndarray, z: float) -> list[Mesh]:
    """Returns the posts of the guard rails on the slab at a height z [m]."""
    posts = []
    for edge in range(4):
        wall = WallFrame(plan, edge)
        for x in np.linspace(0.1, wall.length - 0.1, _RAIL_POSTS).tolist():
            post = wall.box(x=around(x, 0.03), y=(-0.09, -0.03), z=(z, z + 1.1))
            posts.append(post)
    return posts


def _column_stub(x: float, y: float, z: float) -> list[Mesh]:
    """Returns the beginning of the next storey's column, with a bar.

    `x` and `y` are the place of the column, and `z` is the height of the slab
    on which the column stands [m].
    """
    stub = solids.box(
        x=around(x, _COLUMN_HALF_M),
        y=around(y, _COLUMN_HALF_M),
        z=(z - 0.05, z + 0.5),
    )
    section = outlines.regular_polygon(
        radius=0.05, count=3, center=(x + 0.12, y)
    )
    return [stub, solids.prism(section, z0=z + 0.45, z1=z + 1.5)]


def _add_core(tower: UnfinishedTower, plan: np.ndarray) -> None:
    """Adds the core with its doorways, and the climbing formwork on it."""
    x0, y0, x1, y1 = outlines.extent(plan)
    x, y = (x0 + x1) / 2, (y0 + y1) / 2
    x_share, y_share = tower.core
    left, right = around(x, x_share * (x1 - x0) / 2)
    front, back = around(y, y_share * (y1 - y0) / 2)
    core = np.round(outlines.rectangle(left, front, right, back), 2)
    door = bays.window(width=1.2, sill=0.05, head=2.2, depth=0.35)
    doorway = bays.alone(door, width=2.0)
    layout = bays.by_edge({0: doorway, 2: doorway})
    walls = Facade(tower.storey, layout=layout).stacked(tower.storeys)
    top_slab = round(tower.storeys * tower.storey, 3)
    top = tower.height
    core_top = top - 0.4
    tower.add(
        "core",
        facade_mesh(core, walls),
        solids.skirt(core, core, z0=top_slab, z1=core_top),
        solids.roof_pan(core, z_floor=top - 2.0, z_top=core_top, thickness=0.3),
    )
    form = outlines.inset(core, -_FORM_REACH_M)
    tower.add(
        "form",
        solids.skirt(form, form, z0=top - _FORM_M, z1=top),
        solids.flat(form, top - _FORM_M, up=False),
        solids.roof_pan(form, z_floor=top - 0.6, z_top=top, thickness=0.3),
        finish=_TIMBER,
    )


def _add_cladding(tower: UnfinishedTower, plan: np.ndarray) -> None:
    """Adds the finished walls of the lower storeys."""
    outer = outlines.inset(plan, -_CLADDING_M)
    head = round(tower.storey - 0.5, 2)
    pitch = max(tower.pitch / 2, max(np.ptp(plan, axis=0)) / 8)
    window = bays.window(
        width=pitch - 0.5, sill=0.7, head=head, depth=_RECESS_M
    )
    rows = bays.rhythm(pitch, [window], margin=0.5)
    facade = Facade(
        tower.storey,
        bands=(foot_band(height=0.2, reach=0.08),),
        layout=rows,
        glass=(_RECESS_M,),
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
    count = max(3, round((x1 - x0) / _PROP_PITCH_M))
    props = []
    for x in np.linspace(x0 + 1.5, x1 - 1.5, count):
        for y in (y0 + 1.2, y1 - 1.2):
            shaft = outlines.regular_polygon(
                radius=0.06, count=4, center=(x, y)
            )
            props.append(solids.skirt(shaft, shaft, z0=low - 0.02, z1=high))
    tower.add("props", *props, finish=_STEEL)


def _add_scaffolds(tower: UnfinishedTower, plan: np.ndarray) -> None:
    """Adds scaffolds: uprights of full height, with platforms between them."""
    wanted = max(2, int(tower.scaffold_top * tower.storey / _SCAFFOLD_LIFT_M))
    per_group = -(-wanted // _MOST_SCAFFOLD_GROUPS)
    groups = -(-wanted // per_group)
    lifts = per_group * groups
    levels, uprights, nets = [], [], []
    for edge in tower.scaffolds:
        wall = WallFrame(plan, edge)
        xs = _scaffold_places(wall.length)
        levels.append(wall.place(_scaffold_level(xs)))
        uprights += _uprights(wall, xs, lifts * _SCAFFOLD_LIFT_M + 0.9)
        nets += _nets(tower, wall, xs, lifts)
    stack = _repeated_meshes(levels, per_group, _SCAFFOLD_LIFT_M)
    tower.stack(
        "scaffold",
        stack,
        z0=0.0,
        step=per_group * _SCAFFOLD_LIFT_M,
        count=groups,
        finish=_STEEL,
    )
    tower.add("standards", *uprights, finish=_STEEL)
    tower.add("nets", *nets, finish=tower.colours["net"])


def _scaffold_places(length: float) -> list[float]:
    """Returns the places of uprights along an edge of a length [m]."""
    bay = max(_SCAFFOLD_BAY_M, length / _MOST_SCAFFOLD_BAYS)
    count = max(2, round((length - 2 * _SCAFFOLD_END_M) / bay))
    xs = np.linspace(_SCAFFOLD_END_M, length - _SCAFFOLD_END_M, count + 1)
    return np.round(xs, 2).tolist()


def _uprights(wall: WallFrame, xs: list[float], top: float) -> list[Mesh]:
    """Returns two uprights at each place along an edge, up to a height [m]."""
    poles = []
    for x in xs:
        for y in _UPRIGHTS_M:
            section = outlines.square(x, y, half=0.04)
            pole = solids.prism(section, z0=-solids.FOUNDATION_M, z1=top)
            poles.append(wall.place(pole))
    return poles


def _nets(
    tower: UnfinishedTower, wall: WallFrame, xs: list[float], lifts: int
) -> list[Mesh]:
    """Returns nets over random parts of a scaffold's bays.

    Args:
        wall: the edge with the scaffold.
        xs: places of the uprights along the edge [m].
    """
    nets = []
    for start, end in itertools.pairwise(xs):
        if tower.chance(tower.nets):
            first = tower.whole(0, lifts - 1)
            last = tower.whole(first + 1, lifts + 1)
            net = wall.box(
                x=(round(start + 0.05, 2), round(end - 0.05, 2)),
                y=(1.56, 1.6),
                z=(
                    first * _SCAFFOLD_LIFT_M + 0.2,
                    last * _SCAFFOLD_LIFT_M - 0.2,
                ),
            )
            nets.append(net)
    return nets


def _add_hoist(tower: UnfinishedTower, plan: np.ndarray) -> None:
    """Adds a hoist's mast and cage at the back."""
    wall = WallFrame(plan, 2)
    middle = 0.5 * wall.length
    top = tower.storeys * tower.storey - 1.0
    pieces = [
        wall.standing(x=around(x, 0.05), y=around(y, 0.05), z1=top)
        for x in around(middle, _MAST_HALF_M)
        for y in (0.3, 0.9)
    ]
    for z in np.arange(1.0, top, _TIE_PITCH_M).tolist():
        tie = wall.box(
            x=around(middle, _MAST_HALF_M), y=(-0.05, 0.92), z=(z, z + 0.08)
        )
        pieces.append(tie)
    z = round(0.55 * top, 1)
    cage = wall.box(
        x=(middle + 0.4, middle + 1.9), y=(0.15, 1.35), z=(z, z + 2.4)
    )
    tower.add("hoist", *pieces, cage, finish=_HOIST)


def _repeated_meshes(pieces: list[Mesh], count: int, step: float) -> Mesh:
    """Returns meshes repeated `count` times, one above another."""
    storey = merge_meshes(*pieces)
    copies = (storey.moved((0.0, 0.0, k * step)) for k in range(count))
    return merge_meshes(*copies)


def _scaffold_level(xs: list[float]) -> Mesh:
    """Returns one platform of a scaffold: boards, a guard rail and braces.

    The meshes are in wall coordinates; `xs` contains the places of the uprights
    [m].
    """
    along = (xs[0], xs[-1])
    top = _SCAFFOLD_LIFT_M
    pieces = [solids.box(x=along, y=(0.55, 1.5), z=(top - 0.12, top - 0.05))]
    for z in _RAILS_M:
        pieces.append(solids.box(x=along, y=(1.5, 1.54), z=(z, z + 0.06)))
    for start, end in itertools.pairwise(xs[::3]):
        brace = solids.beam(
            (start, 1.54, 0.05), (end, 1.54, top - 0.15), width=0.07
        )
        pieces.append(brace)
    return merge_meshes(*pieces)
