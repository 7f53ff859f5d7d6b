"""What houses for one or two families have in common."""

from collections.abc import Sequence

from worlds.city.buildings.house_heights import ROOF_M, STOREY_M
from worlds.city.facades import (
    Building,
    Openings,
    Roof,
    Wing,
    foot_band,
    wing_openings,
    wing_roofs,
)

# Distance between the windows of the sides [m]. The windows of the front are
# closer together.
_SIDE_PITCH_M = 3.8
# Width of the free strip around the walls, for eaves and chimneys [m].
MARGIN_M = 0.5
# Height of the walls of a garage [m].
_GARAGE_WALL_M = 2.65
# Greatest depth of a garage [m].
_GARAGE_DEPTH_M = 6.5
# Greatest width of the door of a garage [m].
_GARAGE_DOOR_M = 4.9
# Numbers of a wing's edges in front and behind.
_FRONT_AND_BACK = (0, 2)
# Numbers of a wing's edges at the sides.
_SIDES = (1, 3)


class FamilyHouse(Building):
    """The base class of family houses.

    Attributes:
        boxes: the wings, which hide parts of each other's walls.
        floor: height of the ground floor [m].
        window_pitch: distance between the windows of front and back [m].
        window_width: width of a window [m].
        casing: style of the frames around the windows in front.
    """

    boxes: Sequence[Wing]
    floor: float
    window_pitch: float
    window_width: float
    casing: str


def window_rows(house: FamilyHouse, wing: Wing, storeys: int) -> Openings:
    """Returns openings of a wing with the windows of all storeys."""
    openings = Openings(house, wing, house.boxes)
    pitches = (
        (_FRONT_AND_BACK, house.window_pitch),
        (_SIDES, _SIDE_PITCH_M),
    )
    wing_openings.add_window_storeys(
        openings,
        pitches,
        floor=house.floor,
        storey=STOREY_M,
        count=storeys,
        width=house.window_width,
    )
    return openings


def add_walls_and_roof(
    house: FamilyHouse, wing: Wing, openings: Openings
) -> None:
    """Adds the walls of a wing around its openings, and its roof.

    The windows of the front get casings, and each gable gets a window.
    """
    wing_openings.add_casings(openings, house.casing)
    bands = []
    if house.floor > 0:
        bands.append(foot_band(height=house.floor, reach=0.04))
    glass = wing_openings.GLASS_M
    sill = wing.wall_top + 0.4
    attic = wing_roofs.attic_window(
        width=0.9, z0=sill, z1=sill + 1.0, depth=glass
    )
    openings.enclose((glass,), bands=bands, attic=attic)


def garage_wing(
    kind: str, *, x0: float, x1: float, y0: float, y1: float, most: float
) -> Wing:
    """Returns a garage that is at most 6.5 m deep.

    Args:
        kind: kind of roof: `flat`, `gable`, `shed` or `hip`.
        x0: left end [m].
        x1: right end [m].
        y0: front [m].
        y1: back, unless the garage would be too deep [m].
        most: greatest height of the roof [m].
    """
    wall_top = _GARAGE_WALL_M
    span = x1 - x0
    rise = {
        "flat": 0.5,
        "gable": 0.3 * span,
        "shed": 0.2 * span,
        "hip": 0.25 * span,
    }[kind]
    roof = Roof(kind, along_y=True, eaves=0.3, verge=0.25, thickness=ROOF_M)
    top = min(wall_top + ROOF_M + rise, most)
    area = (x0, y0, x1, min(y1, y0 + _GARAGE_DEPTH_M))
    return Wing.at(area, wall_top=wall_top, top=top, roof=roof)


def add_garage(house: FamilyHouse, garage: Wing) -> None:
    """Adds a garage whose door is in front."""
    openings = Openings(house, garage, house.boxes)
    length = garage.x1 - garage.x0
    wing_openings.add_garage_door(
        openings, x=length / 2, width=min(length - 0.7, _GARAGE_DOOR_M)
    )
    window = wing_openings.sash(width=0.9, z=0.0, sill=1.1, head=2.0)
    openings.add_bays(_SIDES, z=1.0, pitch=3.4, choices=[window])
    openings.enclose((wing_openings.GLASS_M,))
