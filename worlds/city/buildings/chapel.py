"""The chapel."""

from typing import NamedTuple

import numpy as np

from worlds.city.facades import (
    Band,
    Building,
    Openings,
    Roof,
    Wing,
    around,
    bays,
    foot_band,
    free_stretches,
    solids,
    top_band,
    wing_roofs,
)
from worlds.shapes import Mesh, outlines

# Free strip around the walls, for eaves and buttresses [m].
_MARGIN_M = 0.45
# Depth of the windows behind the wall [m].
_RECESS_M = 0.22
# Vertical thickness of the roof of the nave [m].
_ROOF_M = 0.2
# Vertical thickness of the roofs of porch and vestry [m].
_LOW_ROOF_M = 0.15
# Least height of a chapel with a tower [m].
_LEAST_TOWER_M = 13.0
# The tower's side depends on the width of the site up to this width [m].
_MOST_WIDTH_M = 18.0
# Greatest width of the nave [m].
_MOST_NAVE_M = 11.0
# Greatest length of the nave, as a multiple of its width.
_NAVE_LENGTH = 2.6
# Greatest height of the nave's walls [m].
_MOST_WALL_M = 7.5
# Depth of the ground in front of a nave without a tower in front [m].
_FORECOURT_M = 2.4
# How far a tower stands out in front of the nave, as a share of its side.
_TOWER_AHEAD = 0.6
# Height of the shaft of a tower, as a share of the chapel's height.
_SHAFT_SHARE = 0.62
# Height of the cross on a spire [m].
_CROSS_M = 1.3
# Half the width of a buttress [m].
_BUTTRESS_HALF_M = 0.22
# How far a buttress stands out of the wall [m].
_BUTTRESS_REACH_M = 0.42
# Least width of a vestry [m].
_LEAST_VESTRY_M = 1.5
# Greatest width of a vestry [m].
_MOST_VESTRY_M = 3.2


class _Wings(NamedTuple):
    """The wings of a chapel; `None` for a wing that it lacks."""

    nave: Wing
    tower: Wing | None
    porch: Wing | None
    vestry: Wing | None

    @property
    def present(self) -> list[Wing]:
        """All wings that the chapel has, the nave first."""
        return [wing for wing in self if wing is not None]


