"""Builds a town on an imported road network, and writes its files.

Road marks follow ASAM OpenDRIVE 1.7, 11.9. The mark of a lane lies on the
lane's outer border, and the mark of lane 0 in the middle of the road. Double
lines are listed from the inside outwards; double lines in the middle of the
road are listed from left to right. A line on the border between two lanes lies
half on each lane. If one of these lanes is not carriageway, the kerb stones
would hide half of the line, so the import moves the line onto the carriageway.
"""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence, Set
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from shapely import GEOSException
from shapely.geometry import MultiLineString
from shapely.geometry.base import BaseGeometry

from cns_drake.base.errors import InputError, value_errors
from cns_drake.base.progress import doing
from cns_drake.city.generation.city_structures import City, Streets, build_along
from cns_drake.city.generation.generate import render_stages
from cns_drake.city.generation.starter import starter_plan, starter_stages
from cns_drake.city.geometry import Finish, Structure, polygons_of, triangulate
from cns_drake.city.ground.streets import street_surfaces
from cns_drake.city.placement.draft import Draft
from cns_drake.city.placement.open_ground import place_car
from cns_drake.city.plan.city_plan import CityPlan
from cns_drake.city.plan.stages import Stages
from cns_drake.imports import map_files
from cns_drake.imports.drives import search
from cns_drake.imports.drives.search import WaypointRoute
from cns_drake.imports.faces import parts_of
from cns_drake.imports.foreign_city import Imported, Rgb, make_imported
from cns_drake.imports.opendrive import imported_streets, lane_drives
from cns_drake.imports.opendrive.imported_streets import ImportedStreets
from cns_drake.imports.opendrive.lanes import (
    KerbHeights,
    LaneBand,
    RoadHeights,
    is_raised,
    lane_bands,
    split_levels,
)
from cns_drake.imports.opendrive.road_model import MarkLine, RoadMap, RoadMark
from cns_drake.imports.opendrive.road_reader import read_roads
from cns_drake.imports.opendrive.things import thing_structures
from cns_drake.imports.options import ImportFaults, ImportOptions, ImportReport
from cns_drake.scene.map_folder import LANES_NAME, MESH_FOLDER

# The edges of carriageways and of lanes differ by less than this, which is also
# the distance of lines from a kerb [m].
_SLACK = 0.02
# The end of a border is tested this far inwards [m].
_INWARDS = 0.05
# Lines are cut with one such square of the carriageway at a time [m].
_SQUARE = 64.0
_MM = 0.001
# Default length of a dash [m].
_DASH = 3.0
# Default length of the gap between two dashes [m].
_GAP = 6.0
# Distance of the lines of a double line from its middle [m].
_ASIDE = 0.12
# Height of marks above the road [m].
_ABOVE = 0.015
_SHORTEST = 0.05
_COLOURS: dict[str, Rgb] = {
    "standard": (0.86, 0.86, 0.84),
    "white": (0.86, 0.86, 0.84),
    "yellow": (0.86, 0.70, 0.22),
    "red": (0.70, 0.20, 0.18),
    "blue": (0.20, 0.32, 0.62),
    "green": (0.22, 0.48, 0.28),
    "orange": (0.85, 0.50, 0.15),
}
_STYLES = ("solid", "broken")


def moved_off_kerbs(
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
        xy[end] += step * min(0.5, _INWARDS / max(np.hypot(*step), _INWARDS))
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


def as_triangles(quads: np.ndarray) -> np.ndarray:
    """Splits quadrilaterals (K, 4, 3) into triangles (2 K, 3, 3)."""
    return quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3, 3)


def on_carriageway(quads: np.ndarray, carriageway: BaseGeometry) -> np.ndarray:
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
    found = [as_triangles(quads[inside])]
    rest = quads[~inside]
    outlines = outlines[~inside]
    squares = np.floor(rest[:, 0, :2] / _SQUARE).astype(int)
    for square in np.unique(squares, axis=0):
        chosen = np.flatnonzero((squares == square).all(axis=1))
        near = shapely.box(*shapely.total_bounds(outlines[chosen]))
        ground = shapely.intersection(carriageway, near)
        pieces = shapely.intersection(outlines[chosen], ground, grid_size=_MM)
        for quad, piece in zip(rest[chosen], pieces, strict=True):
            found += [
                _at_quad_heights(np.array(triangulate(part)), quad)
                for part in parts_of(piece)
            ]
    return np.concatenate(found)


