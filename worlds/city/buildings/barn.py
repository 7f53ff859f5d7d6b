"""The barn or boat house."""

import numpy as np

from worlds.city.facades import (
    Building,
    Openings,
    Roof,
    Wing,
    around,
    bays,
    boards,
    foot_band,
    free_stretches,
    solids,
    wing_roofs,
)
from worlds.city.facades.reliefs import Patch
from worlds.shapes import Mesh, outlines

# Free strip around the walls, for eaves [m].
_MARGIN_M = 0.5
# Depth of the windows behind the wall [m].
_RECESS_M = 0.15
# Least depth of a site with a jetty [m].
_JETTY_DEPTH_M = 10.0
# Least width of a barn with a lean-to, along its shorter side [m].
_LEAN_TO_WIDTH_M = 9.0
# Least width of a lean-to [m].
_LEAST_AISLE_M = 1.5
# Part of the ridge along which ventilators stand.
_VENTILATED_RIDGE = 0.8
# Height of a ventilator above the ridge [m].
_VENTILATOR_M = 0.7
# Half the side of a ventilator's square shaft [m].
_VENTILATOR_HALF_M = 0.45
# Width of the boards of a door's frame [m].
_FRAME_M = 0.18
# Height of the foot of a door [m].
_DOOR_FOOT_M = 0.08
# Half the width of a batten [m].
_BATTEN_HALF_M = 0.05


