"""The park pavilion."""

import itertools
import math

import numpy as np

from worlds.city.facades import (
    Building,
    Facade,
    WallFrame,
    add_railing,
    around,
    bays,
    facade_mesh,
    foot_band,
    glass_mesh,
    porches,
    roofs,
    solids,
)
from worlds.shapes import Mesh, outlines

# Distance between the tables of a shelter [m].
_TABLE_PITCH_M = 3.0
# Overhang of the roof [m].
_EAVES_M = 0.6
# Depth of a step [m].
_TREAD_M = 0.26
# Greatest radius of a round pavilion [m].
_MOST_RADIUS_M = 7.0
# Least height of a pavilion with a lantern [m].
_LANTERN_PAVILION_M = 5.0
# Depth of the glass of a tea house [m].
_RECESS_M = 0.12
# Distance of posts and glass from the edge of the deck [m].
_POST_INSET_M = 0.25
# Height of the finial on a round roof [m].
_FINIAL_M = 0.5
# Height of a lantern [m].
_LANTERN_M = 1.0
# Thickness of the roofs [m].
_ROOF_M = 0.15
# Knees of a bell-shaped roof: radius as a share of the radius of the eaves, and
# height as a share of the roof's rise.
_BELL_KNEES = ((0.62, 0.28), (0.36, 0.58))
# Radius of the roof's opening below a lantern, as a share of the eaves' radius.
_NECK = 0.24
# Height of the floor of a shelter [m].
_SHELTER_FLOOR_M = 0.12
# Greatest distance between the posts of a shelter, approximately [m].
_SHELTER_PITCH_M = 3.5
# Overhang of the gabled roof of a shelter [m].
_GABLE_EAVES_M = 0.5


class ParkPavilion(Building):
    """The park pavilion: a bandstand, a shelter with tables, or a tea house."""

    def draw(self) -> None:
        """Samples sizes and style."""
        site = self.site
        long = not 0.67 < site.width / site.depth < 1.5
        self.floor = self.uniform(0.3, 0.9, digits=2)
        # `bandstand` (open, round), `tea_house` (glazed, round) or `shelter`
        # (open, long).
        self.form = "shelter"
        if not long:
            self.form = self.pick(
                ("bandstand", "bandstand", "tea_house", "shelter")
            )
        self.sides = self.pick((6, 8, 8))
        # Height of the posts above the deck.
        self.eaves = round(max(2.2, 0.5 * (self.height - self.floor)), 2)
        self.lantern = self.height > _LANTERN_PAVILION_M and self.chance(0.5)
        # Whether the roof is bent like a bell.
        self.bell = self.chance(0.5)

    def build(self) -> None:
        """Adds all parts of the pavilion.

        The building's site must be a rectangle.
        """
        x0, y0, x1, y1 = self.site.bounds
        if self.form == "shelter":
            _add_shelter(self, (x0, y0, x1, y1))
        else:
            center = ((x0 + x1) / 2, (y0 + y1) / 2)
            reach = min(x1 - x0, y1 - y0) / 2 - _EAVES_M
            _add_round(self, center, reach)


def _add_round(
    pavilion: ParkPavilion, center: outlines.Point, reach: float
) -> None:
    """Adds a polygonal deck, posts or glazed walls, and a roof.

    Args:
        pavilion: the building.
        center: middle of the deck [m].
        reach: greatest distance of deck and steps from the middle [m].
    """
    floor = pavilion.floor
    steps = max(2, round(floor / porches.RISER_M))
    plan = _deck(pavilion, center, reach, steps)
    deck = solids.prism(plan, z0=-solids.FOUNDATION_M, z1=floor)
    pavilion.add_to("stone", deck)
    front = WallFrame(plan, 0)
    half = min(0.9, 0.4 * front.length)
    x0, x1 = around(front.length / 2, half)
    flight = porches.steps(
        x0=x0, x1=x1, reach=_TREAD_M * steps, rise=floor, count=steps
    )
    pavilion.add_to("stone", front.place(flight))
    eaves = floor + pavilion.eaves
    posts = outlines.inset(plan, _POST_INSET_M)
    if pavilion.form == "tea_house":
        _add_glazing(pavilion, posts)
    else:
        _add_posts(pavilion, posts, eaves)
    beam = outlines.inset(posts, -0.12)
    pavilion.add_to(
        "timber",
        solids.skirt(beam, beam, z0=eaves - 0.3, z1=eaves + 0.02),
        solids.flat(beam, eaves - 0.3, up=False),
    )
    _add_round_roof(pavilion, center, plan, eaves)


