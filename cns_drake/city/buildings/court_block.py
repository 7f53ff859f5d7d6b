"""The court block: flats around a court."""

import numpy as np

from cns_drake.city.facades import (
    Band,
    Building,
    Facade,
    WallFrame,
    around,
    bays,
    outlines,
    solids,
    tiers,
)
from cns_drake.city.geometry import Mesh, MeshShape, merge_meshes


class CourtBlock(Building):
    """The court block: wings around a court, a mansard roof with dormers."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        range_depth = self.uniform(10.0, 12.5)
        run = 1.3 * site.open_length
        self.shape = "U" if site.width > 30.0 and self.chance(0.7) else "L"
        self.mirrored = self.chance(0.5)
        self.wing = round(min(range_depth, 0.34 * site.width), 1)
        self.back = round(min(range_depth + 0.8, 0.5 * site.depth), 1)
        self.ground_height = self.uniform(3.8, 4.4, digits=2)
        self.storey_height = self.uniform(3.0, 3.4)
        self.pitch = max(self.uniform(2.4, 3.2), run / 52)
        self.window_width = self.uniform(0.95, 1.25, digits=2)
        self.recess = self.uniform(0.15, 0.28, digits=2)
        self.oriel_every = self.whole(2, 5)
        self.oriel_reach = self.uniform(0.7, 1.0, digits=2)
        self.mansard_height = self.uniform(3.6, 4.8, digits=1)
        self.mansard_inset = self.uniform(1.6, 2.2, digits=2)
        self.dormer_pitch = max(self.uniform(4.5, 6.5), run / 26)
        self.chimneys = self.whole(3, 7)
        self.gate_height = self.uniform(3.2, 3.6, digits=2)

    def build(self) -> None:
        """Adds all parts of the court block, whose court is open to the back.

        The building's site must be a rectangle.
        """
        form = outlines.u_shape if self.shape == "U" else outlines.l_shape
        plan = form(*self.site.bounds, self.wing, self.back)
        if self.mirrored:
            plan = outlines.mirrored(plan)
        bottom = _add_ground(self, plan)
        eaves = self.height - self.mansard_height
        groups, per_group, storey = tiers.storey_groups(
            eaves - bottom, storey=self.storey_height
        )
        size = (self.window_width, 0.8, storey - 0.55, self.recess)
        windows = bays.rhythm(self.pitch, [bays.window(*size)], margin=0.8)
        framed = bays.rhythm(
            self.pitch, [bays.window(*size, ledge=0.1)], margin=0.8
        )
        band = Band(z0=storey - 0.15, z1=storey, depth=-0.07)
        layout = {0: framed}
        walls = Facade(
            storey,
            bands=(band,),
            layout=bays.by_edge(layout, windows),
            glass=(self.recess,),
        )
        top = tiers.add_storeys(
            self, plan, walls, z0=bottom, groups=groups, per_group=per_group
        )
        _add_oriels(self, plan, bottom, groups * per_group, storey)
        self.add(
            "mansard",
            *_mansard(self, plan, top, self.rng),
            finish=self.colours["roof"],
        )


def _add_ground(block: CourtBlock, plan: np.ndarray) -> float:
    h = block.ground_height
    shops = bays.rhythm(
        1.7 * block.pitch,
        [bays.shop_front(head=h - 0.9, depth=0.3)],
        margin=0.7,
    )
    window = bays.window(
        width=block.window_width, sill=1.2, head=h - 0.9, depth=0.3
    )
    flats = bays.rhythm(1.6 * block.pitch, [window], margin=0.8)
    front = bays.with_middle(
        shops,
        bays.gate(width=3.2, height=block.gate_height, depth=2.4),
        width=5.0,
    )
    layout = bays.by_edge({0: front}, flats)
    bands = (
        Band(z0=0.0, z1=0.5, depth=-0.08),
        Band(z0=h - 0.4, z1=h, depth=-0.16),
    )
    return tiers.add_ground(
        block, plan, Facade(h, bands=bands, layout=layout, glass=(0.3,))
    )


def _add_oriels(
    block: CourtBlock, plan: np.ndarray, z0: float, count: int, storey: float
) -> None:
    """Adds bay windows to the street front, from the first floor upwards."""
    half = 0.75
    r = block.oriel_reach
    outline = [(-half - 0.5, 0.0), (-half, -r), (half, -r), (half + 0.5, 0.0)]
    floor = Facade(storey, bands=(Band(z0=0.9, z1=storey - 0.5, depth=0.14),))
    height = count * storey
    oriel = merge_meshes(
        tiers.lidded_walls(outline, floor.stacked(count), 0.0),
        solids.flat(outline, 0.0, up=False),
        solids.spire(outline, (0.0, 0.0), z0=height, z1=height + 0.6),
    )
    shape = MeshShape(block.define("oriel", oriel))
    wall = WallFrame(plan, 0)
    cells = bays.stretches(wall.length, pitch=block.pitch, margin=0.8)[1:-1]
    step = max(block.oriel_every, len(cells) // 5)
    for k, (a, b) in enumerate(cells[::step]):
        x, y = wall.point((a + b) / 2, 0.0)
        block.place(f"oriel_{k}", shape, (x, y, z0), yaw=wall.heading)


def _mansard(
    block: CourtBlock, plan: np.ndarray, z0: float, rng: np.random.Generator
) -> list[Mesh]:
    eaves = outlines.inset(plan, -0.5)
    knee = outlines.inset(plan, block.mansard_inset - 0.6)
    slope = min(1.6, block.wing / 2 - block.mansard_inset - 0.4)
    ridge = outlines.inset(plan, block.mansard_inset + slope)
    z1 = z0 + 0.3
    z2, z3 = block.height - 0.9, block.height
    pieces = [
        solids.skirt(eaves, eaves, z0=z0, z1=z1),
        solids.flat(eaves, z0, up=False),
        solids.skirt(eaves, outlines.inset(plan, 0.0), z0=z1, z1=z1),
        solids.skirt(plan, knee, z0=z1, z1=z2),
        solids.skirt(knee, ridge, z0=z2, z1=z3),
        solids.flat(ridge, z3),
    ]
    for edge in range(len(plan)):
        wall = WallFrame(plan, edge)
        for a, b in bays.stretches(
            wall.length, pitch=block.dormer_pitch, margin=2.5
        ):
            dormer = _dormer(block, round((a + b) / 2, 2), z1, z2)
            pieces.append(wall.place(dormer))
    middle = (plan[0] + plan[1]) / 2
    for k in range(block.chimneys):
        x = plan[0, 0] + (k + 0.5) / block.chimneys * (plan[1, 0] - plan[0, 0])
        y = middle[1] + block.mansard_inset + 2.4 + float(rng.uniform(0.0, 1.5))
        pieces.append(
            solids.box(
                x=around(x, 0.6),
                y=around(y, 0.35),
                z=(z2, block.height),
                bottom=False,
            )
        )
    return pieces


def _dormer(block: CourtBlock, x: float, z0: float, z1: float) -> Mesh:
    """Returns a dormer whose back is in the roof, in wall coordinates."""
    low, high = z0 + 0.4, min(z0 + 2.4, z1 - 0.2)
    deep = block.mansard_inset
    body = [
        (x - 0.7, -deep),
        (x + 0.7, -deep),
        (x + 0.7, -0.1),
        (x - 0.7, -0.1),
    ]
    walls = solids.skirt(body, body, z0=low, z1=high)
    lid = solids.box(x=around(x, 0.9), y=(-deep, 0.15), z=(high, high + 0.2))
    # Left out: the back wall, which is inside the roof. The sill stands in
    # front of the window.
    front = Mesh(walls.vertices, walls.faces[1:])
    sill = solids.box(
        x=around(x, 0.8), y=(-0.6, 0.05), z=(low - 0.15, low + 0.1)
    )
    return merge_meshes(front, lid, sill)
