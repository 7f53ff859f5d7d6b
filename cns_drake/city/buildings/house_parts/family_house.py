"""Parts that family houses share: colours, boxes of rooms, garages."""

from __future__ import annotations

from collections.abc import Sequence

from cns_drake.city.facades import house_walls, wings
from cns_drake.city.facades.assembly import Assembly, Dice, Rgb
from cns_drake.city.facades.house_walls import Openings
from cns_drake.city.facades.walls import Band
from cns_drake.city.facades.wings import Roof, Wing

WALLS = (
    (0.86, 0.84, 0.78),
    (0.72, 0.74, 0.72),
    (0.80, 0.74, 0.60),
    (0.56, 0.62, 0.66),
    (0.62, 0.42, 0.34),
    (0.66, 0.68, 0.56),
    (0.78, 0.66, 0.56),
)
ROOFS = (
    (0.34, 0.33, 0.34),
    (0.46, 0.28, 0.22),
    (0.40, 0.35, 0.30),
    (0.28, 0.31, 0.34),
)
ACCENTS = (
    (0.45, 0.16, 0.14),
    (0.20, 0.32, 0.26),
    (0.22, 0.28, 0.40),
    (0.42, 0.30, 0.20),
)
BRICKS = ((0.52, 0.32, 0.26), (0.60, 0.40, 0.31), (0.45, 0.30, 0.27))
TRIM: Rgb = (0.90, 0.89, 0.86)
BASE: Rgb = (0.58, 0.56, 0.53)

STOREY_M = 2.65
ROOF_M = 0.2
# Windows of the sides are further apart than those of the front [m].
_SIDE_PITCH_M = 3.8


class Colours:
    """The parameters that family houses share: their colours."""

    def draw_colours(self, d: Dice, walls: Sequence[Rgb] = WALLS) -> None:
        """Draws the colours of walls, roof, doors and shutters."""
        self.rgb = d.pick(walls)
        self.roof_rgb = d.pick(ROOFS)
        self.accent_rgb = d.pick(ACCENTS)

    def paint(self, out: Assembly) -> None:
        """Names the materials of the house; the rest is white or stone."""
        out.paint(
            walls=self.rgb,
            glass=out.glass_rgb,
            roof=self.roof_rgb,
            trim=TRIM,
            accent=self.accent_rgb,
            base=BASE,
        )


def storeys_for(
    height: float, floor: float, span: float, pitch_deg: float
) -> int:
    """Returns the storeys that bring a roof over `span` closest to a pitch.

    Args:
        height: of the ridge [m].
        floor: height of the ground floor [m].
        span: of the roof [m].
        pitch_deg: wanted.
    """
    wanted = wings.ridge_rise(span, pitch_deg)
    room = height - ROOF_M - floor - 0.15
    counts = [n for n in (1, 2, 3, 4) if room - n * STOREY_M > 0.1 * span]
    return min(counts or [1], key=lambda n: abs(room - n * STOREY_M - wanted))


def wall_top_for(
    height: float, floor: float, span: float, storeys: int
) -> float:
    """Returns the height of the walls below a ridge [m]."""
    wanted = floor + storeys * STOREY_M + 0.15
    return min(wanted, height - ROOF_M - 0.08 * span)


def window_rows(
    wing: Wing,
    boxes: Sequence[Wing],
    floor: float,
    storeys: int,
    pitch: float,
    width: float,
) -> Openings:
    """Returns a box's windows, the sides' further apart."""
    openings = Openings(wing, boxes)
    for edges, step in (((0, 2), pitch), ((1, 3), _SIDE_PITCH_M)):
        house_walls.add_rows(
            openings, edges, floor, STOREY_M, storeys, step, width
        )
    return openings


def close_box(
    out: Assembly,
    wing: Wing,
    openings: Openings,
    plinth: float,
    casing: str,
    edges: Sequence[int] = (0,),
) -> None:
    """Adds the walls and the roof around a box's openings.

    Args:
        out: where to.
        wing: the box.
        openings: its windows and doors.
        plinth: height of the foundation that shows [m].
        casing: style of the windows' frames on `edges`.
        edges: walls with framed windows.
    """
    house_walls.add_casings(out, wing, openings, edges, casing)
    bands = (Band(0.0, plinth, -0.04),) if plinth > 0 else ()
    openings.add_walls(out, (house_walls.GLASS_M,), bands)
    low = wing.wall_top + 0.4
    attic = wings.attic_window(0.9, low, low + 1.0, house_walls.GLASS_M)
    wings.add_roof(out, wing, attic)


def garage_wing(
    kind: str, x0: float, x1: float, y0: float, y1: float, most: float
) -> Wing:
    """Returns a garage no deeper than 6.5 m and no higher than `most`.

    Its roof is `flat`, `gable`, `shed` or `hip`.
    """
    wall_top, span = 2.65, x1 - x0
    rise = {"flat": 0.5, "gable": 0.3 * span, "shed": 0.2 * span,
            "hip": 0.25 * span}[kind]  # fmt: skip
    shape = Roof(kind, True, 0.3, 0.25, ROOF_M)
    top = min(wall_top + ROOF_M + rise, most)
    return Wing.at(x0, y0, x1, min(y1, y0 + 6.5), wall_top, top, shape)


def add_garage(out: Assembly, garage: Wing, boxes: Sequence[Wing]) -> None:
    """Adds a garage, its door in front."""
    openings = Openings(garage, boxes)
    length = garage.x1 - garage.x0
    house_walls.add_garage_door(
        out, garage, openings, 0, length / 2, min(length - 0.7, 4.9)
    )
    openings.row((1, 3), 1.0, 3.4, [house_walls.sash(0.9, 0.0, 1.1, 2.0)])
    openings.add_walls(out, (house_walls.GLASS_M,))
    wings.add_roof(out, garage)
