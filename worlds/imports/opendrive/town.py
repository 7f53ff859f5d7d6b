"""Builds a town on an imported road network, and writes its files."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import shapely
from shapely import GEOSException
from shapely.geometry import MultiLineString
from shapely.geometry.base import BaseGeometry

from evaluation.base import InputError, distances_along, doing, value_errors
from worlds.city import (
    City,
    CityPlan,
    CityStreets,
    Draft,
    Stages,
    build_along,
    place_car,
    render_stages,
    starter_plan,
    starter_stages,
    street_surfaces,
)
from worlds.imports import map_files, overview
from worlds.imports.drives import search, steerable_drives
from worlds.imports.drives.steerable_drives import WaypointRoute
from worlds.imports.faults import ImportFaults
from worlds.imports.imported_objects import ImportedObject
from worlds.imports.opendrive.band_graph import BandGraph
from worlds.imports.opendrive.bridges import (
    bridge_decks,
    bridge_ends,
    grounds_below,
    split_levels,
    tunnel_shells,
)
from worlds.imports.opendrive.imported_streets import ImportedStreets
from worlds.imports.opendrive.lanes import (
    LaneBand,
    is_raised,
    lane_bands,
    lane_polygon,
)
from worlds.imports.opendrive.road_heights import KerbHeights, RoadHeights
from worlds.imports.opendrive.road_marks import road_marks
from worlds.imports.opendrive.road_model import RoadMap
from worlds.imports.opendrive.road_reader import read_roads
from worlds.imports.opendrive.things import thing_structures
from worlds.imports.options import ImportOptions
from worlds.imports.report import ImportReport
from worlds.maps import MESH_FOLDER
from worlds.shapes import GROUND_CLASSES, Structure, surface_mesh

# Height of sidewalks above the road if the file states none [m].
_KERB_HEIGHT = 0.1
# Least and greatest height of sidewalks above the road [m].
_KERB_HEIGHTS = (0.03, 0.3)
# Greatest area that the generator fills with ground [m^2].
_LARGEST_AREA = 8e6
# Greatest extent of this area along x or y [m].
_LONGEST_SIDE = 9000.0
# Least and greatest length of a bay of a parking lane [m].
_BAY_LENGTHS = (5.8, 7.4)
# Share of the bays that are taken.
_TAKEN_SHARE = 0.6
# Least width of a parking lane [m].
_LEAST_PARKING = 1.9
# About the radius of a tree's crown, in pictures [m].
_CROWN_RADIUS = 1.5
# Side of the squares into which footprints are divided, in pictures [m].
_TILE = 20.0
# Least and greatest speed of a drive [m/s].
_SPEEDS = (3.0, 12.0)
# Classes that the picture from above shows; small things could not be seen.
_SHOWN_CLASSES = (
    "road",
    "parking",
    "sidewalk",
    "other-ground",
    "building",
    "vegetation",
)


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
        kinds: kind of structure -> number of structures.
        faults: the repaired and omitted parts of the file, by kind of fault.
    """

    roads: RoadMap
    seed: int
    city: City
    stages: Stages
    streets: ImportedStreets
    drives: list[WaypointRoute]
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
        options: options of the import. `seed` is the seed of all random draws.
            `dressed` says whether to paint the road marks of the file. `grow`
            is the share of the buildings that the first stage lacks, beginning
            in the east. `within` is the greatest distance of structures from
            the drives [m].
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
    streets = _read_streets(source, roads, faults)
    of_file = _structures_of_file(roads, streets, options.dressed, faults)
    doing(f"building along {len(roads.roads)} roads")
    city = _city_along(source, streets, of_file, options.seed)
    drives = (
        search.find_drives(BandGraph(streets.bands))
        if own is None
        else steerable_drives.with_ground_heights(
            own, streets.surface.heights, faults
        )
    )
    if options.within is not None:
        city = _near_drives(city, drives, options.within, faults)
    imported = {one.name for some in of_file for one in some}
    generated = [one for one in city.structures if one.name not in imported]
    return Town(
        roads=roads,
        seed=options.seed,
        city=city,
        stages=_make_stages(City(tuple(generated), city.cars), options.grow),
        streets=streets.on_ground,
        drives=drives,
        kinds=_counts_by_kind(roads, of_file, generated),
        faults=faults,
    )


class _TownStreets(NamedTuple):
    """The streets of a town, as the file determines them.

    Attributes:
        ground: the lanes on the ground.
        raised: the lanes on bridges.
        bridge_ends: strips across the lanes at both ends of bridges, in W.
        on_ground: areas of the streets on the ground.
        surface: heights of these streets.
        kerbs: heights of their kerbs.
    """

    bands: list[LaneBand]
    ground: list[LaneBand]
    raised: list[LaneBand]
    bridge_ends: BaseGeometry
    on_ground: ImportedStreets
    surface: RoadHeights
    kerbs: KerbHeights


