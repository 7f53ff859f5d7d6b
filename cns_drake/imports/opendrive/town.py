"""A town on an imported road network, filled by the city generator."""

from __future__ import annotations

from collections.abc import Callable, Sequence, Set
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from shapely import GEOSException

from cns_drake.base.errors import InputError
from cns_drake.city.generation.city_structures import (
    City,
    Streets,
    build_along,
)
from cns_drake.city.generation.starter import starter_plan, starter_stages
from cns_drake.city.geometry.structures import Structure
from cns_drake.city.ground.streets import street_surfaces
from cns_drake.city.placement.draft import Draft
from cns_drake.city.placement.open_ground import place_car
from cns_drake.city.plan.city_plan import CityPlan
from cns_drake.city.plan.stages import Stages
from cns_drake.imports.import_faults import ImportFaults
from cns_drake.imports.opendrive.bridge_decks import bridge_decks, bridge_ends
from cns_drake.imports.opendrive.imported_streets import (
    ImportedStreets,
    lane_polygon,
)
from cns_drake.imports.opendrive.lane_bands import LaneBand, lane_bands
from cns_drake.imports.opendrive.lane_drives import find_lane_drives
from cns_drake.imports.opendrive.lane_traffic import lanes_for_traffic
from cns_drake.imports.opendrive.road_heights import RoadHeights
from cns_drake.imports.opendrive.road_levels import split_levels
from cns_drake.imports.opendrive.road_marks import road_marks
from cns_drake.imports.opendrive.road_model import RoadMap
from cns_drake.imports.opendrive.road_reader import read_roads
from cns_drake.imports.opendrive.thing_structures import thing_structures
from cns_drake.imports.waypoint_drives import WaypointDrive

# Height of sidewalks by default [m].
_KERB = 0.1
_KERBS = (0.03, 0.3)
# Largest ground that the generator fills [m^2, m].
_LARGEST_AREA = 8e6
_LONGEST_SIDE = 9000.0
# Cars in parking lanes: length of a bay, share of taken bays, and least width
# of a lane [m].
_BAY = (5.8, 7.4)
_FILL = 0.6
_BAY_WIDTH = 1.9


@dataclass(frozen=True)
class Town:
    """A town, and the result of its import.

    Attributes:
        roads: of the file.
        seed: of the random draws.
        city: everything, in all stages.
        stages: the differences between the stages.
        streets: the areas of the roads that lie on the ground.
        drives: two, or fewer, through it.
        lanes: the text of the file of lanes; None without lanes for traffic.
        kinds: kind of thing -> number.
        faults: counts of repaired and omitted parts.
    """

    roads: RoadMap
    seed: int
    city: City
    stages: Stages
    streets: ImportedStreets
    drives: list[WaypointDrive]
    lanes: str | None
    kinds: dict[str, int]
    faults: ImportFaults


def build_town(
    source: Path,
    seed: int,
    progress: Callable[[str], None] = lambda line: None,
    dressed: bool = False,
) -> Town:
    """Reads a road network and builds a town along it.

    Args:
        source: OpenDRIVE.
        seed: of the generator's draws.
        progress: takes one line at a time.
        dressed: whether the file's road marks are painted.

    Raises:
        InputError: if the file cannot be used.
    """
    faults = ImportFaults()
    roads = read_roads(source, faults)
    try:
        return _build(source, roads, seed, faults, progress, dressed)
    except GEOSException as error:
        raise InputError(
            f"{source}: an area cannot be used: {error}"
        ) from error


