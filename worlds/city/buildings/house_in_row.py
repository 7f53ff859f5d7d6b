"""What houses that stand wall to wall in a row have in common."""

from collections.abc import Sequence
import math

from worlds.city.buildings.house_heights import ROOF_M
from worlds.city.facades import (
    Band,
    Building,
    Openings,
    Patch,
    Roof,
    WallFrame,
    Wing,
    around,
    bay_windows,
    boards,
    foot_band,
    porches,
    roofs,
    wing_openings,
    wing_roofs,
)
from worlds.shapes import Assembly, Mesh, add_chimney, outlines

# Party walls rise this far above a roof whose ridge follows the street [m].
_FIREWALL_M = 0.25
# Thickness of these party walls [m].
_FIREWALL_WIDTH_M = 0.3
# Height of the wall above the ceiling of the topmost storey [m].
_WALL_ABOVE_M = 0.25
# How far the steps of a gable rise above the ridge [m].
_STEPS_ABOVE_M = 0.4
# Height of a step of a gable, approximately [m].
_GABLE_STEP_M = 0.9
# Distance between the windows of a free side [m].
_SIDE_PITCH_M = 4.2
# Distance of the door from the end of the front [m].
_DOOR_END_M = 0.95
# Half the width of the landing in front of the door [m].
_LANDING_HALF_M = 0.65
# Strip beside the walls for the cornice of a flat roof [m].
_CORNICE_ROOM_M = 0.3
# Least width of a bay window [m].
_LEAST_BAY_M = 1.7
# Greatest width of a bay window [m].
_MOST_BAY_M = 2.6


class HouseInRow(Building):
    """The base class of houses that stand wall to wall.

    Attributes:
        stoop: room in front of the wall for steps [m].
        floor: height of the ground floor above the street [m].
    """

    stoop: float
    floor: float

    def draw_house(
        self,
        width: float,
        roofs: Sequence[str],
        casings: Sequence[str] = ("frame", "sill", "sill", "shutters"),
    ) -> None:
        """Samples sizes and style of a house.

        Args:
            width: width of the house [m].
            roofs: kinds of roof that the house can have. The roofs `gable` and
                `gambrel` have their ridge along the street, and `flat` has a
                cornice. The roofs `front` and `stepped` have a gable that faces
                the street; the gable of `stepped` has steps.
            casings: styles of the frames around the windows.
        """
        self.roof = self.pick(roofs)
        # Rise of the roof, as a share of half its span.
        self.rise = self.uniform(0.75, 1.15)
        self.storey = self.uniform(2.75, 3.1)
        self.plinth = self.pick((0.2, 0.5, 0.8, 1.0))
        self.door_left = self.chance(0.5)
        self.window_pitch = self.uniform(1.9, 2.5)
        self.window_width = self.uniform(0.9, 1.2, digits=2)
        self.casing = self.pick(casings)
        # `none`, `canted`, `box` (on the ground) or `oriel` (above it).
        self.bay = self.pick(("none", "canted", "box", "oriel"))
        self.bay_storeys = self.whole(1, 4)
        # Greatest number of dormers.
        self.dormers = self.whole(0, max(2, round(width / 2.2)))
        self.dormer = self.pick(("gable", "shed"))
        # Whether there is a hood above the door.
        self.canopy = self.chance(0.4)
        self.chimney = self.chance(0.75)
        self.brick = self.pick(self.kind.choices["bricks"])


def add_house(
    house: HouseInRow,
    area: outlines.Area,
    blind: frozenset[int],
    part: str = "",
    door_material: str = "accent",
) -> Wing:
    """Adds a house, and returns its wing.

    Ground in front of the house stays free for the stoop.

    Args:
        house: the building.
        area: ground of the house [m].
        blind: numbers of the edges towards neighbours.
        part: beginning of the names of parts that only this house has.
        door_material: material of the door.
    """
    wing, storeys = wing_and_storeys(house, area, blind)
    openings = Openings(house, wing)
    step = (wing.wall_top - _WALL_ABOVE_M - house.floor) / storeys
    sides = [k for k in (1, 3) if k not in blind]
    wing_openings.add_window_storeys(
        openings,
        [((0, 2), house.window_pitch), (sides, _SIDE_PITCH_M)],
        floor=house.floor,
        storey=step,
        count=storeys,
        width=house.window_width,
        head=min(2.2, step - 0.45),
    )
    door = _add_entrance(house, wing, openings, door_material)
    _add_bay(house, wing, openings, storeys, step, door)
    wing_openings.add_casings(openings, house.casing)
    first_floor = house.floor + step if storeys > 1 else None
    bands = _bands(house, wing, first_floor)
    openings.add_walls((wing_openings.GLASS_M,), bands)
    add_roof(house, wing)
    if house.chimney:
        add_roof_chimney(house, wing, f"{part}chimney")
    return wing


