"""Small things along streets: those of the file, and others at random."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from shapely.geometry import LineString, MultiLineString

from cns_drake.city.plan.weighted import pick
from cns_drake.imports.dressing.guessed_streets import HALF_STREET
from cns_drake.imports.dressing.roadside import (
    FROM_EDGE,
    beside_street,
    place_along,
)
from cns_drake.imports.dressing.street_parking import (
    ROWS_WITHIN,
    fill_car_park,
    may_park_on,
    park_along,
)
from cns_drake.imports.dressing.street_room import (
    StreetRoom,
    StreetThings,
    title_of,
)
from cns_drake.imports.drives.search import WaypointDrive
from cns_drake.imports.foreign_city import (
    Imported,
    Street,
    Thing,
    lot_generator,
)
from cns_drake.imports.ground import Ground

# Things farther from all drives are left out [m].
_THINGS_WITHIN = 100.0
# Lamps at random: their distance, and the range in which a lamp of the file
# replaces one [m].
_LAMP_EVERY, _LAMP_NEAR = 27.0, 35.0
_SMALL_EVERY = 22.0
_SMALL = {
    "litter_bin": 3.0,
    "bench": 2.0,
    "bicycle_rack": 2.0,
    "bollard": 2.0,
    "cabinet": 1.0,
    "post_box": 0.5,
    "hydrant": 1.0,
    "sign_round": 2.0,
    "sign_rectangular": 1.0,
}


def dress_streets(
    structures: Sequence[Imported],
    things: Sequence[Thing],
    streets: Sequence[Street],
    drives: Sequence[WaypointDrive],
    ground: Ground,
    seed: int,
) -> StreetThings:
    """Returns the small things along the streets of a city.

    Args:
        structures: those of all stages.
        things: of the file.
        streets: of the file.
        drives: kept free of things; without any nothing is placed.
        ground: below the city.
        seed: of the random draws.
    """
    found = StreetThings()
    if not drives:
        return found
    placing = StreetRoom(structures, drives, ground, found)
    near = [s for s in streets if placing.is_near(s.line, _THINGS_WITHIN)]
    courses = [LineString(street.line) for street in near]
    lines = MultiLineString(courses)
    for one in structures:
        if one.kind == "Tree":
            placing.keep_tree(_off_carriageway(placing, one, near, courses))
    for number, thing in enumerate(things):
        if placing.is_near(np.array([thing.xy] * 2), _THINGS_WITHIN):
            _place_thing(placing, thing, number, near, courses, seed)
    for one in structures:
        if one.kind == "Parking":
            fill_car_park(placing, one, seed)
    rows = list(_rows(near, drives))
    for name, line, half, may_park in rows:
        if placing.is_near(np.array(line.coords), ROWS_WITHIN):
            rng = lot_generator(seed, "row", name)
            park_along(placing, name, line, half, may_park, lines, rng)
            _light(placing, name, line, half, rng)
            if not things:
                _furnish(placing, name, line, half, rng)
    return found


def _rows(
    streets: Sequence[Street], drives: Sequence[WaypointDrive]
) -> Iterator[tuple[str, LineString, float, tuple[bool, bool]]]:
    """Yields name, middle, half width, and whether cars park, of streets.

    Cars may park on the right, and on the left.
    """
    for street in streets:
        may_park = (may_park_on("right", street), may_park_on("left", street))
        half = street.width / 2.0
        yield street.name, LineString(street.line), half, may_park
    if not streets:
        for number, drive in enumerate(drives):
            line = LineString(drive.path)
            yield f"drive_{number}", line, HALF_STREET, (True, True)


def _off_carriageway(
    placing: StreetRoom,
    tree: Imported,
    streets: Sequence[Street],
    courses: Sequence[LineString],
) -> Imported:
    """Returns a tree beside the carriageway, if it was on it or its kerb."""
    structure = tree.structure
    xy = np.array(structure.xyz[:2])
    if not streets or not placing.is_near(np.array([xy] * 2), _THINGS_WITHIN):
        return tree
    beside, _ = beside_street(xy, streets, courses)
    if np.array_equal(beside, xy) or not placing.has_tree_pit(beside):
        return tree
    x, y = np.round(beside, 3).tolist()
    z = structure.xyz[2]
    moved = replace(
        tree,
        structure=replace(structure, xyz=(x, y, z)),
        triangles=tree.triangles + np.array([x - xy[0], y - xy[1], 0.0]),
    )
    placing.found.moved[structure.name] = moved
    return moved


def _place_thing(
    placing: StreetRoom,
    thing: Thing,
    number: int,
    streets: Sequence[Street],
    courses: Sequence[LineString],
    seed: int,
) -> None:
    name = f"{thing.kind}_{thing.source}"
    if thing.source.startswith("w"):
        name += f"_{number}"
    xy, yaw = np.array(thing.xy), thing.yaw
    if streets:
        xy, towards = beside_street(xy, streets, courses)
        yaw = towards if yaw is None else yaw
    rng = lot_generator(seed, "thing", name)
    at = (float(xy[0]), float(xy[1]))
    if placing.place(name, thing.kind, at, yaw or 0.0, rng):
        placed_last = placing.found.structures[-1].structure.name
        placing.found.from_file.add(placed_last)
        placing.found.sources.add(thing.source)
        placing.found.by_file[title_of(thing.kind)] += 1
    else:
        placing.found.no_room += 1


def _light(
    placing: StreetRoom,
    name: str,
    line: LineString,
    half: float,
    rng: np.random.Generator,
) -> None:
    """Sets lamps along a street where the file has none."""
    s, side = float(rng.uniform(3.0, 12.0)), 1.0
    while s < line.length:
        for offset in (half + FROM_EDGE, half - 0.4, 2.3):
            xy, yaw = place_along(line, s, side, offset)
            if any(
                np.hypot(x - xy[0], y - xy[1]) < min(_LAMP_NEAR, _LAMP_EVERY)
                for x, y in placing.lamps
            ):
                break
            # The lamp's arm reaches over the street.
            yaw += side * np.pi / 2.0
            lamp = f"lamp_post_{name}_{int(s)}"
            if placing.place(lamp, "lamp_post", xy, yaw, rng):
                placing.found.by_lot["Lamp post"] += 1
                break
        s, side = s + _LAMP_EVERY, -side


def _furnish(
    placing: StreetRoom,
    name: str,
    line: LineString,
    half: float,
    rng: np.random.Generator,
) -> None:
    """Sets small things along a street if the file has none at all."""
    s = float(rng.uniform(3.0, 12.0))
    while s < line.length:
        side = 1.0 if rng.random() < 0.5 else -1.0
        kind = pick(_SMALL, rng)
        xy, yaw = place_along(line, s, side, half + FROM_EDGE)
        yaw += side * np.pi / 2.0
        if placing.place(f"{kind}_{name}_{int(s)}", kind, xy, yaw, rng):
            placing.found.by_lot[title_of(kind)] += 1
        s += float(rng.uniform(0.6, 1.4)) * _SMALL_EVERY