def _deck(
    pavilion: ParkPavilion, center: outlines.Point, reach: float, steps: int
) -> np.ndarray:
    """Returns the outline (N, 2) of a polygonal deck; the front comes first.

    The deck leaves room for a number of steps within `reach` of the middle [m].
    """
    sides = pavilion.sides
    phase = -math.pi / 2 + math.pi / sides
    radius = (reach - 0.45 * 0.3 * steps) / math.cos(math.pi / sides)
    radius = min(radius, reach, _MOST_RADIUS_M)
    plan = outlines.regular_polygon(
        radius=radius, count=sides, center=center, phase=phase
    )
    # The front edge, which faces -y, ends at the corner of `phase`.
    return np.roll(plan, 1, axis=0)


def _add_posts(pavilion: ParkPavilion, posts: np.ndarray, eaves: float) -> None:
    """Adds posts, with railings between them except in front.

    `posts` contains their places (N, 2), and `eaves` is the height of their
    tops [m].
    """
    floor, timber = pavilion.floor, pavilion.colours["timber"]
    for spot in posts:
        shaft = outlines.regular_polygon(radius=0.13, count=6, center=spot)
        post = solids.skirt(shaft, shaft, z0=floor, z1=eaves)
        pavilion.add_to("timber", post)
    for edge in range(1, pavilion.sides):
        side = WallFrame(posts, edge)
        add_railing(
            pavilion,
            f"railing_{edge}",
            side,
            start=(0.1, 0.0),
            end=(side.length - 0.1, 0.0),
            z=floor,
            finish=timber,
        )


def _add_glazing(pavilion: ParkPavilion, plan: np.ndarray) -> None:
    """Adds glass walls above a parapet, with a door in front."""
    head = pavilion.eaves - 0.5
    window = bays.ribbon(sill=0.8, head=head, depth=_RECESS_M, post=0.3)
    door = bays.window(
        width=1.5, sill=0.05, head=head, depth=_RECESS_M, mullions=1
    )
    rows = bays.rhythm(2.0, [window], margin=0.1)
    walls = Facade(
        round(pavilion.eaves - 0.2, 2),
        bands=(foot_band(height=0.15, reach=0.05),),
        layout=bays.by_edge({0: bays.alone(door, width=1.9)}, rows),
        glass=(_RECESS_M,),
    )
    pavilion.add_to("timber", facade_mesh(plan, walls, pavilion.floor))
    pavilion.add_to("glass", glass_mesh(plan, walls, pavilion.floor))


def _add_round_roof(
    pavilion: ParkPavilion, center: outlines.Point, plan: np.ndarray, z: float
) -> None:
    """Adds a conical or bell-shaped roof with its lantern and finial.

    `plan` contains the corners (N, 2) of the deck, and `z` is the height of the
    eaves [m].
    """
    eaves = outlines.inset(plan, -_EAVES_M * 0.8)
    top = pavilion.height - _FINIAL_M
    head = top - _LANTERN_M if pavilion.lantern else top

    def ring(share: float) -> np.ndarray:
        """Returns the eaves' outline, made smaller by a factor."""
        return np.asarray(center) + share * (eaves - center)

    pieces = [
        solids.flat(eaves, z, up=False),
        solids.skirt(eaves, eaves, z0=z, z1=z + _ROOF_M),
    ]
    # Radii, as shares of the radius of the eaves, and heights.
    levels = [(1.0, z + _ROOF_M)]
    if pavilion.bell:
        rise = head - z - _ROOF_M
        levels += [
            (radius, z + _ROOF_M + share * rise)
            for radius, share in _BELL_KNEES
        ]
    if pavilion.lantern:
        levels.append((_NECK, head))
    for (radius, low), (next_radius, high) in itertools.pairwise(levels):
        slope = solids.skirt(ring(radius), ring(next_radius), z0=low, z1=high)
        pieces.append(slope)
    last_radius, spire_foot = levels[-1]
    spire = ring(last_radius)
    if pavilion.lantern:
        drum = ring(0.8 * _NECK)
        pieces.append(solids.flat(spire, head))
        spire_foot = top - 0.4
        walls = solids.skirt(drum, drum, z0=head, z1=spire_foot)
        pavilion.add_to("timber", walls)
        spire = ring(1.15 * _NECK)
        pieces.append(solids.flat(spire, spire_foot, up=False))
    pieces.append(solids.spire(spire, center, z0=spire_foot, z1=top))
    pavilion.add_to("roof", *pieces)
    outline = outlines.regular_polygon(radius=0.07, count=6, center=center)
    finial = solids.prism(outline, z0=top - 0.3, z1=pavilion.height)
    pavilion.add_to("timber", finial)