def _at_quad_heights(flat: np.ndarray, quad: np.ndarray) -> np.ndarray:
    """Returns triangles (M, 3, 3): flat ones at the heights of a quad [m].

    `flat` is (M, 3, 2), and `quad` (4, 3).
    """
    middle = quad.mean(axis=0)
    slope = np.linalg.lstsq(
        (quad - middle)[:, :2], quad[:, 2] - middle[2], rcond=None
    )[0]
    z = middle[2] + (flat - middle[:2]) @ slope
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
            for colour, quads in _painted(
                border,
                band.s,
                band.heading,
                marks,
                side,
                section.end,
                carriageway,
            ):
                painted[band.road.name][colour].append(quads)
    for road, colours in painted.items():
        surfaces = {}
        for colour, pieces in colours.items():
            quads = np.concatenate(pieces)
            if carriageway is None:
                corners = as_triangles(quads)
            else:
                corners = on_carriageway(quads, carriageway)
            z = corners[..., 2]
            if heights is not None:
                ground = heights(corners[..., :2].reshape(-1, 2))
                z = np.maximum(z, ground.reshape(z.shape))
            corners[..., 2] = z + _ABOVE
            if len(corners):
                surfaces[colour] = corners
        if not surfaces:
            continue
        yield make_imported(
            f"{prefix}_{road}",
            "road",
            "Road mark",
            surfaces,
            {
                colour: Finish(_COLOURS[colour], "markings")
                for colour in surfaces
            },
        ).structure