def _read_streets(
    source: Path, roads: RoadMap, faults: ImportFaults
) -> _TownStreets:
    """Returns the streets of a town."""
    with value_errors(source):
        bands = [band for road in roads.roads for band in lane_bands(road)]
    for band in bands:
        if band.is_inverted:
            kind = "lane of negative width, without width there"
            faults.add(kind, band.road.name)
    ground, raised = split_levels(bands, faults)
    _count_raised_kerbs(raised, faults)
    ends = bridge_ends(raised)
    on_ground = ImportedStreets(ground, ends)
    _check_extent(source, on_ground.areas.carriageway)
    return _TownStreets(
        bands,
        ground,
        raised,
        ends,
        on_ground,
        RoadHeights(ground),
        KerbHeights(ground, _median_kerb_height(ground)),
    )


def _make_stages(generated: City, grow: float | None) -> Stages:
    """Returns the stages of a town.

    Args:
        generated: the structures that may be missing in the first stage.
        grow: share of the buildings that the first stage lacks; None for the
            usual share.
    """
    missing = {} if grow is None else {"missing": grow}
    return Stages.model_validate(starter_stages(generated, **missing))


class _StructuresOfFile(NamedTuple):
    """Structures of a town that the file determines.

    Attributes:
        decks: decks of bridges.
        things: signals and objects.
        marks: road marks.
    """

    decks: list[Structure]
    things: list[Structure]
    marks: list[Structure]


def _structures_of_file(
    roads: RoadMap, streets: _TownStreets, dressed: bool, faults: ImportFaults
) -> _StructuresOfFile:
    """Returns the structures of a town that the file determines.

    Args:
        roads: the roads of the file.
        streets: the streets of the town.
        dressed: whether the town has road marks.
        faults: counts parts that are left out.
    """
    areas, raised = streets.on_ground.areas, streets.raised
    things = [
        one
        for road in roads.roads
        for one in thing_structures(road, areas.lane_area, faults)
    ]
    things += tunnel_shells(streets.bands, raised)
    marks: list[Structure] = []
    if dressed:
        marks += road_marks(
            "marks", streets.ground, streets.surface.heights, areas.carriageway
        )
        marks += road_marks("bridge_marks", raised)
    return _StructuresOfFile(list(bridge_decks(raised)), things, marks)


def _city_along(
    source: Path, streets: _TownStreets, of_file: _StructuresOfFile, seed: int
) -> City:
    """Returns a city along the streets of a town, sampled at random.

    Args:
        source: the file, named in error messages.
        of_file: the structures that the file determines, which the city also
            contains.
    """
    on_ground, kerbs = streets.on_ground, streets.kerbs
    plan = CityPlan.model_validate(starter_plan(on_ground.areas, seed))
    surfaces = street_surfaces(
        on_ground.areas,
        streets.surface,
        kerbs if kerbs.differ else kerbs.usual,
        on_ground.coverings,
        streets.bridge_ends,
    )
    return build_along(
        CityStreets(
            areas=on_ground.areas,
            surface=streets.surface,
            kerb_height=kerbs.usual,
            kerbs=kerbs if kerbs.differ else None,
            junctions=on_ground.junctions,
            margins=on_ground.margins,
            # Nothing is built below bridges, nor on things of the file.
            reserved=shapely.union_all(
                [
                    *map(lane_polygon, streets.raised),
                    *(one.footprint_W for one in of_file.things),
                ]
            ),
            structures=(
                *surfaces,
                *of_file.decks,
                *of_file.things,
                *of_file.marks,
            ),
            furnish=lambda draft: None,
            park=lambda draft: _park_cars(draft, streets.ground, plan.cars),
            pads=grounds_below(streets.raised, streets.ground),
        ),
        plan,
        str(source),
    )


def _check_extent(source: Path, carriageway: BaseGeometry) -> None:
    """Checks that an area is not too large to be filled with a town."""
    if carriageway.is_empty:
        raise InputError(f"{source}: no lane in it has an area")
    x0, y0, x1, y1 = carriageway.bounds
    sides = x1 - x0, y1 - y0
    if sides[0] * sides[1] > _LARGEST_AREA or max(sides) > _LONGEST_SIDE:
        raise InputError(
            f"{source}: roads of {sides[0]:.0f} m by {sides[1]:.0f} m; cut out"
            f" a piece of at most {_LARGEST_AREA / 1e6:.0f} km^2 and"
            f" {_LONGEST_SIDE / 1000:.0f} km"
        )


def _near_drives(
    city: City,
    drives: Sequence[WaypointRoute],
    distance: float,
    faults: ImportFaults,
) -> City:
    """Returns a city without structures farther than `distance` from drives.

    The ground is kept.
    """
    if not drives:
        raise InputError("--within: no drive was found; give one with --along")
    ways = MultiLineString([drive.path for drive in drives])
    shapely.prepare(ways)
    kept = []
    for one in city.structures:
        # The ground is kept whole.
        if one.semantic_class in GROUND_CLASSES or shapely.dwithin(
            ways, one.footprint_W, distance
        ):
            kept.append(one)
        else:
            kind = "structure far from the drives, left out"
            faults.add(kind, one.name)
    return City(tuple(kept), city.cars)


