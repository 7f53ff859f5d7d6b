"""The court block: flats around a court."""

from typing import NamedTuple

import numpy as np

from worlds.city.facades import (
    Band,
    Building,
    Facade,
    WallFrame,
    around,
    bays,
    foot_band,
    solids,
    tiers,
    top_band,
)
from worlds.shapes import Mesh, MeshShape, merge_meshes, outlines

# Least width of a site for a U around the court; others have an L [m].
_U_WIDTH_M = 30.0
# Length of all walls, as a multiple of the length of the site's edges.
_WALLS_SHARE = 1.3
# Greatest number of windows around the whole block.
_MOST_BAYS = 52
# Greatest number of dormers around the whole block.
_MOST_DORMERS = 26
# Distance of the outermost windows from a corner [m].
_END_M = 0.8
# Depth of windows and shops of the ground floor [m].
_GROUND_RECESS_M = 0.3
# Half the width of an oriel's front [m].
_ORIEL_HALF_M = 0.75
# How much wider an oriel is at the wall than in front, on each side [m].
_ORIEL_SLANT_M = 0.5
# Greatest number of oriels.
_MOST_ORIELS = 5
# Overhang of the roof [m].
_EAVES_M = 0.5
# Height of the upper, flatter part of the mansard roof [m].
_UPPER_ROOF_M = 0.9
# Half the width of a dormer's front [m].
_DORMER_HALF_M = 0.7


class CourtBlock(Building):
    """The court block: wings around a court, a mansard roof with dormers."""

    def draw(self) -> None:
        site = self.site
        range_depth = self.uniform(10.0, 12.5)
        # Approximate length of all walls.
        run = _WALLS_SHARE * site.open_length
        has_room = site.width > _U_WIDTH_M
        self.shape = "U" if has_room and self.chance(0.7) else "L"
        self.mirrored = self.chance(0.5)
        self.wing = round(min(range_depth, 0.34 * site.width), 1)
        self.back = round(min(range_depth + 0.8, 0.5 * site.depth), 1)
        self.ground_height = self.uniform(3.8, 4.4, digits=2)
        self.storey_height = self.uniform(3.0, 3.4)
        self.pitch = max(self.uniform(2.4, 3.2), run / _MOST_BAYS)
        self.window_width = self.uniform(0.95, 1.25, digits=2)
        self.recess = self.uniform(0.15, 0.28, digits=2)
        self.oriel_every = self.whole(2, 5)
        self.oriel_reach = self.uniform(0.7, 1.0, digits=2)
        self.mansard_height = self.uniform(3.6, 4.8, digits=1)
        self.mansard_inset = self.uniform(1.6, 2.2, digits=2)
        self.dormer_pitch = max(self.uniform(4.5, 6.5), run / _MOST_DORMERS)
        self.chimneys = self.whole(3, 7)
        self.gate_height = self.uniform(3.2, 3.6, digits=2)

    def build(self) -> None:
        form = outlines.u_shape if self.shape == "U" else outlines.l_shape
        plan = form(*self.site.bounds, self.wing, self.back)
        if self.mirrored:
            plan = outlines.mirrored(plan)
        bottom = _add_ground(self, plan)
        eaves = self.height - self.mansard_height
        storeys = tiers.storey_groups(eaves - bottom, storey=self.storey_height)
        top = tiers.add_storeys(
            self,
            plan,
            _storey_walls(self, storeys.storey),
            z0=bottom,
            groups=storeys.groups,
            per_group=storeys.per_group,
        )
        _add_oriels(self, plan, bottom, storeys.num_storeys, storeys.storey)
        roof = [
            *_mansard(self, plan, top),
            *_dormers(self, plan, top),
            *_chimneys(self, plan),
        ]
        self.add("mansard", *roof, finish=self.colours["roof"])


def _storey_walls(block: CourtBlock, storey: float) -> Facade:
    """Returns the walls of a storey; windows in front have a ledge.

    `storey` is the height of the storey [m].
    """
    layout, front = (
        bays.rhythm(
            block.pitch,
            [
                bays.window(
                    width=block.window_width,
                    sill=0.8,
                    head=storey - 0.55,
                    depth=block.recess,
                    ledge=ledge,
                )
            ],
            margin=_END_M,
        )
        for ledge in (0.0, 0.1)
    )
    return Facade(
        storey,
        bands=(top_band(storey, height=0.15, reach=0.07),),
        layout=bays.by_edge({0: front}, layout),
        glass=(block.recess,),
    )


def _add_ground(block: CourtBlock, plan: np.ndarray) -> float:
    """Adds the ground floor; returns the height of its top [m].

    The front has shops, and a gate to the court.
    """
    height = block.ground_height
    head = height - 0.9
    shops = bays.rhythm(
        1.7 * block.pitch,
        [bays.shop_front(head=head, depth=_GROUND_RECESS_M)],
        margin=0.7,
    )
    gate = bays.gate(width=3.2, height=block.gate_height, depth=2.4)
    front = bays.with_middle(shops, gate, width=5.0)
    window = bays.window(
        width=block.window_width, sill=1.2, head=head, depth=_GROUND_RECESS_M
    )
    flats = bays.rhythm(1.6 * block.pitch, [window], margin=_END_M)
    walls = Facade(
        height,
        bands=(
            foot_band(height=0.5, reach=0.08),
            top_band(height, height=0.4, reach=0.16),
        ),
        layout=bays.by_edge({0: front}, flats),
        glass=(_GROUND_RECESS_M,),
    )
    return tiers.add_ground(block, plan, walls)