class Chapel(Building):
    """The chapel: a nave with a steep roof, a tower or bell cote, a porch."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        wide = min(site.width, site.depth, _MOST_WIDTH_M)
        # `front` (a tower in the middle of the front), `side` (a tower beside
        # the nave) or `cote` (a bell gable on the roof).
        self.belfry = "cote"
        if self.height >= _LEAST_TOWER_M:
            self.belfry = self.pick(("front", "side", "front"))
        self.spire = self.pick(("needle", "broach", "cap"))
        # Length of a side of the tower.
        self.tower = round(self.uniform(0.24, 0.3) * wide + 0.6, 2)
        # Width of the nave, as a share of the width of the site.
        self.nave = self.uniform(0.62, 0.72)
        self.pitch_deg = self.uniform(44.0, 54.0)
        # Distance between the side windows.
        self.bay = self.uniform(2.8, 3.8)
        self.buttresses = self.chance(0.5)
        # Whether the door has a porch, with a cote or a side tower.
        self.porch = self.chance(0.7)
        # Whether a vestry stands beside the choir.
        self.annex = self.chance(0.6)
        self.mirrored = self.chance(0.5)

    def build(self) -> None:
        """Adds all parts of the chapel, parallel to the site's longer sides.

        The door is at the front of the site. If the site is wider than it is
        deep, the door is on the left, as seen from the front. The site must be
        a rectangle.
        """
        x0, y0, x1, y1 = self.site.bounds
        if y1 - y0 >= x1 - x0:
            _add_parts(self, x1 - x0, y1 - y0)
            self.turn((x0, y0, 0.0), 0.0)
        else:
            # The chapel is built along y, then turned by a quarter to the
            # right.
            _add_parts(self, y1 - y0, x1 - x0)
            self.turn((x0, y1, 0.0), -np.pi / 2)


def _add_parts(chapel: Chapel, width: float, length: float) -> None:
    """Adds the chapel on 0..width by 0..length, with its door at y = 0."""
    nave = _nave(chapel, width, length)
    has_porch = chapel.porch and chapel.belfry != "front" and nave.y0 > 2.2
    wings = _Wings(
        nave,
        tower=_tower(chapel, nave) if chapel.belfry != "cote" else None,
        porch=_porch(nave) if has_porch else None,
        vestry=_vestry(nave, width) if chapel.annex else None,
    )
    _add_nave(chapel, wings)
    if chapel.buttresses:
        _add_buttresses(chapel, wings)
    if wings.tower is not None:
        _add_tower(chapel, wings.tower, wings)
    else:
        _add_cote(chapel, nave)
    if wings.porch is not None:
        _add_porch(chapel, wings.porch, wings)
    if wings.vestry is not None:
        _add_vestry(chapel, wings.vestry, wings)


def _nave(chapel: Chapel, width: float, length: float) -> Wing:
    """Returns the nave of a chapel on a site of a width and a length [m]."""
    wide = min(chapel.nave * width, _MOST_NAVE_M)
    x = (width - wide) / 2
    if chapel.belfry == "side":
        wide = min(wide, width - chapel.tower - 2 * _MARGIN_M - 0.1)
        x = _MARGIN_M if chapel.mirrored else width - _MARGIN_M - wide
    ahead = _FORECOURT_M
    if chapel.belfry == "front":
        ahead = _TOWER_AHEAD * chapel.tower + _MARGIN_M
    rise = min(
        wing_roofs.ridge_rise(wide, chapel.pitch_deg), 0.42 * chapel.height
    )
    share = 0.8 if chapel.belfry == "cote" else 0.62
    top = min(share * chapel.height, rise + _MOST_WALL_M)
    wall_top = max(top - rise - _ROOF_M, 0.35 * top)
    roof = Roof(
        "gable", along_y=True, eaves=0.35, verge=0.25, thickness=_ROOF_M
    )
    front = min(ahead, 0.3 * length)
    back = min(length - _MARGIN_M, ahead + _NAVE_LENGTH * wide)
    return Wing.at(
        (x, front, x + wide, back), wall_top=wall_top, top=top, roof=roof
    )


def _tower(chapel: Chapel, nave: Wing) -> Wing:
    """Returns the shaft of the tower, up to the foot of the spire."""
    side = chapel.tower
    top = max(
        _SHAFT_SHARE * chapel.height,
        nave.top - 0.3 * (nave.top - nave.wall_top),
    )
    y0 = nave.y0 - _TOWER_AHEAD * side
    x0 = nave.center[0] - side / 2
    if chapel.belfry == "side":
        x0 = nave.x1 - 0.1 if chapel.mirrored else nave.x0 + 0.1 - side
        y0 = nave.y0 + 0.8
    return Wing.at(
        (x0, y0, x0 + side, y0 + side), wall_top=top, top=top, roof=Roof("flat")
    )


def _add_nave(chapel: Chapel, wings: _Wings) -> None:
    """Adds the nave with its side windows, and a door if there is no tower.

    The door is in front of the nave unless a tower stands there.
    """
    nave = wings.nave
    openings = Openings(chapel, nave, wings.present)
    eaves = nave.wall_top
    lancet = bays.arched(
        width=1.0,
        bottom=1.2,
        spring=max(1.6, eaves - 1.5),
        depth=_RECESS_M,
        rise=0.7,
    )
    openings.add_bays(
        (1, 3), z=1.5, pitch=chapel.bay, choices=[lancet], margin=1.0
    )
    if chapel.belfry != "front":
        _add_nave_door(openings, wings)
    sill = eaves + 0.2 * (nave.top - eaves)
    rose = wing_roofs.attic_window(
        width=1.3, z0=sill, z1=sill + 1.6, depth=_RECESS_M
    )
    plinth = foot_band(height=0.45, reach=0.08)
    openings.enclose((_RECESS_M,), bands=(plinth,), attic=rose)


def _add_nave_door(openings: Openings, wings: _Wings) -> None:
    """Adds a door in the middle of the nave's front.

    The door is round-headed if the walls are high enough and there is neither
    porch nor vestry. Otherwise it is square, or behind the porch.
    """
    nave = wings.nave
    has_low_wings = wings.porch is not None or wings.vestry is not None
    if nave.wall_top > 3.1 and not has_low_wings:
        door = bays.arched(
            width=1.6, bottom=0.0, spring=2.0, depth=0.5, rise=0.8
        )
    elif wings.porch is None:
        door = bays.entrance(width=1.4, height=2.1, depth=0.4)
    else:
        return
    openings.replace_by_bay(0, x=nave.width / 2, width=2.2, bay=door)


def _add_buttresses(chapel: Chapel, wings: _Wings) -> None:
    """Adds buttresses between the windows of the nave's sides."""
    nave = wings.nave
    for edge in (1, 3):
        wall = nave.wall(edge)
        for start, end in free_stretches(nave, edge, wings.present, z=0.5):
            spots = bays.stretches(end - start, pitch=chapel.bay, margin=1.0)
            for offset, _ in spots[1:]:
                pieces = _buttress(start + offset, 0.75 * nave.wall_top)
                chapel.add_to("walls", *(wall.place(m) for m in pieces))


