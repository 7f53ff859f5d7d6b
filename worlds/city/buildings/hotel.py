"""The hotel behind its forecourt."""

import numpy as np

from worlds.city.facades import (
    Band,
    Building,
    Facade,
    WallFrame,
    around,
    balconies,
    bays,
    foot_band,
    solids,
    tiers,
    top_band,
)
from worlds.shapes import Finish, Mesh, outlines

# Depth of the forecourt [m].
_FORECOURT_M = 7.0
# Greatest number of rooms beside one another in front.
_MOST_ROOMS = 11
# Greatest number of windows of the other walls.
_MOST_SIDE_BAYS = 34
# Greatest length of the chords of round ends [m].
_END_CHORD_M = 3.2
# Greatest length of the chords of round corners [m].
_CORNER_CHORD_M = 2.8
# Height of the walls above the rooms [m].
_RIM_M = 1.2
# Depth of the glass of the lobby [m].
_LOBBY_RECESS_M = 0.4
# Depth of the glass of the bar on the roof [m].
_BAR_RECESS_M = 0.3
# Half the width of the canopy over the drive [m].
_CANOPY_HALF_M = 6.0
# Height of the canopy's underside [m].
_CANOPY_M = 4.2
# Side of the square pillars of the canopy [m].
_PILLAR_M = 0.7
# Greatest number of parts of which the storeys of rooms consist.
_MOST_GROUPS = 15
# Distance of the outermost rooms from the ends of the front [m].
_END_M = 0.4
# Finish of the sign.
_SIGN = Finish((0.55, 0.16, 0.14))
# Equipment on the roof of the bar.
_ROOF_ITEMS = ("cooling_tower", "air_handler", "mast", "vents", "ac_unit")


class Hotel(Building):
    """The hotel: balconies along rounded walls, a forecourt, a roof-top bar."""

    def draw(self) -> None:
        site = self.site
        depth = site.depth - _FORECOURT_M
        self.pitch = max(self.uniform(3.6, 4.6), site.width / _MOST_ROOMS)
        self.ground_height = self.uniform(5.0, 6.2, digits=2)
        self.storey_height = self.uniform(3.1, 3.4)
        self.round_ends = self.chance(0.5) and site.width > 1.5 * depth
        self.corner = round(self.uniform(0.2, 0.35) * min(depth, site.width), 1)
        self.side_pitch = max(2.7, (site.width + 2 * depth) / _MOST_SIDE_BAYS)
        self.recess = self.uniform(0.2, 0.35, digits=2)
        self.balcony_reach = self.uniform(1.1, 1.45, digits=2)
        self.balcony_width = round(self.uniform(0.6, 0.95) * self.pitch, 2)
        self.rail = self.uniform(0.95, 1.1, digits=2)
        self.bar_height = self.uniform(4.0, 5.0, digits=1)
        self.bar_inset = self.uniform(1.8, 3.0, digits=1)
        self.sign_left = self.chance(0.5)

    def build(self) -> None:
        """Adds all parts of the hotel, which stands behind a forecourt."""
        x0, y0, x1, y1 = self.site.bounds
        front = y0 + _FORECOURT_M
        if self.round_ends:
            plan = outlines.stadium(x0, front, x1, y1, step=_END_CHORD_M)
        else:
            block = outlines.rectangle(x0, front, x1, y1)
            plan = outlines.rounded(
                block, {0: self.corner, 1: self.corner}, step=_CORNER_CHORD_M
            )
        top = _add_lobby(self, plan, y0)
        goal = self.height - self.bar_height - _RIM_M
        top = _add_rooms(self, plan, top, goal)
        rim = Facade(
            _RIM_M,
            bands=(
                foot_band(height=0.3, reach=0.15),
                Band(z0=0.9, z1=_RIM_M, depth=-0.2),
            ),
        )
        roof = tiers.add_crown(self, plan, rim, z0=top, parapet=1.1)
        _add_bar(self, plan, roof)
        _add_sign(self, plan)


def _add_bar(hotel: Hotel, plan: np.ndarray, z0: float) -> None:
    """Adds the glazed bar on the roof.

    `plan` contains the corners (N, 2) of the storeys' walls, and `z0` is the
    height of the roof [m].
    """
    height = round(hotel.height - z0, 3)
    walls = Facade(
        height,
        bands=(
            Band(z0=0.4, z1=height - 1.2, depth=_BAR_RECESS_M),
            Band(z0=height - 0.9, z1=height - 0.5, depth=-1.3),
        ),
        glass=(_BAR_RECESS_M,),
    )
    tiers.add_crown(
        hotel,
        outlines.inset(plan, hotel.bar_inset),
        walls,
        z0=z0,
        parapet=0.4,
        part="bar",
        items=_ROOF_ITEMS,
    )


