"""Makes all structures of a city from a road network and a plan."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from shapely import GEOSException
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry
from shapely.ops import unary_union

from evaluation.base import InputError, value_errors
from worlds.city.buildings import ARCHETYPES
from worlds.city.city_plan import CityPlan, load_plan
from worlds.city.ground.coverings import GROUND_TAG
from worlds.city.ground.districts import share_out
from worlds.city.ground.elevation import Ground, Pad, aprons, make_ground
from worlds.city.ground.markings import marking_structure
from worlds.city.ground.streets import kerb_height, street_structures
from worlds.city.ground.terrain import (
    GroundShape,
    bridge_structures,
    ground_structures,
)
from worlds.city.placement import sidewalks
from worlds.city.placement.building_rows import place_buildings
from worlds.city.placement.draft import Draft
from worlds.city.placement.junctions import furnish_junctions
from worlds.city.placement.open_ground import furnish_district
from worlds.city.placement.parking import park_along_streets
from worlds.maps import MapFolder
from worlds.roads import (
    Areas,
    KerbMap,
    RoadNetwork,
    RoadSurface,
    SurfaceHeights,
    load_road_network,
)
from worlds.shapes import OBJECTS, Structure, UpperSides, ground_triangles, snap


class City(NamedTuple):
    """A city: its structures, and the kinds of its parked cars.

    Attributes:
        structures: all structures, ground first.
        cars: name of a kind of car -> its weight in random choices.
    """

    structures: tuple[Structure, ...]
    cars: Mapping[str, float]


class CityStreets(NamedTuple):
    """The streets along which a city is built; all areas are in W [m].

    Attributes:
        areas: carriageways, sidewalks and medians.
        surface: heights of the carriageways.
        kerb_height: height of sidewalks above the carriageway [m], at places
            where `kerbs` gives no height.
        junctions: area of all junctions.
        margins: strips beside the streets on which nothing is built. Buildings
            stand along these strips.
        reserved: further area in which nothing is built or planted.
        structures: structures of the streets themselves.
        furnish: function that places the objects of the streets. It is called
            after the buildings are placed and before all other objects.
        park: function that parks cars in the streets. It is called last.
        kerbs: height of the kerb by place; None if the height is `kerb_height`
            everywhere.
        pads: level ground outside of the streets, such as below bridges.
    """

    areas: Areas
    surface: SurfaceHeights
    kerb_height: float
    junctions: BaseGeometry
    margins: BaseGeometry
    reserved: BaseGeometry
    structures: Sequence[Structure]
    furnish: Callable[[Draft], None]
    park: Callable[[Draft], None]
    kerbs: KerbMap | None = None
    pads: Sequence[Pad] = ()


def make_city(world: Path) -> City:
    """Returns the city of a map folder, from its `roads.yaml` and `city.yaml`.

    No file is written.

    Raises:
        InputError: if one of the files cannot be used.
    """
    roads = MapFolder(world).roads
    network = load_road_network(roads)
    with value_errors(roads):
        _ = network.areas
    source = MapFolder(world).plan
    plan = load_plan(source)
    try:
        return lay_out(network, plan, str(source))
    except GEOSException as error:
        raise InputError(
            f"{source}: a shape cannot be used: {error}"
        ) from error


def lay_out(network: RoadNetwork, plan: CityPlan, source: str) -> City:
    """Makes a city from a road network and a plan.

    `source` is the file of the plan, named in error messages.

    Raises:
        InputError: if the plan names something unknown, or something in the
            plan has no room.
    """
    streets = CityStreets(
        areas=network.areas,
        surface=RoadSurface(network),
        kerb_height=kerb_height(network),
        junctions=unary_union(list(network.junction_areas.values())),
        margins=Polygon(),
        reserved=Polygon(),
        structures=(*street_structures(network), marking_structure(network)),
        furnish=lambda draft: furnish_junctions(draft, network),
        park=lambda draft: park_along_streets(draft, network),
    )
    return build_along(streets, plan, source)


def build_along(streets: CityStreets, plan: CityPlan, source: str) -> City:
    """Returns a city along given streets.

    Args:
        streets: the streets.
        plan: plan of what stands along the streets.
        source: file of the plan, named in error messages.

    Raises:
        InputError: if the plan names something unknown, or something in the
            plan has no room.
    """
    _check_names(plan, source)
    draft = Draft(streets.areas, streets.kerb_height, plan, source)
    for area in (streets.margins, streets.reserved):
        if not area.is_empty:
            draft.take(area)
    if not streets.margins.is_empty:
        draft.frontage = snap(draft.streets.union(streets.margins))
    districts = share_out(plan, draft.streets, source)
    kerb = streets.kerbs or streets.kerb_height

    def ground_with(pads: Sequence[Pad]) -> Ground:
        return make_ground(
            streets.surface, kerb, draft.streets, plan.bounds, pads
        )

    terraces = [pad for district in districts for pad in district.terraces]
    terraces += streets.pads
    draft.base = ground_with(terraces)
    for district in districts:
        place_buildings(draft, district)
    level = aprons(draft.structures, draft.streets)
    draft.base = ground_with([*level, *terraces])
    shape = GroundShape(
        draft.base,
        districts,
        unary_union(
            [s.footprint_W for s in draft.structures]
            + [pad.area for pad in draft.base.pads]
        ),
        lambda name: draft.rng(name, "relief"),
    )
    ground = [
        *streets.structures,
        *ground_structures(districts, shape, plan.water_level),
        *bridge_structures(districts, draft.streets, shape, plan.water_level),
    ]
    surfaces = [one for one in ground if GROUND_TAG in one.tags]
    draft.ground = UpperSides(ground_triangles(surfaces))
    streets.furnish(draft)
    for district in districts:
        furnish_district(draft, district)
    sidewalks.furnish_sidewalks(draft, districts, streets.junctions)
    streets.park(draft)
    sidewalks.plant_medians(draft)
    return City((*ground, *draft.structures), plan.cars)


def _check_names(plan: CityPlan, source: str) -> None:
    """Checks that all names in a plan are known."""

    def require(field: str, names: Iterable[str]) -> None:
        registry = ARCHETYPES if field.endswith(".rows") else OBJECTS
        for name in names:
            if name not in registry:
                raise InputError(f"{source}: {field}: unknown name {name}")

    streets = [("street", plan.street), ("medians", plan.medians)]
    for district in plan.districts:
        field = f"districts.{district.name}"
        streets.append((f"{field}.street", district.street))
        for row in district.rows:
            require(f"{field}.rows", row.archetypes)
        for line in district.lines:
            require(f"{field}.lines", line.objects)
        for scatter in district.scatter:
            require(f"{field}.scatter", scatter.objects)
        objects = [entry.object for entry in district.objects]
        require(f"{field}.objects", objects)
    require("cars", plan.cars)
    for field, street in streets:
        if street is not None:
            require(field, [*street.trees, street.lamp, *street.furniture])
