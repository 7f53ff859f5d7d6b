"""The park pavilion."""

import itertools
import math

import numpy as np

from cns_drake.city.facades import (
    Building,
    Facade,
    WallFrame,
    add_railing,
    around,
    bays,
    facade_mesh,
    foot_band,
    glass_mesh,
    outlines,
    porches,
    roofs,
    solids,
)
from cns_drake.city.geometry.mesh import Mesh

# Distance between the tables of a shelter [m].
_TABLE_PITCH_M = 3.0
# Overhang of the roof [m].
_EAVES_M = 0.6


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
        self.lantern = self.height > 5.0 and self.chance(0.5)
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
    """Adds a polygonal deck, posts or glazed walls, and a roof."""
    phase = -math.pi / 2 + math.pi / pavilion.sides
    count = max(2, round(pavilion.floor / 0.17))
    radius = (reach - 0.45 * 0.3 * count) / math.cos(math.pi / pavilion.sides)
    radius = min(radius, reach, 7.0)
    plan = outlines.regular_polygon(
        radius=radius, count=pavilion.sides, center=center, phase=phase
    )
    # The front edge, which faces -y, ends at the corner of `phase`.
    plan = np.roll(plan, 1, axis=0)
    pavilion.add_to(
        "stone", solids.prism(plan, z0=-solids.FOUNDATION_M, z1=pavilion.floor)
    )
    wall = WallFrame(plan, 0)
    x = wall.length / 2
    half = min(0.9, 0.4 * wall.length)
    flight = porches.steps(
        x0=x - half,
        x1=x + half,
        reach=0.26 * count,
        rise=pavilion.floor,
        count=count,
    )
    pavilion.add_to("stone", wall.place(flight))
    z = pavilion.floor + pavilion.eaves
    posts = outlines.inset(plan, 0.25)
    if pavilion.form == "tea_house":
        _add_glazing(pavilion, posts)
    else:
        for spot in posts:
            shaft = outlines.regular_polygon(radius=0.13, count=6, center=spot)
            pavilion.add_to(
                "timber", solids.skirt(shaft, shaft, z0=pavilion.floor, z1=z)
            )
        for edge in range(1, pavilion.sides):
            side = WallFrame(posts, edge)
            ends = (0.1, 0.0), (side.length - 0.1, 0.0)
            add_railing(
                pavilion,
                f"railing_{edge}",
                side,
                *ends,
                pavilion.floor,
                pavilion.colours["timber"],
            )
    beam = outlines.inset(posts, -0.12)
    pavilion.add_to(
        "timber",
        solids.skirt(beam, beam, z0=z - 0.3, z1=z + 0.02),
        solids.flat(beam, z - 0.3, up=False),
    )
    _add_round_roof(pavilion, center, plan, z)


def _add_glazing(pavilion: ParkPavilion, plan: np.ndarray) -> None:
    """Adds glass walls above a parapet, with a door in front."""
    window = bays.ribbon(
        sill=0.8, head=pavilion.eaves - 0.5, depth=0.12, post=0.3
    )
    door = bays.window(
        width=1.5, sill=0.05, head=pavilion.eaves - 0.5, depth=0.12, mullions=1
    )
    rows = bays.rhythm(2.0, [window], margin=0.1)
    layout = bays.by_edge({0: bays.alone(door, width=1.9)}, rows)
    bands = (foot_band(height=0.15, reach=0.05),)
    facade = Facade(
        round(pavilion.eaves - 0.2, 2),
        bands=bands,
        layout=layout,
        glass=(0.12,),
    )
    pavilion.add_to("timber", facade_mesh(plan, facade, pavilion.floor))
    pavilion.add_to("glass", glass_mesh(plan, facade, pavilion.floor))