def _add_lobby(hotel: Hotel, plan: np.ndarray, y0: float) -> float:
    """Adds the glazed ground floor and the drive; returns the floor's top [m].

    `plan` contains the corners (N, 2) of the walls, and `y0` is the least y of
    the site [m].
    """
    height = hotel.ground_height
    pane = bays.ribbon(
        sill=0.4, head=height - 1.2, depth=_LOBBY_RECESS_M, post=0.5
    )
    glazing = bays.rhythm(hotel.pitch, [pane], margin=0.5)
    door = bays.entrance(width=4.4, height=3.4, depth=1.5)
    lobby = Facade(
        height,
        bands=(
            foot_band(height=0.4, reach=0.1),
            Band(z0=height - 0.8, z1=height - 0.3, depth=-0.4),
        ),
        layout=bays.with_door(glazing, door, width=6.4),
        glass=(_LOBBY_RECESS_M,),
    )
    return tiers.add_ground(hotel, plan, lobby, extras=_drive(plan, y0))


def _drive(plan: np.ndarray, y0: float) -> list[Mesh]:
    """Returns the drive in the forecourt under a canopy on four pillars.

    `plan` contains the corners (N, 2) of the walls, and `y0` is the least y of
    the site [m].
    """
    middle = float(np.mean(plan[:2, 0]))
    front = float(plan[0, 1])
    left, right = around(middle, _CANOPY_HALF_M)
    canopy = solids.box(
        x=(left, right),
        y=(y0 + 0.3, front + 0.2),
        z=(_CANOPY_M, _CANOPY_M + 0.7),
    )
    pillars = [
        solids.standing(
            x=(x, x + _PILLAR_M), y=(y, y + _PILLAR_M), z1=_CANOPY_M
        )
        for x in (left + 0.6, right - 1.3)
        for y in (y0 + 0.8, front - 2.0)
    ]
    kerb = solids.standing(
        x=around(middle, 2.8), y=(front - 2.2, front), z1=0.14
    )
    return [canopy, *pillars, kerb]


def _add_rooms(hotel: Hotel, plan: np.ndarray, z0: float, goal: float) -> float:
    """Adds the storeys of rooms, with balconies in front.

    Returns the height of their top, which is about `goal` [m].
    """
    groups, per_group, storey = tiers.storey_groups(
        goal - z0, storey=hotel.storey_height, most=_MOST_GROUPS
    )
    head = round(storey - 0.45, 2)
    french_window = bays.window(
        width=hotel.pitch - 1.2,
        sill=0.0,
        head=head,
        depth=hotel.recess,
        mullions=1,
    )
    window = bays.window(width=1.5, sill=0.8, head=head, depth=hotel.recess)
    front = bays.rhythm(hotel.pitch, [french_window], margin=_END_M)
    others = bays.rhythm(hotel.side_pitch, [window], margin=0.35)
    walls = Facade(
        storey,
        bands=(top_band(storey, height=0.12, reach=0.08),),
        layout=bays.by_edge({0: front}, others),
        glass=(hotel.recess,),
    )
    return tiers.add_storeys(
        hotel,
        plan,
        walls,
        z0=z0,
        groups=groups,
        per_group=per_group,
        extras=_room_balconies(hotel, plan),
    )


def _room_balconies(hotel: Hotel, plan: np.ndarray) -> list[Mesh]:
    """Returns the balconies of a storey, one for each room in front."""
    front = WallFrame(plan, 0)
    half = hotel.balcony_width / 2
    rails = []
    for start, end in bays.stretches(
        front.length, pitch=hotel.pitch, margin=_END_M
    ):
        middle = (start + end) / 2
        rail = balconies.balcony(
            x0=round(middle - half, 2),
            x1=round(middle + half, 2),
            reach=hotel.balcony_reach,
            z=0.0,
            rail=hotel.rail,
        )
        rails.append(front.place(rail))
    return rails


def _add_sign(hotel: Hotel, plan: np.ndarray) -> None:
    """Adds an upright sign to the front, at one end of the balconies."""
    front = WallFrame(plan, 0)
    x = 0.4 if hotel.sign_left else front.length - 0.4
    low, high = hotel.ground_height + 3.0, 0.7 * hotel.height
    blade = front.box(x=around(x, 0.15), y=(0.25, 1.3), z=(low, high))
    arms = (
        front.box(x=around(x, 0.08), y=(0.0, 0.4), z=(z, z + 0.15))
        for z in (low + 0.5, high - 0.7)
    )
    hotel.add("sign", blade, *arms, finish=_SIGN)