def _buttress(x: float, top: float) -> list[Mesh]:
    """Returns a buttress and its sloped cap, in wall coordinates.

    `x` is its middle along the wall, and `top` the height of the cap's foot
    [m].
    """
    left, right = around(x, _BUTTRESS_HALF_M)
    plan = outlines.rectangle(left, -0.05, right, _BUTTRESS_REACH_M)
    head = outlines.rectangle(left, -0.05, right, 0.05)
    body = solids.skirt(plan, plan, z0=-solids.FOUNDATION_M, z1=top)
    cap = solids.frustum(plan, head, z0=top, z1=top + 0.5)
    return [body, cap]


def _add_tower(chapel: Chapel, tower: Wing, wings: _Wings) -> None:
    """Adds the shaft, its bell chamber and the spire with a cross."""
    openings = Openings(chapel, tower, wings.present)
    side, top = tower.width, tower.wall_top
    width = round(min(1.2, 0.4 * side), 2)
    louvre = bays.arched(
        width=width, bottom=top - 2.6, spring=top - 1.3, depth=_RECESS_M
    )
    slit = bays.window(
        width=0.5, sill=0.5 * top, head=0.5 * top + 1.2, depth=_RECESS_M
    )
    # The outer wall of a side tower has no slit.
    outer_edge = 1 if chapel.mirrored else 3
    for edge in range(4):
        openings.replace_by_bay(edge, x=side / 2, width=width + 0.7, bay=louvre)
        if chapel.belfry != "side" or edge != outer_edge:
            openings.replace_by_bay(edge, x=side / 2, width=1.0, bay=slit)
    if chapel.belfry == "front":
        width = round(min(1.7, side - 1.1), 2)
        door = bays.arched(width=width, bottom=0.0, spring=2.1, depth=0.45)
        openings.replace_by_bay(0, x=side / 2, width=width + 0.6, bay=door)
    bands = (
        foot_band(height=0.45, reach=0.1),
        Band(z0=top - 3.1, z1=top - 2.9, depth=-0.08),
        top_band(top, height=0.3, reach=0.18),
    )
    openings.add_walls((_RECESS_M,), bands)
    chapel.add_to("roof", *_spire(chapel, tower))
    cross_foot = chapel.height - _CROSS_M
    chapel.add_to("trim", *_cross(*tower.center, cross_foot, chapel.height))


def _spire(chapel: Chapel, tower: Wing) -> list[Mesh]:
    """Returns the spire on a tower, with its eaves."""
    z = tower.wall_top
    tip = chapel.height - 1.0
    center = tower.center
    eaves = outlines.inset(tower.outline, -0.3)
    pieces = [
        solids.flat(eaves, z - 0.02, up=False),
        solids.skirt(eaves, eaves, z0=z - 0.02, z1=z + 0.2),
    ]
    if chapel.spire == "cap":
        knee = z + 0.45 * (tip - z)
        waist = outlines.inset(tower.outline, 0.32 * tower.width)
        pieces += [
            solids.skirt(eaves, waist, z0=z + 0.2, z1=knee),
            solids.spire(waist, center, z0=knee, z1=tip),
        ]
    elif chapel.spire == "broach":
        # A low octagonal pyramid on the square tower, with a needle through it.
        ring = outlines.regular_polygon(
            radius=0.5 * tower.width, count=8, center=center, phase=np.pi / 8
        )
        pieces += [
            solids.spire(eaves, center, z0=z + 0.2, z1=z + 0.45 * (tip - z)),
            solids.spire(ring, center, z0=z + 0.1, z1=tip),
        ]
    else:
        pieces.append(solids.spire(eaves, center, z0=z + 0.2, z1=tip))
    return pieces