def _add_round_roof(
    pavilion: ParkPavilion, center: outlines.Point, plan: np.ndarray, z: float
) -> None:
    """Adds a conical or bell-shaped roof with its lantern and finial."""
    eaves = outlines.inset(plan, -_EAVES_M * 0.8)
    top = pavilion.height - 0.5
    head = top - 1.0 if pavilion.lantern else top

    def ring(share: float) -> np.ndarray:
        return np.asarray(center) + share * (eaves - center)

    pieces = [
        solids.flat(eaves, z, up=False),
        solids.skirt(eaves, eaves, z0=z, z1=z + 0.15),
    ]
    levels = [(1.0, z + 0.15)]
    if pavilion.bell:
        rise = head - z - 0.15
        levels += [
            (0.62, z + 0.15 + 0.28 * rise),
            (0.36, z + 0.15 + 0.58 * rise),
        ]
    neck = 0.24
    if pavilion.lantern:
        levels.append((neck, head))
    for (a, za), (b, zb) in itertools.pairwise(levels):
        pieces.append(solids.skirt(ring(a), ring(b), z0=za, z1=zb))
    hat = ring(levels[-1][0])
    low = levels[-1][1]
    if pavilion.lantern:
        drum = ring(0.8 * neck)
        pieces.append(solids.flat(hat, head))
        pavilion.add_to(
            "timber", solids.skirt(drum, drum, z0=head, z1=top - 0.4)
        )
        hat = ring(1.15 * neck)
        low = top - 0.4
        pieces.append(solids.flat(hat, low, up=False))
    pavilion.add_to("roof", *pieces, solids.spire(hat, center, z0=low, z1=top))
    finial = outlines.regular_polygon(radius=0.07, count=6, center=center)
    pavilion.add_to(
        "timber", solids.prism(finial, z0=top - 0.3, z1=pavilion.height)
    )


def _add_shelter(pavilion: ParkPavilion, area: outlines.Area) -> None:
    """Adds a hipped or gabled roof on posts, with tables and a hearth."""
    x0, y0, x1, y1 = area
    a, b = x0 + _EAVES_M + 0.1, x1 - _EAVES_M - 0.1
    c, d = y0 + _EAVES_M + 0.1, y1 - _EAVES_M - 0.1
    floor = 0.12
    z = 0.12 + pavilion.eaves
    pavilion.add_to(
        "stone",
        solids.standing(
            x=(a - 0.3, b + 0.3), y=(c - 0.3, d + 0.3), z1=floor, bottom=True
        ),
    )
    plan = outlines.rectangle(a, c, b, d)
    across = max(2, round((b - a) / 3.5) + 1)
    deep = max(2, round((d - c) / 3.5) + 1)
    places: list[tuple[float, float]] = [
        *((u, v) for u in np.linspace(a, b, across) for v in (c, d)),
        *((u, v) for v in np.linspace(c, d, deep) for u in (a, b)),
    ]
    spots = {(round(u, 2), round(v, 2)) for u, v in places}
    for u, v in sorted(spots):
        pavilion.add_to("timber", solids.post(u, v, half=0.11, z1=z, z0=floor))
    frame = outlines.inset(plan, -0.12)
    ceiling = solids.prism(frame, z0=z - 0.25, z1=z + 0.02, bottom=True)
    pavilion.add_to("timber", ceiling)
    if pavilion.bell:
        roof = roofs.hip(
            plan, z=z, top=pavilion.height, eaves=0.55, fascia=0.15
        )
    else:
        along_y = d - c > b - a
        low, high = (a, b) if along_y else (c, d)
        start, end = (c, d) if along_y else (a, b)
        line = roofs.gable_line(low, high, z + 0.15, pavilion.height)
        line = roofs.with_eaves(line, low=0.5, high=0.5)
        roof = roofs.shell(
            line,
            start=start - 0.5,
            end=end + 0.5,
            thickness=0.15,
            along_y=along_y,
        )
    pavilion.add_to("roof", roof)
    _add_tables(pavilion, (a, b, c, d), floor)


def _add_tables(
    pavilion: ParkPavilion, area: outlines.Area, floor: float
) -> None:
    """Adds tables with benches, and a hearth at one end."""
    left, right, front, back = area
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