def _painted(
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
        carriageway: area that marks do not leave; None for none.
    """
    left = np.stack([-np.sin(heading), np.cos(heading)], axis=1)
    ends = [*(mark.start for mark in marks[1:]), end][: len(marks)]
    for mark, last in zip(marks, ends, strict=True):
        lines = _lines(mark, float(np.sign(side)))
        moved = np.zeros(len(s))
        if lines and carriageway is not None:
            reach = (
                max(line.width / 2.0 + line.aside for line in lines),
                max(line.width / 2.0 - line.aside for line in lines),
            )
            moved = moved_off_kerbs(border, left, reach, carriageway)
        for line in lines:
            aside = left * (line.aside + moved)[:, None]
            for a, b in _stretches(line, mark.start, last):
                quads = _stripe(border, s, left, aside, (a, b), line.width)
                if len(quads):
                    known = mark.colour in _COLOURS
                    yield mark.colour if known else "standard", quads


def _lines(mark: RoadMark, side: float) -> Sequence[MarkLine]:
    """Returns the lines of a mark, from the file or else the usual ones.

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
            dash=_DASH,
            gap=0.0 if style == "solid" else _GAP,
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
    """Returns a stretch of a line as quads (K, 4, 3), seen from above [m]."""
    a, b = max(limits[0], s[0]), min(limits[1], s[-1])
    if b - a < _SHORTEST:
        return np.zeros((0, 4, 3))
    inside = s[(s > a + _SHORTEST) & (s < b - _SHORTEST)]
    at = np.concatenate([[a], np.unique(inside), [b]])
    values = np.column_stack([border, left, aside])
    rows = np.stack([np.interp(at, s, some) for some in values.T], axis=1)
    middle = rows[:, :3].copy()
    middle[:, :2] += rows[:, 5:7]
    half = np.zeros_like(middle)
    half[:, :2] = rows[:, 3:5] * width / 2.0
    right_edge, left_edge = middle - half, middle + half
    return np.stack(
        [right_edge[:-1], right_edge[1:], left_edge[1:], left_edge[:-1]], axis=1
    )


# Default height of sidewalks [m].
_KERB = 0.1
_KERBS = (0.03, 0.3)
# Greatest area that the generator fills with ground [m^2, m].
_LARGEST_AREA = 8e6
_LONGEST_SIDE = 9000.0
# Least and greatest length of a bay of a parking lane [m].
_BAY = (5.8, 7.4)
# Share of the bays that are taken.
_TAKEN_SHARE = 0.6
# Least width of a parking lane [m].
_LEAST_PARKING = 1.9
# About the radius of a tree's crown, in pictures [m].
_CROWN = 1.5
# Least and greatest speed of a drive [m/s].
_SPEEDS = (3.0, 12.0)
# Classes that the picture from above shows; small things could not be seen.
_SHOWN = (
    "road",
    "parking",
    "sidewalk",
    "other-ground",
    "building",
    "vegetation",
)


# Classes of the ground, which is kept whole however far the drives are.
_GROUND = ("road", "parking", "sidewalk", "terrain", "other-ground")


@dataclass(frozen=True)
class Town:
    """A town built on an imported road network, in all its stages.

    Attributes:
        roads: the imported roads.
        seed: seed of all random draws.
        city: the whole town.
        stages: how the town looked in each stage.
        streets: areas of the streets, except bridges.
        drives: the proposed drives, at most two.
        lanes: text of the lane file; None if there are no lanes for traffic.
        kinds: kind of structure -> number of structures.
        faults: the repaired and omitted parts of the file, by kind of fault.
    """

    roads: RoadMap
    seed: int
    city: City
    stages: Stages
    streets: ImportedStreets
    drives: list[WaypointRoute]
    lanes: str | None
    kinds: dict[str, int]
    faults: ImportFaults


def build_town(
    source: Path,
    options: ImportOptions,
    own: Sequence[WaypointRoute] | None = None,
) -> Town:
    """Returns a town, built at random along the roads of an OpenDRIVE file.

    Args:
        source: the file.
        options: `seed` of all random draws; `dressed`: whether to paint the
            road marks of the file; `grow`: the share of the buildings that the
            first stage lacks, which are the buildings in the east; `within`:
            the greatest distance of structures from the drives [m].
        own: drives that replace the proposed drives; None to use the proposed
            drives.

    Raises:
        InputError: the file cannot be used, or no drive was found for `within`.
    """
    faults = ImportFaults()
    roads = read_roads(source, faults)
    try:
        return _build(source, roads, faults, options, own)
    except GEOSException as error:
        raise InputError(
            f"{source}: an area cannot be used: {error}"
        ) from error


def _build(
    source: Path,
    roads: RoadMap,
    faults: ImportFaults,
    options: ImportOptions,
    own: Sequence[WaypointRoute] | None,
) -> Town:
    with value_errors(source):
        bands = [band for road in roads.roads for band in lane_bands(road)]
    ground, raised = split_levels(bands)
    for band in raised:
        if band.lane.inner_height and is_raised(band.kind, band.lane.height):
            faults.add("kerb on a bridge, level with its road", band.road.name)
    ends = imported_streets.bridge_ends(raised)
    streets = ImportedStreets(ground, ends)
    if streets.areas.carriageway.is_empty:
        raise InputError(f"{source}: no lane in it has an area")
    x0, y0, x1, y1 = streets.areas.carriageway.bounds
    sides = x1 - x0, y1 - y0
    if sides[0] * sides[1] > _LARGEST_AREA or max(sides) > _LONGEST_SIDE:
        raise InputError(
            f"{source}: roads of {sides[0]:.0f} m by {sides[1]:.0f} m; cut out"
            f" a piece of at most {_LARGEST_AREA / 1e6:.0f} km^2 and"
            f" {_LONGEST_SIDE / 1000:.0f} km"
        )
    plan = CityPlan.model_validate(starter_plan(streets.areas, options.seed))
    lanes = streets.areas.lane_area
    things = [
        one
        for road in roads.roads
        for one in thing_structures(road, lanes, faults)
    ]
    decks = list(imported_streets.bridge_decks(raised))
    kerb = _kerb(ground)
    kerbs = KerbHeights(ground, kerb)
    surface = RoadHeights(ground)
    marks: list[Structure] = []
    if options.dressed:
        _count_spans(roads, {band.road.name for band in raised}, faults)
        marks += road_marks(
            "marks", ground, surface.heights, streets.areas.carriageway
        )
        marks += road_marks("bridge_marks", raised)
    doing(f"building along {len(roads.roads)} roads")
    city = build_along(
        Streets(
            areas=streets.areas,
            surface=surface,
            kerb_height=kerb,
            kerbs=kerbs if kerbs.differ else None,
            junctions=streets.junctions,
            margins=streets.margins,
            reserved=shapely.union_all(
                [
                    *(imported_streets.lane_polygon(band) for band in raised),
                    *(one.footprint_W for one in things),
                ]
            ),
            structures=(
                *street_surfaces(
                    streets.areas,
                    surface,
                    kerbs if kerbs.differ else kerb,
                    streets.coverings,
                    ends,
                ),
                *decks,
                *things,
                *marks,
            ),
            furnish=lambda draft: None,
            park=lambda draft: _park_cars(draft, ground, plan.cars),
        ),
        plan,
        str(source),
    )
    drives = (
        lane_drives.find_lane_drives(bands)
        if own is None
        else search.with_ground_heights(own, surface.heights, faults)
    )
    if options.within is not None:
        city = _near_drives(city, drives, options.within, faults)
    imported = {one.name for one in (*decks, *things, *marks)}
    generated = [one for one in city.structures if one.name not in imported]
    lanes_of_traffic = lane_drives.lanes_for_traffic(bands, kerbs)
    if lanes_of_traffic is None:
        faults.add(
            "no lanes for traffic: each comes to a dead end", source.name
        )
    missing = {} if options.grow is None else {"missing": options.grow}
    stages = starter_stages(City(tuple(generated), city.cars), **missing)
    return Town(
        roads,
        options.seed,
        city,
        Stages.model_validate(stages),
        streets,
        drives,
        lanes_of_traffic,
        _kinds(roads, things, decks, marks, generated),
        faults,
    )


def _near_drives(
    city: City,
    drives: Sequence[WaypointRoute],
    distance: float,
    faults: ImportFaults,
) -> City:
    """Returns a city without what stands far from drives [m].

    The ground is kept.

    Raises:
        InputError: there is no drive.
    """
    if not drives:
        raise InputError("--within: no drive was found; give one with --along")
    ways = MultiLineString([drive.path for drive in drives])
    shapely.prepare(ways)
    kept = []
    for one in city.structures:
        if one.semantic_class in _GROUND or shapely.dwithin(
            ways, one.footprint_W, distance
        ):
            kept.append(one)
        else:
            kind = "structure far from the drives, left out"
            faults.add(kind, one.name)
    return City(tuple(kept), city.cars)


def _count_spans(
    roads: RoadMap, raised: Set[str], faults: ImportFaults
) -> None:
    """Counts bridges and tunnels in a file that are not built.

    `raised` are roads that pass over others, on decks that are built.
    """
    for road in roads.roads:
        for span in road.spans:
            if span == "tunnel":
                faults.add("tunnel, its road left open", road.name)
            elif road.name not in raised:
                kind = "bridge over no other road, laid on the ground"
                faults.add(kind, road.name)


def _kerb(bands: Sequence[LaneBand]) -> float:
    """Returns the height of sidewalks above the road [m]."""
    kerbs = [
        band.lane.height
        for band in bands
        if band.kind == "sidewalk" and band.lane.height > 0.0
    ]
    return float(np.clip(np.median(kerbs), *_KERBS)) if kerbs else _KERB


def _park_cars(
    draft: Draft, bands: Sequence[LaneBand], cars: dict[str, float]
) -> None:
    """Parks cars in parking lanes, facing in the direction of traffic."""
    for band in bands:
        if band.kind != "parking" or band.width.min() < _LEAST_PARKING:
            continue
        rng = draft.task(
            "parking", band.road.name, band.section, band.lane.number
        )
        steps = np.linalg.norm(np.diff(band.middle, axis=0), axis=1)
        along = np.concatenate([[0.0], np.cumsum(steps)])
        place = float(rng.uniform(*_BAY)) / 2.0
        backwards = (band.lane.number > 0) != band.road.keeps_left
        while place < along[-1] - _BAY[0] / 2.0:
            x, y = (np.interp(place, along, band.middle[:, k]) for k in (0, 1))
            nearest = int(np.abs(along - place).argmin())
            yaw = float(band.heading[nearest]) + (np.pi if backwards else 0.0)
            taken = rng.uniform() < _TAKEN_SHARE
            if taken:
                place_car(draft, cars, (float(x), float(y)), yaw, rng, ("bay",))
            place += float(rng.uniform(*_BAY))


def _kinds(
    roads: RoadMap,
    things: Sequence[Structure],
    decks: Sequence[Structure],
    marks: Sequence[Structure],
    generated: Sequence[Structure],
) -> dict[str, int]:
    junctions = [
        road.junction for road in roads.roads if road.junction is not None
    ]
    drawn = Counter(one.semantic_class for one in generated)
    kinds = {
        "roads": len(roads.roads) - len(junctions),
        "roads in junctions": len(junctions),
        "junctions": len(set(junctions)),
        "signals": sum("signal" in one.tags for one in things),
        "objects": sum("object" in one.tags for one in things),
        "bridges": sum(one.semantic_class == "road" for one in decks),
        "roads with marks": len(marks),
        "buildings, sampled at random": drawn["building"],
        "plants, sampled at random": drawn["vegetation"],
    }
    return {kind: number for kind, number in kinds.items() if number}


def write_town(
    draft: Path, source: Path, town: Town
) -> tuple[ImportReport, dict[str, tuple[int, int]]]:
    """Writes all files of a town to a map folder.

    Args:
        draft: the folder, which has the map's name.
        source: imported file, named in messages and comments.
        town: the town.

    Returns:
        What was imported, and name of a stage -> numbers of its structures and
        of its triangles.

    Raises:
        InputError: the town has more structures than there are instance ids.
    """
    stages = town.stages.stages
    files, sizes = render_stages(
        draft.name,
        town.city,
        town.stages,
        stages,
        source,
        origin=f"Imported by cns-drake from {source.name}.",
    )
    (draft / MESH_FOLDER).mkdir(exist_ok=True)
    for name, text in files.items():
        (draft / name).write_text(text, "utf-8")
    if town.lanes is not None:
        (draft / LANES_NAME).write_text(town.lanes, "utf-8")
    map_files.write_facts(
        draft,
        source,
        {
            "reference_system": town.roads.reference_system or "unknown",
            "origin": list(town.roads.origin),
            "seed": town.seed,
            "stages": {name: plan.story for name, plan in stages.items()},
        },
        town.faults,
        "# Where the roads of this map come from; all else is random."
        "\n# A place of the map plus the origin is one of the source [m].\n",
    )
    map_files.write_drives(
        draft,
        {
            stage: "" if stage == list(stages)[-1] else ", not all of it built"
            for stage in stages
        },
        [drive.waypoints for drive in town.drives],
        [
            float(np.clip(drive.limit or _SPEEDS[1], *_SPEEDS))
            for drive in town.drives
        ],
    )
    map_files.draw_overview(
        draft / "from_above.png",
        list(_seen_from_above(town.city.structures)),
        None,
        town.drives,
    )
    report = ImportReport(
        kinds=town.kinds,
        triangles=sum(one.model.num_triangles for one in town.city.structures),
        stages={stage: size[0] for stage, size in sizes.items()},
        undated=0,
        dated=0,
        drives=tuple(drive.length for drive in town.drives),
        faults=town.faults.rows(),
    )
    return report, sizes


def _seen_from_above(structures: Iterable[Structure]) -> Iterable[Imported]:
    """Yields the footprints of structures as flat triangles."""
    for one in structures:
        if one.semantic_class not in _SHOWN:
            continue
        area = one.footprint_W
        if one.semantic_class == "vegetation":
            # About the radius of the crown.
            area = area.buffer(_CROWN)
        pieces = polygons_of(area)
        cut = shapely.constrained_delaunay_triangles(
            shapely.multipolygons(pieces)
        )
        corners = [
            shapely.get_coordinates(triangle)[:3]
            for triangle in shapely.get_parts(cut)
        ]
        if corners:
            xy = np.array(corners)
            z = np.zeros((*xy.shape[:2], 1))
            yield Imported(one, "", None, np.concatenate([xy, z], axis=2))