def _add_oriels(
    block: CourtBlock, plan: np.ndarray, z0: float, count: int, storey: float
) -> None:
    """Adds bay windows to the street front, from the first floor upwards.

    Args:
        plan: (N, 2) corners of the walls [m].
        z0: height of the feet of the bay windows [m].
        storey: height of a storey [m].
    """
    half, reach = _ORIEL_HALF_M, block.oriel_reach
    outline = [
        (-half - _ORIEL_SLANT_M, 0.0),
        (-half, -reach),
        (half, -reach),
        (half + _ORIEL_SLANT_M, 0.0),
    ]
    floor = Facade(storey, bands=(Band(z0=0.9, z1=storey - 0.5, depth=0.14),))
    height = count * storey
    oriel = merge_meshes(
        tiers.lidded_walls(outline, floor.stacked(count), 0.0),
        solids.flat(outline, 0.0, up=False),
        solids.spire(outline, (0.0, 0.0), z0=height, z1=height + 0.6),
    )
    shape = MeshShape(block.define("oriel", oriel))
    wall = WallFrame(plan, 0)
    cells = bays.stretches(wall.length, pitch=block.pitch, margin=_END_M)
    inner = cells[1:-1]
    step = max(block.oriel_every, len(inner) // _MOST_ORIELS)
    for k, (start, end) in enumerate(inner[::step]):
        x, y = wall.point((start + end) / 2, 0.0)
        block.place(f"oriel_{k}", shape, (x, y, z0), yaw=wall.heading)


class _RoofHeights(NamedTuple):
    """Heights of a mansard roof [m].

    Attributes:
        fascia_top: top of the fascia along the eaves.
        knee: where the steep lower slope ends and the upper one begins.
    """

    fascia_top: float
    knee: float


def _roof_heights(block: CourtBlock, z0: float) -> _RoofHeights:
    """Returns the heights of the roof; `z0` is the top of the walls [m]."""
    return _RoofHeights(z0 + 0.3, block.height - _UPPER_ROOF_M)


def _mansard(block: CourtBlock, plan: np.ndarray, z0: float) -> list[Mesh]:
    """Returns the slopes and the eaves of the mansard roof.

    `plan` contains the corners (N, 2) of the walls, and `z0` is the height of
    their tops [m].
    """
    eaves = outlines.inset(plan, -_EAVES_M)
    knee = outlines.inset(plan, block.mansard_inset - 0.6)
    run = min(1.6, block.wing / 2 - block.mansard_inset - 0.4)
    ridge = outlines.inset(plan, block.mansard_inset + run)
    z1, z2 = _roof_heights(block, z0)
    top = block.height
    return [
        solids.skirt(eaves, eaves, z0=z0, z1=z1),
        solids.flat(eaves, z0, up=False),
        solids.skirt(eaves, outlines.inset(plan, 0.0), z0=z1, z1=z1),
        solids.skirt(plan, knee, z0=z1, z1=z2),
        solids.skirt(knee, ridge, z0=z2, z1=top),
        solids.flat(ridge, top),
    ]


def _dormers(block: CourtBlock, plan: np.ndarray, z0: float) -> list[Mesh]:
    """Returns dormers in the lower slope of the roof, along all walls."""
    heights = _roof_heights(block, z0)
    pieces = []
    for edge in range(len(plan)):
        wall = WallFrame(plan, edge)
        cells = bays.stretches(
            wall.length, pitch=block.dormer_pitch, margin=2.5
        )
        for start, end in cells:
            middle = round((start + end) / 2, 2)
            pieces.append(wall.place(_dormer(block, middle, heights)))
    return pieces


def _chimneys(block: CourtBlock, plan: np.ndarray) -> list[Mesh]:
    """Returns chimneys in a row behind the front."""
    pieces = []
    (x0, y0), (x1, y1) = plan[0], plan[1]
    for k in range(block.chimneys):
        x = x0 + (k + 0.5) / block.chimneys * (x1 - x0)
        y = (y0 + y1) / 2 + block.mansard_inset + 2.4 + block.uniform(0.0, 1.5)
        chimney = solids.box(
            x=around(x, 0.6),
            y=around(y, 0.35),
            z=(block.height - _UPPER_ROOF_M, block.height),
            bottom=False,
        )
        pieces.append(chimney)
    return pieces


def _dormer(block: CourtBlock, x: float, heights: _RoofHeights) -> Mesh:
    """Returns a dormer whose back is in the roof, in wall coordinates.

    `x` is the middle of the dormer along the wall [m].
    """
    foot = heights.fascia_top
    low, high = foot + 0.4, min(foot + 2.4, heights.knee - 0.2)
    deep = block.mansard_inset
    left, right = around(x, _DORMER_HALF_M)
    body = [(left, -deep), (right, -deep), (right, -0.1), (left, -0.1)]
    walls = solids.skirt(body, body, z0=low, z1=high)
    lid = solids.box(x=around(x, 0.9), y=(-deep, 0.15), z=(high, high + 0.2))
    # Left out: the back wall, which is inside the roof. The sill stands in
    # front of the window.
    front = Mesh(walls.vertices, walls.faces[1:])
    sill = solids.box(
        x=around(x, 0.8), y=(-0.6, 0.05), z=(low - 0.15, low + 0.1)
    )
    return merge_meshes(front, lid, sill)