class Barn(Building):
    """The barn or boat house: timber boards, wide doors, a lean-to."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        width = min(site.width, site.depth)
        aisle = round(self.uniform(0.2, 0.28) * width, 2)
        self.roof = self.pick(("gambrel", "gable", "gable", "barrel"))
        # Height of the walls, as a share of the height of the ridge.
        self.wall = self.uniform(0.42, 0.58)
        # Depth of the jetty in front of a boat house; 0 for a barn.
        self.deck = 0.0
        if site.depth > _JETTY_DEPTH_M:
            self.deck = self.pick((0.0, 0.0, 2.0))
        self.door_width = self.uniform(2.6, 4.4, digits=2)
        self.door_height = self.uniform(2.4, 3.4, digits=2)
        # Width of the lean-to on one side; 0 for none.
        self.aisle = (
            aisle if self.chance(0.6) and width > _LEAN_TO_WIDTH_M else 0.0
        )
        self.aisle_left = self.chance(0.5)
        # Distance between battens.
        self.batten = self.uniform(1.0, 1.6)
        self.ventilators = self.whole(0, 3)

    def build(self) -> None:
        """Adds all parts of the barn, which lies along the site's longer sides.

        The building's site must be a rectangle.
        """
        x0, y0, x1, y1 = self.site.bounds
        along_y = y1 - y0 >= x1 - x0
        left, right = x0 + _MARGIN_M, x1 - _MARGIN_M
        front = y0 + _MARGIN_M + self.deck
        back = y1 - _MARGIN_M
        main = self._main_wing(along_y, (left, front, right, back))
        boxes = [main]
        if self.aisle > _LEAST_AISLE_M:
            boxes.append(_lean_to(self, main, left, right, back))
        for wing in boxes:
            _add_box(self, wing, boxes)
        _add_ventilators(self, main)
        if self.deck > 0:
            _add_jetty(self, (left, right), y0, front)

    def _main_wing(self, along_y: bool, area: outlines.Area) -> Wing:
        """Returns the main box of the barn, without the lean-to.

        Args:
            along_y: whether the ridge runs from the front to the back.
            area: ground of the main box and the lean-to together [m].
        """
        x0, y0, x1, y1 = area
        if not along_y:
            y1 -= self.aisle
        elif self.aisle_left:
            x0 += self.aisle
        else:
            x1 -= self.aisle
        top = self.height - (_VENTILATOR_M if self.ventilators else 0.0)
        half_span = ((x1 - x0) if along_y else (y1 - y0)) / 2
        wall_top = max(2.3, self.wall * top)
        eaves = 0.35
        if self.roof == "barrel":
            # A vault is at most half a circle.
            eaves = 0.0
            wall_top = max(wall_top, top - 0.8 * half_span)
        roof = Roof(
            self.roof, along_y=along_y, eaves=eaves, verge=0.35, thickness=0.18
        )
        return Wing.at((x0, y0, x1, y1), wall_top=wall_top, top=top, roof=roof)


def _add_box(barn: Barn, wing: Wing, boxes: list[Wing]) -> None:
    """Adds one box of the barn: the main box with doors, or the lean-to."""
    openings = Openings(barn, wing, boxes)
    head = round(min(2.0, wing.wall_top - 0.3), 2)
    window = bays.window(width=0.9, sill=1.1, head=head, depth=_RECESS_M)
    openings.add_bays(range(4), z=1.0, pitch=3.2, choices=[window], margin=0.8)
    if wing is boxes[0]:
        for edge in (0,) if wing.roof.along_y else (3, 0):
            _add_doors(barn, wing, openings, edge)
    low = wing.wall_top + 0.5
    attic = wing_roofs.attic_window(
        width=1.0, z0=low, z1=low + 1.3, depth=_RECESS_M
    )
    openings.enclose(
        (_RECESS_M,), bands=(foot_band(height=0.3, reach=0.06),), attic=attic
    )
    for edge in range(4):
        _add_battens(barn, wing, boxes, openings, edge)


def _lean_to(
    barn: Barn, main: Wing, left: float, right: float, back: float
) -> Wing:
    """Returns the lean-to against the long side of the barn.

    Args:
        barn: the barn.
        main: its main box.
        left: least x of the barn and the lean-to [m].
        right: greatest x of the barn and the lean-to [m].
        back: greatest y of the barn and the lean-to [m].
    """
    along_y = main.roof.along_y
    high = main.wall_top + 0.1
    low = max(1.9, high - 0.3 * barn.aisle)
    high = max(high, low + 0.25)
    # The lean-to stands behind or beside the barn: the side to which its roof
    # falls.
    area = (main.x0 + 1.0, main.y1 - 0.05, main.x1 - 1.0, back)
    if along_y:
        x0, x1 = main.x1 - 0.05, right
        if barn.aisle_left:
            x0, x1 = left, main.x0 + 0.05
        area = (x0, main.y0 + 0.8, x1, main.y1 - 0.8)
    falling = not (along_y and barn.aisle_left)
    roof = Roof(
        "shed",
        along_y=along_y,
        eaves=0.3,
        verge=0.25,
        thickness=0.15,
        falling=falling,
    )
    return Wing.at(area, wall_top=low, top=high, roof=roof)


def _add_doors(barn: Barn, wing: Wing, openings: Openings, edge: int) -> None:
    """Adds a pair of braced doors that slide along the wall."""
    wall = wing.wall(edge)
    width = min(barn.door_width, 0.5 * wall.length)
    height = min(barn.door_height, wing.wall_top - 0.35)
    x = wall.length / 2
    openings.clear(
        edge, x0=x - width - 0.2, x1=x + width + 0.2, z0=0.0, z1=height + 0.4
    )
    if barn.deck > 0 and edge == 0:
        gap = Patch(
            x0=x - width / 2, x1=x + width / 2, z0=0.0, z1=height, depth=2.0
        )
        openings.replace_by_bay(
            edge, x=x, width=width + 0.4, bay=lambda a, b: [gap]
        )
        # A boat house stands open: the leaves are pushed apart.
        starts = (x - width, x + width / 2 + 0.05)
        leaf_width = width / 2 - 0.05
    else:
        starts = (x - width / 2, x + 0.03)
        leaf_width = width / 2 - 0.03
    for x0 in starts:
        x1 = x0 + leaf_width
        leaf = boards.board(x0=x0, x1=x1, z0=_DOOR_FOOT_M, z1=height, reach=0.1)
        frame = _door_frame(x0, x1, height)
        barn.add_to("doors", wall.place(leaf))
        barn.add_to("trim", *(wall.place(piece) for piece in frame))
    barn.add_to(
        "trim",
        wall.box(
            x=(x - width - 0.1, x + width + 0.1),
            y=(0.0, 0.18),
            z=(height + 0.05, height + 0.18),
        ),
    )


def _door_frame(x0: float, x1: float, height: float) -> list[Mesh]:
    """Returns the boards on a door leaf: a frame and a brace across it.

    The meshes are in wall coordinates. The leaf extends from `x0` to `x1` along
    the wall, and up to `height` [m].
    """
    low = _DOOR_FOOT_M
    left = (x0, x0 + _FRAME_M, low, height)
    right = (x1 - _FRAME_M, x1, low, height)
    top = (x0, x1, height - _FRAME_M, height)
    bottom = (x0, x1, low, 0.26)
    frame = [
        boards.board(*limits, reach=0.15)
        for limits in (left, right, top, bottom)
    ]
    brace = solids.beam(
        (x0 + 0.1, 0.1, 0.2), (x1 - 0.1, 0.1, height - 0.1), width=0.1
    )
    return [*frame, brace]


def _add_battens(
    barn: Barn, wing: Wing, boxes: list[Wing], openings: Openings, edge: int
) -> None:
    """Adds upright battens on the free parts of a wall between openings."""
    wall = wing.wall(edge)
    reliefs = openings.layout(edge, wall.length)
    half = _BATTEN_HALF_M
    for start, end in free_stretches(wing, edge, boxes, z=0.5):
        spots = bays.stretches(end - start, pitch=barn.batten, margin=0.12)
        for offset, _ in spots:
            x = start + offset
            if any(r.x0 - 0.15 < x < r.x1 + 0.15 for r in reliefs):
                continue
            batten = boards.board(
                x0=x - half, x1=x + half, z0=0.3, z1=wing.wall_top, reach=0.05
            )
            barn.add_to("walls", wall.place(batten))


def _add_ventilators(barn: Barn, main: Wing) -> None:
    """Adds louvred ventilators on the ridge."""
    ridge = main.top
    for k in range(barn.ventilators):
        share = (k + 0.5) / barn.ventilators - 0.5
        x, y = main.center
        if main.roof.along_y:
            y += _VENTILATED_RIDGE * share * main.depth
        else:
            x += _VENTILATED_RIDGE * share * main.width
        eaves = ridge + 0.3
        shaft = solids.post(
            x, y, half=_VENTILATOR_HALF_M, z1=eaves, z0=ridge - 0.6
        )
        outline = outlines.square(x, y, half=0.65)
        lid = solids.tent(outline, (x, y), z0=eaves, z1=ridge + _VENTILATOR_M)
        barn.add_to("walls", shaft)
        barn.add_to("roof", lid)


def _add_jetty(barn: Barn, xs: bays.Span, y0: float, front: float) -> None:
    """Adds a plank deck on posts in front of a boat house."""
    left, right = xs
    y = y0 + 0.1
    barn.add_to("doors", solids.box(x=xs, y=(y, front), z=(0.05, 0.3)))
    for x in np.linspace(left + 0.2, right - 0.2, 4).tolist():
        post = solids.standing(
            x=around(x, 0.12), y=(y + 0.02, y + 0.26), z1=1.1
        )
        barn.add_to("doors", post)
