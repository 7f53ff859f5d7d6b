"""Painted road marks of OpenDRIVE roads, as structures on the carriageway.

Road marks follow ASAM OpenDRIVE 1.7, 11.9. The mark of a lane lies on the
lane's outer border, and the mark of lane 0 in the middle of the road. Double
lines are listed from the inside outwards; double lines in the middle of the
road are listed from left to right. A line on the border between two lanes lies
half on each lane. If one of these lanes is not carriageway, the kerb stones
would hide half of the line, so the import moves the line onto the carriageway.
"""

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from evaluation.base import cos, dot, sin
from worlds.city import DASH, DASH_GAP
from worlds.imports.colours import WHITE, Rgb
from worlds.imports.faces import parts_of
from worlds.imports.imported_objects import make_object
from worlds.imports.opendrive.lanes import LaneBand
from worlds.imports.opendrive.road_model import MarkLine, RoadMark
from worlds.shapes import GRID, Finish, Structure, triangulate

# The end moves inwards by at most this share of the border's last piece.
_MOST_INWARDS = 0.5
# The edges of carriageways and of lanes differ by less than this, which is also
# the distance of lines from a kerb [m].
_SLACK = 0.02
# The end of a border is tested this far inwards [m].
_INWARDS = 0.05
# Lines are cut with one such square of the carriageway at a time [m].
_SQUARE = 64.0
# Distance of the lines of a double line from its middle [m].
_ASIDE = 0.12
# Height of marks above the road [m].
_ABOVE = 0.015
# Shorter stretches of a line are left out [m].
_SHORTEST = 0.05
_COLOURS: dict[str, Rgb] = {
    "standard": WHITE,
    "white": WHITE,
    "yellow": (0.86, 0.70, 0.22),
    "red": (0.70, 0.20, 0.18),
    "blue": (0.20, 0.32, 0.62),
    "green": (0.22, 0.48, 0.28),
    "orange": (0.85, 0.50, 0.15),
}
# Words of a mark's type for its lines.
_STYLES = ("solid", "broken")


def _moved_off_kerbs(
    border: np.ndarray,
    left: np.ndarray,
    reach: tuple[float, float],
    carriageway: BaseGeometry,
) -> np.ndarray:
    """Returns how far a painted line must move to leave a kerb, (N,) [m].

    The line is on the border of a lane. Where only one side of the border is
    carriageway, the line would partly lie on the kerb, and is moved towards the
    carriageway. Places next to a moved place are moved as well.

    Args:
        border: (N, 3) places on the border of the lane [m].
        left: (N, 2) unit vectors to the left of the border.
        reach: how far the line extends to the left and to the right of the
            border [m].
        carriageway: area of the carriageway in W, a prepared geometry
            (Shapely).

    Returns:
        Distances, positive to the left.
    """
    xy = border[:, :2].copy()
    # A kerb may cross the border right at its end.
    for end, beside in ((0, 1), (-1, -2)):
        step = xy[beside] - xy[end]
        share = _INWARDS / max(np.hypot(*step), _INWARDS)
        xy[end] += step * min(_MOST_INWARDS, share)
    on_left, on_right = (
        shapely.contains_xy(carriageway, *(xy + out * left).T)
        for out in (reach[0] - _SLACK, _SLACK - reach[1])
    )
    moved = np.zeros(len(border))
    moved[on_left & ~on_right] = reach[1] + _SLACK
    moved[on_right & ~on_left] = -reach[0] - _SLACK
    # Lines return to their border only behind the end of a kerb.
    near = np.append(0.0, moved[:-1]) + np.append(moved[1:], 0.0)
    return np.where(moved == 0.0, near, moved)


def _as_triangles(quads: np.ndarray) -> np.ndarray:
    """Splits quadrilaterals (K, 4, 3) into triangles (2 K, 3, 3)."""
    return quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3, 3)


