"""What houses that stand wall to wall in a row have in common."""

from collections.abc import Sequence
import math

from cns_drake.city.buildings.house_heights import ROOF_M
from cns_drake.city.facades import (
    Assembly,
    Band,
    Building,
    Openings,
    Patch,
    Roof,
    WallFrame,
    Wing,
    add_chimney,
    around,
    bay_windows,
    boards,
    outlines,
    porches,
    roofs,
    wing_openings,
    wing_roofs,
)
from cns_drake.city.geometry.mesh import Mesh

# Party walls rise this far above a roof whose ridge follows the street [m].
_FIREWALL_M = 0.25


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
    step = (wing.wall_top - 0.25 - house.floor) / storeys
    sides = [k for k in (1, 3) if k not in blind]
    for edges, pitch in (((0, 2), house.window_pitch), (sides, 4.2)):
        wing_openings.add_window_storeys(
            openings,
            edges,
            floor=house.floor,
            storey=step,
            count=storeys,
            pitch=pitch,
            width=house.window_width,
            head=min(2.2, step - 0.45),
        )
    door = _add_entrance(house, wing, openings, door_material)
    _add_bay(house, wing, openings, storeys, step, door)
    wing_openings.add_casings(openings, (0,), house.casing)
    bands = [Band(z0=0.0, z1=round(house.floor, 2), depth=-0.05)]
    if storeys > 1:
        z = round(house.floor + step, 2)
        bands.append(Band(z0=round(z - 0.15, 2), z1=z, depth=-0.05))
    if house.roof == "flat":
        z = round(wing.wall_top - 0.45, 2)
        bands.append(Band(z0=z, z1=wing.wall_top, depth=-0.22))
    openings.add_walls((wing_openings.GLASS_M,), bands)
    add_roof(house, wing)
    if house.chimney:
        add_roof_chimney(house, wing, f"{part}chimney")
    return wing


def wing_and_storeys(
    house: HouseInRow, area: outlines.Area, blind: frozenset[int]
) -> tuple[Wing, int]:
    """Returns the wing of a house, and its number of storeys.

    Storeys are counted from `house.floor`.

    `area` is the ground of the house [m], and `blind` contains the numbers of
    the edges towards neighbours.
    """
    x0, y0, x1, y1 = area
    across = house.roof in ("front", "stepped")
    span = (x1 - x0) if across else (y1 - y0)
    top = house.height
    rise = house.rise * span / 2
    if house.roof == "flat":
        rise = 0.5
    elif house.roof == "stepped":
        top -= 0.4
    elif not across:
        top -= _FIREWALL_M
    room = top - house.floor - ROOF_M - 0.25
    storeys = max(1, round((room - rise) / house.storey))
    if house.roof == "flat":
        wall_top = top - rise
    else:
        wanted = house.floor + storeys * house.storey + 0.25
        least = top - ROOF_M - 0.75 * span
        wall_top = min(max(wanted, least), top - ROOF_M - 0.1 * span)
    kind = "gable" if across else house.roof
    eaves, verge = (
        0.0 if across else 0.35,
        0.0 if house.roof == "stepped" else 0.3,
    )
    roof = Roof(
        kind,
        along_y=across,
        eaves=eaves,
        verge=verge,
        thickness=ROOF_M,
        parapet=0.45,
    )
    return Wing.at(
        (x0, y0, x1, y1), wall_top=wall_top, top=top, roof=roof, blind=blind
    ), storeys


def _add_entrance(
    house: HouseInRow, wing: Wing, openings: Openings, material: str
) -> float:
    """Adds the door and its landing; returns the door's x on the wall [m]."""
    wall = wing.wall(0)
    inset = min(0.95, 0.3 * wall.length)
    x = inset if house.door_left else wall.length - inset
    wing_openings.add_door(
        openings, 0, x=x, floor=house.floor, height=2.25, material=material
    )
    count = max(1, round(house.floor / 0.17))
    run = min(0.29 * count, max(house.stoop - 0.5, 0.3 * house.stoop))
    landing = house.stoop - run
    a, b = x - 0.65, x + 0.65
    if house.floor > 0.05:
        slab = wall.standing(
            x=(a, b), y=(-0.05, landing), z1=house.floor, bottom=True
        )
        house.add_to("base", slab)
        porches.add_steps(
            house, wall, x0=a, x1=b, start=landing, rise=house.floor, room=run
        )
    if house.canopy:
        z = house.floor + 2.4
        house.add_to(
            "trim",
            wall.box(x=around(x, 0.8), y=(-0.05, 0.8), z=(z, z + 0.14)),
        )
    return x


def _add_bay(
    house: HouseInRow,
    wing: Wing,
    openings: Openings,
    storeys: int,
    step: float,
    door: float,
) -> None:
    """Adds a bay window beside the door, in place of the windows there."""
    wall = wing.wall(0)
    a, b = (door + 0.8, wall.length) if house.door_left else (0.0, door - 0.8)
    width = min(b - a - 0.7, 2.6)
    if (
        house.bay == "none"
        or width < 1.7
        or (house.bay == "oriel" and storeys < 2)
    ):
        return
    count = min(house.bay_storeys, storeys)
    x = (a + b) / 2
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
        for x in (wing.x0, wing.x1 - 0.3):
            firewall = roofs.shell(
                line, start=x, end=x + 0.3, thickness=_FIREWALL_M + 0.1
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
    rise = wing.top + 0.4 - wing.wall_top
    count = max(3, round(rise / 0.9))
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
    x, z = wing.width / 2, wing.wall_top + 0.4
    spots = [x - 1.1, x + 1.1] if wing.top - wing.wall_top > 3.2 else [x]
    for edge in (0, 2):
        wall = wing.wall(edge)
        for u in spots:
            pane = Patch(
                x0=u - 0.45,
                x1=u + 0.45,
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
        spot = (x, wing.y0 + 0.6 * wing.depth, z - 0.6)
        add_chimney(house, name, spot, house.brick, yaw=yaw)
        return
    x = wing.x0 + 0.45 if house.door_left else wing.x1 - 0.45
    y = wing.y0 + 0.55 * wing.depth
    spot = (x, y, roofs.line_height(wing.roof_line, y) - 0.8)
    row = "chimney_row"
    scale = (0.8, 0.85, 1.0)
    add_chimney(house, name, spot, house.brick, item=row, yaw=yaw, scale=scale)


def front_of_site(house: HouseInRow) -> tuple[float, float, frozenset[int]]:
    """Returns x of a house's left and right wall [m], and the blind edges.

    A side wall without a neighbour stands back far enough for the cornice of a
    flat roof, so that the cornice stays on the lot.
    """
    x0, _, x1, _ = house.site.bounds
    side = 0.3 * (house.roof == "flat")
    blind = house.site.blind_edges & {1, 3}
    return x0 + side * (3 not in blind), x1 - side * (1 not in blind), blind