def _bands(
    house: HouseInRow, wing: Wing, first_floor: float | None
) -> list[Band]:
    """Returns the plinth, the band at the first floor, and the cornice.

    `first_floor` is the height of the first floor [m], or None without one.
    Only houses with a flat roof have a cornice.
    """
    bands = [foot_band(height=round(house.floor, 2), reach=0.05)]
    if first_floor is not None:
        z = round(first_floor, 2)
        bands.append(Band(z0=round(z - 0.15, 2), z1=z, depth=-0.05))
    if house.roof == "flat":
        z = round(wing.wall_top - 0.45, 2)
        bands.append(Band(z0=z, z1=wing.wall_top, depth=-0.22))
    return bands


def wing_and_storeys(
    house: HouseInRow, area: outlines.Area, blind: frozenset[int]
) -> tuple[Wing, int]:
    """Returns the wing of a house, and its number of storeys.

    Storeys are counted from `house.floor`.

    `area` is the ground of the house [m], and `blind` contains the numbers of
    the edges towards neighbours.
    """
    x0, y0, x1, y1 = area
    gable_in_front = house.roof in ("front", "stepped")
    span = (x1 - x0) if gable_in_front else (y1 - y0)
    top = house.height
    rise = house.rise * span / 2
    if house.roof == "flat":
        rise = 0.5
    elif house.roof == "stepped":
        top -= _STEPS_ABOVE_M
    elif not gable_in_front:
        top -= _FIREWALL_M
    room = top - house.floor - ROOF_M - _WALL_ABOVE_M
    storeys = max(1, round((room - rise) / house.storey))
    if house.roof == "flat":
        wall_top = top - rise
    else:
        wanted = house.floor + storeys * house.storey + _WALL_ABOVE_M
        # The slopes are neither too steep nor too flat.
        least = top - ROOF_M - 0.75 * span
        most = top - ROOF_M - 0.1 * span
        wall_top = min(max(wanted, least), most)
    roof = Roof(
        "gable" if gable_in_front else house.roof,
        along_y=gable_in_front,
        eaves=0.0 if gable_in_front else 0.35,
        verge=0.0 if house.roof == "stepped" else 0.3,
        thickness=ROOF_M,
        parapet=0.45,
    )
    wing = Wing.at(area, wall_top=wall_top, top=top, roof=roof, blind=blind)
    return wing, storeys


def _add_entrance(
    house: HouseInRow, wing: Wing, openings: Openings, material: str
) -> float:
    """Adds the door and its landing; returns the door's x on the wall [m]."""
    wall = wing.wall(0)
    inset = min(_DOOR_END_M, 0.3 * wall.length)
    x = inset if house.door_left else wall.length - inset
    floor = house.floor
    wing_openings.add_door(
        openings, x=x, floor=floor, height=2.25, material=material
    )
    count = max(1, round(floor / porches.RISER_M))
    run = min(
        porches.TREAD_M * count, max(house.stoop - 0.5, 0.3 * house.stoop)
    )
    landing = house.stoop - run
    if floor > 0.05:
        x0, x1 = around(x, _LANDING_HALF_M)
        slab = wall.standing((x0, x1), (-0.05, landing), floor, bottom=True)
        house.add_to("base", slab)
        porches.add_steps(
            house, wall, x0=x0, x1=x1, start=landing, rise=floor, room=run
        )
    if house.canopy:
        z = floor + 2.4
        hood = wall.box(x=around(x, 0.8), y=(-0.05, 0.8), z=(z, z + 0.14))
        house.add_to("trim", hood)
    return x


def _add_bay(
    house: HouseInRow,
    wing: Wing,
    openings: Openings,
    storeys: int,
    step: float,
    door: float,
) -> None:
    """Adds a bay window beside the door, in place of the windows there.

    Without room for a bay window, nothing is added.

    Args:
        house: the building.
        wing: the house.
        openings: its openings.
        storeys: its number of storeys.
        step: height of a storey [m].
        door: middle of the door along the front [m].
    """
    wall = wing.wall(0)
    start, end = 0.0, door - 0.8
    if house.door_left:
        start, end = door + 0.8, wall.length
    width = min(end - start - 0.7, _MOST_BAY_M)
    lacks_storey = house.bay == "oriel" and storeys < 2
    if house.bay == "none" or width < _LEAST_BAY_M or lacks_storey:
        return
    count = min(house.bay_storeys, storeys)
    x = (start + end) / 2
    low = 0.0
    foot = house.floor
    if house.bay == "oriel":
        low = house.floor + step
        foot = 0.0
        count = min(count, storeys - 1)
    high = min(foot + low + count * step - 0.1, wing.wall_top - 0.6)
    reach = min(0.6, 0.5 * house.stoop)
    openings.clear(
        0, x0=x - width / 2 - 0.1, x1=x + width / 2 + 0.1, z0=low, z1=high + 0.5
    )
    bay_windows.add_bay_window(
        house,
        wall,
        x=x,
        width=width,
        reach=reach,
        z0=round(low, 2),
        z1=round(high, 2),
        storeys=count,
        canted=house.bay != "box",
    )