def _on_carriageway(quads: np.ndarray, carriageway: BaseGeometry) -> np.ndarray:
    """Returns the parts of quadrilaterals that lie on a carriageway [m].

    Args:
        quads: (K, 4, 3) the quadrilaterals.
        carriageway: area of the carriageway in W, a prepared geometry
            (Shapely).

    Returns:
        Triangles (M, 3, 3), cut as seen from above.
    """
    outlines = np.asarray(shapely.polygons(quads[..., :2]))
    inside = shapely.contains_properly(carriageway, outlines)
    triangles = [_as_triangles(quads[inside])]
    cut, outlines = quads[~inside], outlines[~inside]
    squares = np.floor(cut[:, 0, :2] / _SQUARE).astype(int)
    for square in np.unique(squares, axis=0):
        in_square = np.flatnonzero((squares == square).all(axis=1))
        bounds = shapely.box(*shapely.total_bounds(outlines[in_square]))
        near = shapely.intersection(carriageway, bounds)
        pieces = shapely.intersection(outlines[in_square], near, grid_size=GRID)
        for quad, piece in zip(cut[in_square], pieces, strict=True):
            triangles += [
                _at_quad_heights(np.array(triangulate(part)), quad)
                for part in parts_of(piece)
            ]
    return np.concatenate(triangles)


def _at_quad_heights(flat: np.ndarray, quad: np.ndarray) -> np.ndarray:
    """Returns flat triangles, raised to the heights of a quad, (M, 3, 3) [m].

    `flat` (M, 3, 2) contains x and y of the triangles' corners, and `quad` (4,
    3) contains the quad's corners.
    """
    middle = quad.mean(axis=0)
    slope = np.linalg.lstsq(
        (quad - middle)[:, :2], quad[:, 2] - middle[2], rcond=None
    )[0]
    z = middle[2] + dot(flat - middle[:2], slope)
    return np.concatenate([flat, z[..., None]], axis=2)


def road_marks(
    prefix: str,
    bands: Sequence[LaneBand],
    heights: Callable[[np.ndarray], np.ndarray] | None = None,
    carriageway: BaseGeometry | None = None,
) -> Iterator[Structure]:
    """Yields the painted road marks of each road as a structure.

    Args:
        prefix: beginning of the structures' names.
        bands: the lanes of the roads.
        heights: function that returns the heights of the ground at places (N,
            2) [m]. By default, marks have the heights of the lanes' borders.
        carriageway: area to which marks are limited, because kerbs surround it;
            None for no limit.
    """
    if carriageway is not None:
        shapely.prepare(carriageway)
    for road, colours in _quads_by_road(bands, carriageway).items():
        surfaces = {
            colour: triangles
            for colour, quads in colours.items()
            if len(triangles := _laid(quads, heights, carriageway))
        }
        if surfaces:
            yield make_object(
                f"{prefix}_{road}",
                "road",
                "Road mark",
                surfaces,
                {
                    colour: Finish(_COLOURS[colour], "markings")
                    for colour in surfaces
                },
            ).structure


def _quads_by_road(
    bands: Sequence[LaneBand], carriageway: BaseGeometry | None
) -> dict[str, dict[str, np.ndarray]]:
    """Returns the marks of each road, by colour, as quads (K, 4, 3) [m].

    The arguments are as for `road_marks`.
    """
    painted: dict[str, dict[str, list[np.ndarray]]] = defaultdict(
        lambda: defaultdict(list)
    )
    for band in bands:
        section = band.road.sections[band.section]
        lines = [(band.outer, band.lane.marks, float(band.lane.number))]
        if band.lane.number == (-1 if -1 in section.lanes else 1):
            # In the middle, the second line is on the right.
            lines.append((band.inner, section.middle_marks, -1.0))
        for border, marks, side in lines:
            for colour, quads in _painted_quads(
                border,
                band.s,
                band.heading,
                marks,
                side,
                section.end,
                carriageway,
            ):
                painted[band.road.name][colour].append(quads)
    return {
        road: {
            colour: np.concatenate(pieces) for colour, pieces in colours.items()
        }
        for road, colours in painted.items()
    }


def _laid(
    quads: np.ndarray,
    heights: Callable[[np.ndarray], np.ndarray] | None,
    carriageway: BaseGeometry | None,
) -> np.ndarray:
    """Returns quads (K, 4, 3), laid on the road as triangles (M, 3, 3) [m].

    The triangles are slightly above the road. The other arguments are as for
    `road_marks`.
    """
    if carriageway is None:
        triangles = _as_triangles(quads)
    else:
        triangles = _on_carriageway(quads, carriageway)
    z = triangles[..., 2]
    if heights is not None:
        ground = heights(triangles[..., :2].reshape(-1, 2))
        z = np.maximum(z, ground.reshape(z.shape))
    triangles[..., 2] = z + _ABOVE
    return triangles