def _count_raised_kerbs(
    raised: Sequence[LaneBand], faults: ImportFaults
) -> None:
    """Counts kerbs on bridges, which are not built."""
    for band in raised:
        if band.lane.inner_height and is_raised(band.kind, band.lane.height):
            faults.add("kerb on a bridge, level with its road", band.road.name)


def _median_kerb_height(bands: Sequence[LaneBand]) -> float:
    """Returns the height of sidewalks above the road [m].

    The height is the median of the heights in the file, within usual limits.
    """
    kerbs = [
        band.lane.height
        for band in bands
        if band.kind == "sidewalk" and band.lane.height > 0.0
    ]
    return (
        float(np.clip(np.median(kerbs), *_KERB_HEIGHTS))
        if kerbs
        else _KERB_HEIGHT
    )


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
        along = distances_along(band.middle)
        place = float(rng.uniform(*_BAY_LENGTHS)) / 2.0
        backwards = (band.lane.number > 0) != band.road.keeps_left
        while place < along[-1] - _BAY_LENGTHS[0] / 2.0:
            x, y = (np.interp(place, along, band.middle[:, k]) for k in (0, 1))
            nearest = int(np.abs(along - place).round(6).argmin())
            yaw = float(band.heading[nearest]) + (np.pi if backwards else 0.0)
            taken = rng.uniform() < _TAKEN_SHARE
            if taken:
                place_car(draft, cars, (float(x), float(y)), yaw, rng, ("bay",))
            place += float(rng.uniform(*_BAY_LENGTHS))


def _counts_by_kind(
    roads: RoadMap,
    of_file: _StructuresOfFile,
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
        "signals": sum("signal" in one.tags for one in of_file.things),
        "objects": sum("object" in one.tags for one in of_file.things),
        "bridges": sum(one.semantic_class == "road" for one in of_file.decks),
        "tunnels": sum(one.kind == "tunnel" for one in of_file.things),
        "roads with marks": len(of_file.marks),
        "buildings, sampled at random": drawn["building"],
        "plants, sampled at random": drawn["vegetation"],
    }
    return {kind: number for kind, number in kinds.items() if number}


def write_town(
    draft: Path, source: Path, town: Town
) -> tuple[ImportReport, dict[str, tuple[int, int]]]:
    """Writes all files of a town to a map folder.

    Returns:
        What was imported, and name of a stage -> counts of its structures and
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
        "\n# A place of the map plus the origin is one of the system [m].\n",
    )
    _write_drives(draft, town)
    overview.draw_overview(
        draft / "from_above.png",
        list(_seen_from_above(town.city.structures)),
        None,
        town.drives,
    )
    return _report_of(town, sizes), sizes


def _write_drives(draft: Path, town: Town) -> None:
    """Writes the drives of a town, at the speed limit of their roads."""
    stages = list(town.stages.stages)
    map_files.write_drives(
        draft,
        {
            stage: "" if stage == stages[-1] else ", not all of it built"
            for stage in stages
        },
        [drive.waypoints for drive in town.drives],
        [
            float(np.clip(drive.limit or _SPEEDS[1], *_SPEEDS))
            for drive in town.drives
        ],
    )


def _report_of(
    town: Town, sizes: Mapping[str, tuple[int, int]]
) -> ImportReport:
    roads = town.roads.roads
    of_file = ("roads", "roads in junctions", "signals", "objects")
    num_elements = town.roads.num_roads
    num_elements += sum(len(road.things) for road in roads)
    return ImportReport(
        kinds=town.kinds,
        triangles=sum(
            structure.model.num_triangles for structure in town.city.structures
        ),
        stages={stage: size[0] for stage, size in sizes.items()},
        undated=0,
        dated=0,
        drives=tuple(drive.length for drive in town.drives),
        faults=town.faults.rows(),
        parts=town.faults.parts(),
        num_elements=num_elements,
        num_built=sum(town.kinds.get(kind, 0) for kind in of_file),
        shares=town.faults.shares({}, num_elements),
    )


def _seen_from_above(
    structures: Iterable[Structure],
) -> Iterable[ImportedObject]:
    """Yields the footprints of structures as flat triangles."""
    for structure in structures:
        if structure.semantic_class not in _SHOWN_CLASSES:
            continue
        area = structure.footprint_W
        if structure.semantic_class == "vegetation":
            area = area.buffer(_CROWN_RADIUS)
        mesh = surface_mesh(area, 0.0, _TILE)
        if mesh.num_triangles:
            triangles = mesh.vertices[mesh.triangles()]
            yield ImportedObject(structure, "", None, triangles)