def _build(
    source: Path,
    roads: RoadMap,
    seed: int,
    faults: ImportFaults,
    progress: Callable[[str], None],
    dressed: bool,
) -> Town:
    try:
        bands = [band for road in roads.roads for band in lane_bands(road)]
    except ValueError as error:
        raise InputError(f"{source}: {error}") from error
    ground, raised = split_levels(bands)
    ends = bridge_ends(raised)
    streets = ImportedStreets(ground, ends)
    if streets.carriageway().is_empty:
        raise InputError(f"{source}: no lane in it has an area")
    x0, y0, x1, y1 = streets.carriageway().bounds
    sides = x1 - x0, y1 - y0
    if sides[0] * sides[1] > _LARGEST_AREA or max(sides) > _LONGEST_SIDE:
        raise InputError(
            f"{source}: roads of {sides[0]:.0f} m by {sides[1]:.0f} m; cut out"
            f" a piece of at most {_LARGEST_AREA / 1e6:.0f} km^2 and"
            f" {_LONGEST_SIDE / 1000:.0f} km"
        )
    plan = CityPlan.model_validate(starter_plan(streets, seed))
    lanes = streets.lane_area()
    things = [
        one
        for road in roads.roads
        for one in thing_structures(road, lanes, faults)
    ]
    decks = list(bridge_decks(raised))
    kerb = _kerb(ground)
    surface = RoadHeights(ground)
    marks: list[Structure] = []
    if dressed:
        _count_spans(roads, {band.road.name for band in raised}, faults)
        marks += road_marks(
            "marks", ground, surface.heights, streets.carriageway()
        )
        marks += road_marks("bridge_marks", raised)
    progress(
        f"{len(roads.roads)} roads, {len(things)} signals and objects;"
        " building along them"
    )
    city = build_along(
        Streets(
            areas=streets,
            surface=surface,
            kerb_height=kerb,
            junctions=streets.junctions,
            margins=streets.margins,
            reserved=shapely.union_all(
                [
                    *(lane_polygon(band) for band in raised),
                    *(one.footprint_W for one in things),
                ]
            ),
            structures=(
                *street_surfaces(
                    streets,
                    surface,
                    kerb,
                    streets.coverings,
                    ends,
                ),
                *decks,
                *things,
                *marks,
            ),
            furnish=lambda draft: None,
            park=lambda draft: _park(draft, ground, plan.cars),
        ),
        plan,
        str(source),
    )
    imported = {one.name for one in (*decks, *things, *marks)}
    generated = [one for one in city.structures if one.name not in imported]
    stages = starter_stages(City(tuple(generated), city.cars))
    return Town(
        roads,
        seed,
        city,
        Stages.model_validate(stages),
        streets,
        find_lane_drives(bands),
        lanes_for_traffic(bands, kerb),
        _kinds(roads, things, decks, marks, generated),
        faults,
    )


def _count_spans(
    roads: RoadMap, raised: Set[str], faults: ImportFaults
) -> None:
    """Counts the bridges and tunnels of a file that are not built.

    Args:
        roads: of the file.
        raised: names of the roads that pass over others on decks.
        faults: takes the counts.
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


def _park(
    draft: Draft, bands: Sequence[LaneBand], cars: dict[str, float]
) -> None:
    """Parks cars in parking lanes, facing with the traffic."""
    for band in bands:
        if band.kind != "parking" or band.width.min() < _BAY_WIDTH:
            continue
        draft.open_range()
        rng = draft.rng(
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
            taken = rng.uniform() < _FILL
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
    junctions = {road.junction for road in roads.roads} - {None}
    kinds = {
        "roads": sum(road.junction is None for road in roads.roads),
        "roads in junctions": sum(
            road.junction is not None for road in roads.roads
        ),
        "junctions": len(junctions),
        "signals": sum("signal" in one.tags for one in things),
        "objects": sum("object" in one.tags for one in things),
        "bridges": sum(one.semantic_class == "road" for one in decks),
        "roads with marks": len(marks),
        "buildings, drawn at random": sum(
            one.semantic_class == "building" for one in generated
        ),
        "plants, drawn at random": sum(
            one.semantic_class == "vegetation" for one in generated
        ),
    }
    return {kind: number for kind, number in kinds.items() if number}
