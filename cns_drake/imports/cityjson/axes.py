"""The order in which a CityJSON file has the coordinates east and north."""

from collections.abc import Iterator
import itertools

import numpy as np

from cns_drake.imports.cityjson.city_file import CityFile

# A city is mirrored if less than this share of its geometries look outwards.
_MIRRORED_SHARE = 0.1
# At most this many geometries are judged.
_MOST_JUDGED = 1000
# A geometry is judged if six times the volume of a solid [m^3], or twice the
# area of other surfaces as seen from above [m^2], is greater than this.
_LEAST_JUDGED = 1e-3
# Type of a face -> 1 if the face must look upwards, -1 if downwards.
_UP_OR_DOWN = {"RoofSurface": 1.0, "GroundSurface": -1.0}
_UP_OR_DOWN_IN_TERRAIN = {**_UP_OR_DOWN, "": 1.0}
_BEYOND = "coordinates beyond the area of their reference system"


def settle_axes(city: CityFile, vertices: np.ndarray) -> None:
    """Decides which of the first two coordinates is east, if it can.

    Many programs write east first although the definition of the reference
    system says north first. East first is assumed if only this order brings the
    middle vertex of the file into the system's area of use.

    In two cases, the order stays open, and `exchange_mirrored_axes` decides by
    the faces: both orders bring the vertex into the area, or the system is
    defined as east first and only north first brings the vertex there.

    An exchange counts as a fault of the city. It also counts as a fault if the
    vertex is outside the area and the order is not exchanged here.

    Args:
        city: the city, whose objects are not read yet. Without a reference
            system, the function does nothing.
        vertices: (N, 3) vertices of the file in its own coordinates, N > 0.
    """
    defined = city.system
    if not defined.name:
        return
    first, second, _ = vertices[len(vertices) // 2].tolist()
    is_there = defined.has_place(first, second)
    city.order_is_open = defined.has_place(second, first)
    if city.order_is_open and not is_there and defined.is_north_first:
        city.order_is_open = False
        _exchange_axes(city)
    elif not is_there:
        city.faults.add(_BEYOND, defined.name)


def _exchange_axes(city: CityFile) -> None:
    """Exchanges the first two coordinates of the system and of all faces."""
    defined = city.system
    city.system = defined.exchanged()
    turn = city.system.matrix @ np.linalg.inv(defined.matrix)
    for face in city.faces():
        face[:] = [ring @ turn.T for ring in face]
    order = [axis.partition(" ")[0] for axis in defined.axes[:2]]
    city.faults.add(
        f"reference system with {order[0]} first, but coordinates with"
        f" {order[1]} first; read as {order[1]} first",
        defined.name,
    )


def exchange_mirrored_axes(city: CityFile) -> None:
    """Exchanges the first two coordinates if the city is mirrored otherwise.

    The corners of a face are counter-clockwise as seen from outside; in a
    mirrored city, faces are inside out. Coordinates are exchanged only if
    `settle_axes` has left their order open. Without a reference system, a
    mirrored city is counted as a fault. An order that is open is counted as
    well, if no face can be judged and north is first.
    """
    if city.system.name and not city.order_is_open:
        return
    outwards = list(itertools.islice(_look_outwards(city), _MOST_JUDGED))
    if not outwards:
        if city.system.is_north_first:
            kind = "order of axes that no face shows, taken as defined"
            city.faults.add(kind, city.system.name)
    elif sum(outwards) < _MIRRORED_SHARE * len(outwards):
        if city.order_is_open:
            _exchange_axes(city)
            if any(fault.kind == _BEYOND for fault in city.faults.rows()):
                city.faults.take_back(_BEYOND)
        elif len(outwards) > 1:
            city.faults.add(
                "all inside out: the city may be mirrored (north first?)",
                "the file",
            )


def _look_outwards(city: CityFile) -> Iterator[bool]:
    """Yields for each geometry whether its faces look outwards.

    A solid whose faces look outwards has a positive volume. Roofs and terrains
    must look upwards, and floors downwards. Geometries are left out if their
    volume or area is too small to judge.
    """
    for city_object in city.objects.values():
        is_terrain = city_object.object_type == "TINRelief"
        signs = _UP_OR_DOWN_IN_TERRAIN if is_terrain else _UP_OR_DOWN
        for geometry in city_object.geometries:
            if not geometry.faces:
                continue
            first = geometry.faces[0][0][0]
            size = 0.0
            for face, kind in zip(geometry.faces, geometry.kinds, strict=True):
                for ring in face:
                    p = ring - first
                    # Normal of the ring, as long as twice its area.
                    normal = np.cross(p, np.roll(p, -1, axis=0)).sum(axis=0)
                    if geometry.is_solid:
                        size += float(p[0] @ normal)
                    else:
                        size += signs.get(kind, 0.0) * float(normal[2])
            if abs(size) > _LEAST_JUDGED:
                yield size > 0.0