def add_roof(house: HouseInRow, wing: Wing) -> None:
    """Adds the roof of a house with its dormers, firewalls or steps."""
    low = wing.wall_top + 0.45
    attic = wing_roofs.attic_window(
        width=0.8, z0=low, z1=low + 1.1, depth=wing_openings.GLASS_M
    )
    wing_roofs.add_roof(house, wing, None if house.roof == "stepped" else attic)
    if house.roof == "stepped":
        for edge in (0, 2):
            house.add_to("walls", *_stepped_gable(wing, wing.wall(edge)))
        _add_gable_windows(house, wing)
    elif house.roof in ("gable", "gambrel"):
        line = [(u, z + _FIREWALL_M) for u, z in wing.roof_line]
        for x in (wing.x0, wing.x1 - _FIREWALL_WIDTH_M):
            firewall = roofs.shell(
                line,
                start=x,
                end=x + _FIREWALL_WIDTH_M,
                thickness=_FIREWALL_M + 0.1,
            )
            house.add_to("walls", firewall)
        wing_roofs.add_dormers(
            house,
            wing,
            start=0.0,
            end=wing.width,
            count=house.dormers,
            roof=house.dormer,
        )


def _stepped_gable(wing: Wing, wall: WallFrame) -> list[Mesh]:
    """Returns the steps that rise to the middle of a gable."""
    middle = wing.width / 2
    rise = wing.top + _STEPS_ABOVE_M - wing.wall_top
    count = max(3, round(rise / _GABLE_STEP_M))
    pieces = []
    for k in range(count):
        # Each step is wide enough to hide the slope behind it.
        half = max(middle * (1.0 - k / count), 0.5)
        low = wing.wall_top + rise * (k / count) - 0.3
        top = wing.wall_top + rise * (k + 1) / count
        step = wall.box(
            x=(round(middle - half, 2), round(middle + half, 2)),
            y=(-0.32, 0.03),
            z=(round(low, 2), round(top, 2)),
        )
        pieces.append(step)
    return pieces


def _add_gable_windows(out: Assembly, wing: Wing) -> None:
    """Adds windows to a stepped gable, with frames in front of the wall."""
    middle, z = wing.width / 2, wing.wall_top + 0.4
    is_high = wing.top - wing.wall_top > 3.2
    spots = around(middle, 1.1) if is_high else (middle,)
    for edge in (0, 2):
        wall = wing.wall(edge)
        for x in spots:
            pane = Patch(
                x0=x - 0.45,
                x1=x + 0.45,
                z0=z,
                z1=z + 1.2,
                depth=wing_openings.GLASS_M,
            )
            frame = boards.casings([pane], (pane.depth,), "frame", 0.12)
            glass = boards.board(
                x0=pane.x0, x1=pane.x1, z0=pane.z0, z1=pane.z1, reach=0.05
            )
            out.add_to("trim", *(wall.place(piece) for piece in frame))
            out.add_to("glass", wall.place(glass))


def add_roof_chimney(house: HouseInRow, wing: Wing, name: str) -> None:
    """Adds a chimney to the roof of a house; `name` is the part's name."""
    yaw = math.pi / 2
    if house.roof in ("front", "stepped"):
        x = wing.x0 + 0.3 * wing.width
        z = roofs.line_height(wing.roof_line, x)
        foot = (x, wing.y0 + 0.6 * wing.depth, z - 0.6)
        add_chimney(house, name, foot, house.brick, yaw=yaw)
        return
    x = wing.x0 + 0.45 if house.door_left else wing.x1 - 0.45
    y = wing.y0 + 0.55 * wing.depth
    foot = (x, y, roofs.line_height(wing.roof_line, y) - 0.8)
    add_chimney(
        house,
        name,
        foot,
        house.brick,
        item="chimney_row",
        yaw=yaw,
        scale=(0.8, 0.85, 1.0),
    )


def front_of_site(house: HouseInRow) -> tuple[float, float, frozenset[int]]:
    """Returns x of a house's left and right wall [m], and the blind edges.

    A side wall without a neighbour stands back far enough for the cornice of a
    flat roof, so that the cornice stays on the lot.
    """
    x0, _, x1, _ = house.site.bounds
    blind = house.site.blind_edges & {1, 3}
    if house.roof == "flat":
        if 3 not in blind:
            x0 += _CORNICE_ROOM_M
        if 1 not in blind:
            x1 -= _CORNICE_ROOM_M
    return x0, x1, blind