def _add_cote(chapel: Chapel, nave: Wing) -> None:
    """Adds a small open belfry on the ridge at the front."""
    x, y = nave.center[0], nave.y0 + 1.1
    low, high = nave.top - 0.9, chapel.height - 1.6
    if high - nave.top < 0.9:
        # There is no room for a belfry.
        cross = _cross(x, nave.y0, nave.top - 0.3, chapel.height)
        chapel.add_to("trim", *cross)
        return
    base = solids.post(x, y, half=0.7, z1=nave.top + 0.3, z0=low)
    chapel.add_to("walls", base)
    posts = (
        solids.post(x_post, y_post, half=0.1, z1=high, z0=nave.top + 0.2)
        for x_post in around(x, 0.55)
        for y_post in around(y, 0.55)
    )
    cross = _cross(x, y, chapel.height - 1.0, chapel.height)
    chapel.add_to("trim", *posts, *_bell(x, y, high), *cross)
    eaves = outlines.square(x, y, half=0.95)
    roof = solids.tent(eaves, (x, y), z0=high - 0.02, z1=chapel.height - 0.8)
    chapel.add_to("roof", roof)


def _bell(x: float, y: float, z: float) -> list[Mesh]:
    """Returns a bell below the height `z`, at a place (x, y) [m]."""
    radius, rim = 0.34, z - 0.75
    profile = [(radius, rim), (0.24, z - 0.45), (0.12, z - 0.2)]
    mouth = outlines.regular_polygon(radius=radius, count=8, center=(x, y))
    return [
        solids.revolved(profile, 8, center=(x, y)),
        solids.flat(mouth, rim, up=False),
    ]


def _add_porch(chapel: Chapel, porch: Wing, wings: _Wings) -> None:
    """Adds the porch, which is open to the front."""
    openings = Openings(chapel, porch, wings.present)
    opening = bays.window(
        width=1.5, sill=0.0, head=porch.wall_top - 0.3, depth=0.9
    )
    openings.replace_by_bay(0, x=porch.width / 2, width=2.2, bay=opening)
    openings.enclose((_RECESS_M,))


def _add_vestry(chapel: Chapel, vestry: Wing, wings: _Wings) -> None:
    """Adds the vestry, with windows on all sides."""
    openings = Openings(chapel, vestry, wings.present)
    head = round(min(2.0, vestry.wall_top - 0.3), 2)
    window = bays.window(width=0.8, sill=1.0, head=head, depth=_RECESS_M)
    openings.add_bays(range(4), z=1.2, pitch=2.2, choices=[window])
    openings.enclose((_RECESS_M,))


def _porch(nave: Wing) -> Wing:
    """Returns the porch in front of the nave's door."""
    x0, x1 = around(nave.center[0], 1.3)
    roof = Roof(
        "gable", along_y=True, eaves=0.25, verge=0.25, thickness=_LOW_ROOF_M
    )
    area = (x0, nave.y0 - 1.7, x1, nave.y0 + 0.1)
    top = min(4.2, nave.wall_top + 0.8)
    return Wing.at(
        area, wall_top=min(2.6, nave.wall_top - 0.2), top=top, roof=roof
    )


def _vestry(nave: Wing, width: float) -> Wing | None:
    """Returns a vestry beside the choir, or None if there is no room for it."""
    room_left = nave.x0 - _MARGIN_M
    room_right = width - _MARGIN_M - nave.x1
    on_left = room_left > room_right
    room = room_left if on_left else room_right
    if room < _LEAST_VESTRY_M:
        return None
    reach = min(room, _MOST_VESTRY_M)
    high = min(nave.wall_top - 0.2, 3.6)
    low = max(high - 0.45 * reach, 1.9)
    y0 = nave.y1 - 4.2
    x0, x1 = nave.x1 - 0.05, nave.x1 + reach
    if on_left:
        x0, x1 = nave.x0 - reach, nave.x0 + 0.05
    roof = Roof(
        "shed",
        along_y=True,
        eaves=0.25,
        verge=0.2,
        thickness=_LOW_ROOF_M,
        falling=not on_left,
    )
    if high - low < 0.3 or y0 < nave.y0 + 1.0:
        return None
    area = (x0, y0, x1, nave.y1 - 0.4)
    return Wing.at(area, wall_top=low, top=high, roof=roof)


def _cross(x: float, y: float, z0: float, z1: float) -> list[Mesh]:
    """Returns a cross that faces the front.

    Args:
        x: x of the cross's middle [m].
        y: y of the cross's middle [m].
        z0: height of the foot [m].
        z1: height of the top [m].
    """
    arm = z1 - 0.4
    y_range = (y - 0.06, y + 0.06)
    return [
        solids.box(x=around(x, 0.06), y=y_range, z=(z0, z1)),
        solids.box(x=around(x, 0.35), y=y_range, z=(arm, arm + 0.12)),
    ]