def _add_shelter(pavilion: ParkPavilion, area: outlines.Area) -> None:
    """Adds a hipped or gabled roof on posts, with tables and a hearth."""
    x0, y0, x1, y1 = area
    left, right = x0 + _EAVES_M + 0.1, x1 - _EAVES_M - 0.1
    front, back = y0 + _EAVES_M + 0.1, y1 - _EAVES_M - 0.1
    floor = _SHELTER_FLOOR_M
    eaves = floor + pavilion.eaves
    slab = solids.standing(
        x=(left - 0.3, right + 0.3),
        y=(front - 0.3, back + 0.3),
        z1=floor,
        bottom=True,
    )
    pavilion.add_to("stone", slab)
    posts = (left, front, right, back)
    for x, y in _shelter_posts(posts):
        post = solids.post(x, y, half=0.11, z1=eaves, z0=floor)
        pavilion.add_to("timber", post)
    frame = outlines.inset(outlines.rectangle(*posts), -0.12)
    ceiling = solids.prism(frame, z0=eaves - 0.25, z1=eaves + 0.02, bottom=True)
    pavilion.add_to("timber", ceiling)
    pavilion.add_to("roof", _shelter_roof(pavilion, posts, eaves))
    _add_tables(pavilion, posts, floor)


def _shelter_posts(area: outlines.Area) -> list[outlines.Point]:
    """Returns the places of posts along the edges of an area [m], in order."""
    x0, y0, x1, y1 = area
    across = max(2, round((x1 - x0) / _SHELTER_PITCH_M) + 1)
    deep = max(2, round((y1 - y0) / _SHELTER_PITCH_M) + 1)
    places: list[outlines.Point] = [
        *((x, y) for x in np.linspace(x0, x1, across) for y in (y0, y1)),
        *((x, y) for y in np.linspace(y0, y1, deep) for x in (x0, x1)),
    ]
    return sorted({(round(x, 2), round(y, 2)) for x, y in places})


def _shelter_roof(
    pavilion: ParkPavilion, area: outlines.Area, eaves: float
) -> Mesh:
    """Returns the hipped or gabled roof of a shelter.

    `area` is the ground between its posts, and `eaves` the height of the
    posts' tops [m].
    """
    x0, y0, x1, y1 = area
    if pavilion.bell:
        plan = outlines.rectangle(*area)
        return roofs.hip(
            plan, z=eaves, top=pavilion.height, eaves=0.55, fascia=_ROOF_M
        )
    along_y = y1 - y0 > x1 - x0
    low, high = (x0, x1) if along_y else (y0, y1)
    start, end = (y0, y1) if along_y else (x0, x1)
    line = roofs.gable_line(low, high, eaves + _ROOF_M, pavilion.height)
    reach = _GABLE_EAVES_M
    line = roofs.with_eaves(line, low=reach, high=reach)
    return roofs.shell(
        line,
        start=start - reach,
        end=end + reach,
        thickness=_ROOF_M,
        along_y=along_y,
    )


def _add_tables(
    pavilion: ParkPavilion, area: outlines.Area, floor: float
) -> None:
    """Adds tables with benches, and a hearth at one end."""
    left, front, right, back = area
    middle = (front + back) / 2
    spots = bays.stretches(right - left, pitch=_TABLE_PITCH_M, margin=0.6)
    for x, _ in spots[1:]:
        pieces = _table(left + x, middle, floor)
        pavilion.add_to("timber", *pieces)
    hearth = solids.box(
        x=(left + 0.3, left + 1.0),
        y=around(middle, 0.5),
        z=(floor, floor + 1.0),
    )
    pavilion.add_to("stone", hearth)


def _table(x: float, y: float, floor: float) -> list[Mesh]:
    """Returns a table along y between two benches, on a floor.

    `x` and `y` are the middle of the table, and `floor` is its height [m].
    """
    along = around(y, 0.9)
    top = solids.box(x=around(x, 0.4), y=along, z=(floor + 0.7, floor + 0.78))
    leg = solids.box(
        x=around(x, 0.1),
        y=around(y, 0.6),
        z=(floor, floor + 0.72),
        bottom=False,
    )
    benches = [
        solids.box(
            x=around(x_bench, 0.15),
            y=along,
            z=(floor, floor + 0.45),
            bottom=False,
        )
        for x_bench in (x - 0.75, x + 0.75)
    ]
    return [top, leg, *benches]