def _painted_quads(
    border: np.ndarray,
    s: np.ndarray,
    heading: np.ndarray,
    marks: Sequence[RoadMark],
    side: float,
    end: float,
    carriageway: BaseGeometry | None,
) -> Iterator[tuple[str, np.ndarray]]:
    """Yields the colour of marks on a border, and their quads (K, 4, 3) [m].

    Args:
        border: (N, 3) places on the border [m].
        s, heading: (N,) distance along the road, and heading there [m, rad].
        marks: marks on the border, one after the other.
        side: positive if the left of the border is outwards.
        end: where the last mark ends [m].
        carriageway: area to which marks are limited; None for no limit.
    """
    left = np.stack([-sin(heading), cos(heading)], axis=1)
    ends = [*(mark.start for mark in marks[1:]), end][: len(marks)]
    for mark, end_of_mark in zip(marks, ends, strict=True):
        lines = _lines(mark, float(np.sign(side)))
        moved = np.zeros(len(s))
        if lines and carriageway is not None:
            reach = (
                max(line.width / 2.0 + line.aside for line in lines),
                max(line.width / 2.0 - line.aside for line in lines),
            )
            moved = _moved_off_kerbs(border, left, reach, carriageway)
        for line in lines:
            aside = left * (line.aside + moved)[:, None]
            for limits in _stretches(line, mark.start, end_of_mark):
                quads = _stripe(border, s, left, aside, limits, line.width)
                if len(quads):
                    known = mark.colour in _COLOURS
                    yield mark.colour if known else "standard", quads


def _lines(mark: RoadMark, side: float) -> Sequence[MarkLine]:
    """Returns the lines of a mark in the file, or else the usual lines.

    `side` is positive if the left of the border is outwards.
    """
    styles = [word for word in mark.kind.split() if word in _STYLES]
    if mark.lines and (styles or mark.kind == "custom"):
        return mark.lines
    apart = _ASIDE * side if len(styles) > 1 else 0.0
    return [
        MarkLine(
            aside=(2 * k - 1) * apart,
            start=0.0,
            dash=DASH,
            gap=0.0 if style == "solid" else DASH_GAP,
            width=mark.width,
        )
        for k, style in enumerate(styles)
    ]


def _stretches(
    line: MarkLine, start: float, end: float
) -> Iterator[tuple[float, float]]:
    """Yields start and end of the painted stretches of a line [m]."""
    if line.gap == 0.0:
        yield start + line.start, end
        return
    for s in np.arange(start + line.start, end, line.dash + line.gap).tolist():
        yield max(s, start), min(s + line.dash, end)


def _stripe(
    border: np.ndarray,
    s: np.ndarray,
    left: np.ndarray,
    aside: np.ndarray,
    limits: tuple[float, float],
    width: float,
) -> np.ndarray:
    """Returns a stretch of a line as quads (K, 4, 3), seen from above [m].

    Args:
        border: (N, 3) places on the border that the line follows [m].
        s: (N,) distances of these places along the road [m].
        left: (N, 2) unit vectors to the left of the border.
        aside: (N, 2) vectors from the border to the middle of the line [m].
        limits: distances along the road at both ends of the stretch [m].
        width: width of the line [m].
    """
    a, b = max(limits[0], s[0]), min(limits[1], s[-1])
    if b - a < _SHORTEST:
        return np.zeros((0, 4, 3))
    inside = s[(s > a + _SHORTEST) & (s < b - _SHORTEST)]
    at = np.concatenate([[a], np.unique(inside), [b]])
    values = np.column_stack([border, left, aside])
    rows = np.stack([np.interp(at, s, value) for value in values.T], axis=1)
    middle, to_left, from_border = np.split(rows, [3, 5], axis=1)
    middle[:, :2] += from_border
    half = np.zeros_like(middle)
    half[:, :2] = to_left * width / 2.0
    right_edge, left_edge = middle - half, middle + half
    return np.stack(
        [right_edge[:-1], right_edge[1:], left_edge[1:], left_edge[:-1]], axis=1
    )
