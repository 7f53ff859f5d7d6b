"""Packets of rays: Embree proposes what they meet, double precision decides.

Embree tells `_collect` of each triangle of the proxies that a ray may meet, up
to a little beyond the nearest. Then the ray meets the shapes for which these
triangles stand, in double precision and in a fixed order of operations. The
nearest hit is kept: of hits at one range, the first shape. The result therefore
does not depend on the instructions that Embree uses on a processor. If a ray
passes all the shapes, it is cast again, from there on.
"""

import math
from typing import NamedTuple

import numpy as np

from cns_drake.ray_casting.embree import (
    COHERENT_RAYS,
    FILTERED_RAYS,
    INVALID_ID,
    cast_packet,
    prefetch,
    read_double,
    read_int32,
    read_int64,
    read_single,
    read_uint32,
    write_double,
    write_int32,
    write_int64,
    write_single,
)
from cns_drake.ray_casting.proxies import RECORD, SHAPE_NUMBERS
from cns_drake.ray_casting.rays import Hits, Rays
from evaluation.base import compiled, compiled_callback

# Embree treats smaller direction components as positive, whatever their sign. A
# packet that mixes such rays with rays of truly positive components loses hits.
_TINY = 1e-18
# Embree's rays start so far behind the rays [m], and go so far beyond the
# nearest hit [m]: more than the errors of single precision.
_BEHIND = 2.0**-8
_BEYOND = 2.0**-5
# The same as a share of the range.
_ROUNDING = 2.0**-18
# A hit this far beyond the nearest proxy is not the nearest for sure [m].
_AHEAD = _BEYOND / 2.0 - _BEHIND
# Tolerance of a hit beside an edge, as a share of the triangle's size. With it,
# no ray passes between two triangles that share an edge.
_EDGE_TOLERANCE = 1e-9
# Additional tolerance for rounding, relative to the numbers that are rounded.
_ROUNDING_TOLERANCE = 1e-14
# Greatest error of a hit by rounding, as a share of the triangle's size.
_LARGEST_ERROR = 1e-3
# Numbers of the place of a group: X_OL (3, 4); position of L in the frame F
# that moves, in axes of O [m]; rotation vector of F at the start of a
# revolution, and what is added during the revolution [rad]; displacement of F,
# likewise [m]; 1 if F moves, 0 if not.
PLACE_NUMBERS = 28
# What is known of a ray: places in bytes, of numbers of 8 bytes.
_ORIGIN = 0
_DIRECTION = 24
_TIME = 48
# Whether the ray may start between a curved shape and the polyhedron around it.
# It may then meet the shape before, but the polyhedron after other shapes.
_STARTS_NEAR = 56
# The nearest hit: its range, the record of its proxy (0 for none), the row of
# its group, and the normal of the surface in the group's frame L.
_RANGE = 64
_RECORD = 72
_ROW = 80
_NORMAL = 88
# Embree's range of the nearest proxy.
_NEAREST = 112
# The proxies that were collected: how many, and the record and row of each.
_COUNT = 120
_LIST = 128
_CAPACITY = 8
_STATE = _LIST + 16 * _CAPACITY


class Targets(NamedTuple):
    """What packets of rays are cast on.

    Row 0 is the group of static geometry, and row 1 + i that of instance i.

    Attributes:
        lanes: the number of rays in a packet.
        intersect: address of Embree's function for so many rays.
        fixed: address of the RTCScene of static geometry, or 0.
        instances: address of the RTCScene of I instances, or 0.
        tables: (1 + I, 2) int64 addresses of the records and of the shapes of
            each row (see `Proxies`).
        places: (1 + I, PLACE_NUMBERS) float64 where each group is.
        groups: (1 + I,) int32 the group of each row, -1 for none.
        first_member: (1 + I,) int64 index in `geometries` of the group's first
            member.
        geometries: (M,) int32 index of the geometry of each member.
    """

    lanes: int
    intersect: int
    fixed: int
    instances: int
    tables: np.ndarray
    places: np.ndarray
    groups: np.ndarray
    first_member: np.ndarray
    geometries: np.ndarray


def cast_on(
    targets: Targets,
    rays: Rays,
    starts_near: np.ndarray,
    hits: Hits,
    first: int,
    last: int,
) -> None:
    """Casts the rays `first` to `last` - 1.

    Args:
        targets: what the rays are cast on.
        rays: all rays.
        starts_near: (K,) whether each origin may lie between a curved shape and
            the polyhedron around it.
        hits: the hits of all rays, changed in place.
        first: the first ray.
        last: the one after the last ray.
    """
    address = compiled_callback(_collect)
    _cast_packets(targets, address, rays, starts_near, hits, first, last)


@compiled
def _cast_packets(
    targets: Targets,
    collect: int,
    rays: Rays,
    starts_near: np.ndarray,
    hits: Hits,
    first: int,
    last: int,
) -> None:
    """Casts rays in packets; see `cast_on`.

    Directions are rotated here, in double precision and in a fixed order,
    because the result of a matrix library depends on the processor. The
    function is compiled, because a Python call per packet would take longer
    than its rays.
    """
    lanes = targets.lanes
    row = 4 * lanes
    # 64 bytes for the mask of active lanes; 22 rows of a packet: 12 ray fields
    # and 9 hit fields, 10 with room for the primitive of an instance array;
    # what is known of each ray; the context and the arguments of a query.
    memory = np.zeros(8 + 8 + 11 * lanes + _STATE // 8 * lanes + 8 + 8)
    # Aligned as Embree's vector loads demand.
    valid = (memory.ctypes.data + 63) // 64 * 64
    packet = valid + 64
    states = packet + 22 * row
    context = states + _STATE * lanes
    arguments = context + 64
    # RTCRayQueryContext, and what `_collect` reads beyond it.
    write_int64(context, -1)
    write_int64(context + 8, states)
    write_int64(context + 16, targets.tables.ctypes.data)
    write_int64(context + 24, targets.places.ctypes.data)
    # Read as `_collect` does: for another type, `_settle` is compiled again.
    tables, places = read_int64(context + 16), read_int64(context + 24)
    # RTCIntersectArguments.
    write_int32(arguments, COHERENT_RAYS | FILTERED_RAYS)
    write_int32(arguments + 4, -1)
    write_int64(arguments + 8, context)
    write_int64(arguments + 16, collect)
    num_origins, num_rotations = len(rays.p_OSset), len(rays.R_OSset)
    num_ranges, num_times = len(rays.max_ranges), len(rays.times)
    # Indices are incremented: remainders would take a tenth of the casting
    # time.
    origin, rotation = first % num_origins, first % num_rotations
    reach, moment = first % num_ranges, first % num_times
    for begin in range(first, last, lanes):
        count = min(lanes, last - begin)
        for lane in range(count):
            at = packet + 4 * lane
            state = states + _STATE * lane
            ray = begin + lane
            d_x, d_y, d_z = (
                rays.d_Sset[ray, 0],
                rays.d_Sset[ray, 1],
                rays.d_Sset[ray, 2],
            )
            for axis in range(3):
                p = rays.p_OSset[origin, axis]
                d = (
                    rays.R_OSset[rotation, axis, 0] * d_x
                    + rays.R_OSset[rotation, axis, 1] * d_y
                    + rays.R_OSset[rotation, axis, 2] * d_z
                )
                write_double(state + _ORIGIN + 8 * axis, p)
                write_double(state + _DIRECTION + 8 * axis, d)
                write_single(at + axis * row, p - _BEHIND * d)
                if abs(d) < _TINY:
                    d = 0.0
                write_single(at + (4 + axis) * row, d)
            limit = float(rays.max_ranges[reach])
            time = float(rays.times[moment])
            write_double(state + _TIME, time)
            write_int64(state + _STARTS_NEAR, starts_near[origin])
            write_double(state + _RANGE, limit)
            write_int64(state + _RECORD, 0)
            write_double(state + _NEAREST, 0.0)
            write_single(at + 7 * row, time)
            if starts_near[origin]:
                limit = math.inf
            write_single(at + 8 * row, _beyond(limit + _BEHIND))
            write_int32(at + 9 * row, -1)
            write_int32(at + 10 * row, lane)
            write_int32(at + 11 * row, 0)
            origin = origin + 1 if origin + 1 < num_origins else 0
            rotation = rotation + 1 if rotation + 1 < num_rotations else 0
            reach = reach + 1 if reach + 1 < num_ranges else 0
            moment = moment + 1 if moment + 1 < num_times else 0
        for lane in range(lanes):
            write_int32(valid + 4 * lane, -1 if lane < count else 0)
        num_unsettled = count
        while num_unsettled > 0:
            for lane in range(count):
                at, state = packet + 4 * lane, states + _STATE * lane
                # From where the last cast ended.
                start = read_double(state + _NEAREST)
                write_single(at + 3 * row, start)
                write_double(state + _NEAREST, math.inf)
                write_int64(state + _COUNT, 0)
                write_int32(at + 18 * row, -1)
                write_int32(at + 19 * row, -1)
            # Two calls are faster than one scene of two levels: the second call
            # keeps a hit unless it finds a nearer one.
            for scene in (targets.fixed, targets.instances):
                if scene != 0:
                    cast_packet(
                        targets.intersect, valid, scene, packet, arguments
                    )
            num_unsettled = 0
            for lane in range(count):
                state = states + _STATE * lane
                flag = valid + 4 * lane
                if read_int32(flag) == 0:
                    continue
                nearest = read_double(state + _NEAREST)
                _settle(state, tables, places)
                if nearest == math.inf or not (
                    read_int64(state + _STARTS_NEAR) != 0
                    or read_double(state + _RANGE) > nearest + _AHEAD
                ):
                    write_int32(flag, 0)
                    continue
                # All proxies up to here were collected.
                num_unsettled += 1
                at = packet + 4 * lane
                write_double(state + _NEAREST, read_single(at + 8 * row))
                limit = read_double(state + _RANGE)
                if read_int64(state + _STARTS_NEAR) != 0:
                    limit = math.inf
                write_single(at + 8 * row, _beyond(limit + _BEHIND))
        for lane in range(count):
            state = states + _STATE * lane
            record = read_int64(state + _RECORD)
            if record == 0:
                continue
            ray = begin + lane
            group_row = read_int64(state + _ROW)
            member = targets.first_member[group_row] + read_int32(record)
            hits.ranges[ray] = read_double(state + _RANGE)
            hits.owner[ray] = targets.geometries[member]
            hits.group[ray] = targets.groups[group_row]
            for axis in range(hits.normals.shape[1]):
                normal = state + _NORMAL + 8 * axis
                hits.normals[ray, axis] = read_double(normal)
    # Numba frees an array after its last use.
    memory[0] = 0.0


@compiled
def _beyond(distance: float) -> float:
    """Returns how far Embree looks if something is so far away [m]."""
    return distance + distance * _ROUNDING + _BEYOND


def _collect(arguments: int) -> None:
    """Collects proxies that rays may meet (RTCFilterFunctionNArguments)."""
    valid = read_int64(arguments)
    context = read_int64(arguments + 16)
    packet = read_int64(arguments + 24)
    met = read_int64(arguments + 32)
    row = 4 * read_uint32(arguments + 40)
    states = read_int64(context + 8)
    tables = read_int64(context + 16)
    places = read_int64(context + 24)
    for at in range(0, row, 4):
        if read_int32(valid + at) == 0:
            continue
        state = states + _STATE * read_uint32(packet + 10 * row + at)
        group_row = read_uint32(met + 7 * row + at)
        group_row = 0 if group_row == INVALID_ID else group_row + 1
        record = read_int64(tables + 16 * group_row)
        record += RECORD * read_uint32(met + 5 * row + at)
        prefetch(record)
        prefetch(record + RECORD - 1)
        if read_int64(state + _COUNT) == _CAPACITY:
            _settle(state, tables, places)
        count = read_int64(state + _COUNT)
        write_int64(state + _LIST + 16 * count, record)
        write_int64(state + _LIST + 16 * count + 8, group_row)
        write_int64(state + _COUNT, count + 1)
        distance = read_single(packet + 8 * row + at)
        if distance < read_double(state + _NEAREST):
            write_double(state + _NEAREST, distance)
            write_single(packet + 8 * row + at, _beyond(distance))
        else:
            write_int32(valid + at, 0)


@compiled
def _settle(state: int, tables: int, places: int) -> None:
    """Finds the nearest hit of a ray among the proxies that were collected.

    Args:
        state: address of what is known of the ray.
        tables, places: addresses of those of the targets.
    """
    for k in range(read_int64(state + _COUNT)):
        record = read_int64(state + _LIST + 16 * k)
        group_row = read_int64(state + _LIST + 16 * k + 8)
        p_x, p_y, p_z = (
            read_double(state + _ORIGIN),
            read_double(state + _ORIGIN + 8),
            read_double(state + _ORIGIN + 16),
        )
        d_x, d_y, d_z = (
            read_double(state + _DIRECTION),
            read_double(state + _DIRECTION + 8),
            read_double(state + _DIRECTION + 16),
        )
        if group_row > 0:
            p_x, p_y, p_z, d_x, d_y, d_z = _to_group(
                places + 8 * PLACE_NUMBERS * group_row,
                read_double(state + _TIME),
                p_x, p_y, p_z, d_x, d_y, d_z,
            )  # fmt: skip
        shape = read_int32(record + 4)
        if shape < 0:
            distance, n_x, n_y, n_z = _meet_triangle(
                record + 8, p_x, p_y, p_z, d_x, d_y, d_z
            )
        else:
            shapes = read_int64(tables + 16 * group_row + 8)
            distance, n_x, n_y, n_z = _meet_curved(
                shapes + 8 * SHAPE_NUMBERS * shape,
                p_x, p_y, p_z, d_x, d_y, d_z,
            )  # fmt: skip
        best = read_double(state + _RANGE)
        before = read_int64(state + _RECORD)
        if distance == math.inf or distance > best:
            continue
        if distance == best and before != 0:
            row_before = read_int64(state + _ROW)
            if (row_before, before) <= (group_row, record):
                continue
        write_double(state + _RANGE, distance)
        write_int64(state + _RECORD, record)
        write_int64(state + _ROW, group_row)
        write_double(state + _NORMAL, n_x)
        write_double(state + _NORMAL + 8, n_y)
        write_double(state + _NORMAL + 16, n_z)
    write_int64(state + _COUNT, 0)


@compiled
def _to_group(
    place: int,
    time: float,
    p_x: float,
    p_y: float,
    p_z: float,
    d_x: float,
    d_y: float,
    d_z: float,
) -> tuple[float, float, float, float, float, float]:
    """Returns a ray's origin and direction in the frame L of a group.

    Args:
        place: address of the place of the group.
        time: time of the ray, as a fraction of the revolution.
        p_x, p_y, p_z: its origin in O [m].
        d_x, d_y, d_z: its direction in O.
    """
    p_x -= read_double(place + 24)
    p_y -= read_double(place + 56)
    p_z -= read_double(place + 88)
    if read_double(place + 216) != 0.0:
        # Relative to the origin of F, back to where F was.
        f_x = read_double(place + 96)
        f_y = read_double(place + 104)
        f_z = read_double(place + 112)
        p_x += f_x - read_double(place + 168) - time * read_double(place + 192)
        p_y += f_y - read_double(place + 176) - time * read_double(place + 200)
        p_z += f_z - read_double(place + 184) - time * read_double(place + 208)
        r_x = read_double(place + 120) + time * read_double(place + 144)
        r_y = read_double(place + 128) + time * read_double(place + 152)
        r_z = read_double(place + 136) + time * read_double(place + 160)
        p_x, p_y, p_z = _turn_back(r_x, r_y, r_z, p_x, p_y, p_z)
        d_x, d_y, d_z = _turn_back(r_x, r_y, r_z, d_x, d_y, d_z)
        p_x, p_y, p_z = p_x - f_x, p_y - f_y, p_z - f_z
    a, b, c = (
        read_double(place),
        read_double(place + 32),
        read_double(place + 64),
    )
    e, f, g = (
        read_double(place + 8),
        read_double(place + 40),
        read_double(place + 72),
    )
    h, i, j = (
        read_double(place + 16),
        read_double(place + 48),
        read_double(place + 80),
    )
    # The inverse of a rotation is its transpose.
    return (
        a * p_x + b * p_y + c * p_z,
        e * p_x + f * p_y + g * p_z,
        h * p_x + i * p_y + j * p_z,
        a * d_x + b * d_y + c * d_z,
        e * d_x + f * d_y + g * d_z,
        h * d_x + i * d_y + j * d_z,
    )


@compiled
def _turn_back(
    r_x: float, r_y: float, r_z: float, v_x: float, v_y: float, v_z: float
) -> tuple[float, float, float]:
    """Returns a vector turned by a rotation vector's inverse.

    By Rodrigues' formula. The sine and the cosine are sums of their series,
    because those of a library depend on the processor: the angle is halved
    until few terms suffice.
    """
    angle = math.sqrt(r_x * r_x + r_y * r_y + r_z * r_z)
    if angle == 0.0:
        return v_x, v_y, v_z
    half, doublings = angle / 2.0, 0
    while half > 0.125:
        half *= 0.5
        doublings += 1
    square = half * half
    # sin(half), and 1 - cos(half).
    sine = half * (
        1.0
        - square
        / 6.0
        * (1.0 - square / 20.0 * (1.0 - square / 42.0 * (1.0 - square / 72.0)))
    )
    versine = (
        square
        / 2.0
        * (1.0 - square / 12.0 * (1.0 - square / 30.0 * (1.0 - square / 56.0)))
    )
    for _ in range(doublings):
        sine, versine = (
            2.0 * sine * (1.0 - versine),
            2.0 * versine * (2.0 - versine),
        )
    along = 2.0 * sine * (1.0 - versine) / angle
    across = 2.0 * (sine / angle) * (sine / angle)
    inner = across * (r_x * v_x + r_y * v_y + r_z * v_z)
    kept = 1.0 - across * angle * angle
    return (
        kept * v_x - along * (r_y * v_z - r_z * v_y) + inner * r_x,
        kept * v_y - along * (r_z * v_x - r_x * v_z) + inner * r_y,
        kept * v_z - along * (r_x * v_y - r_y * v_x) + inner * r_z,
    )


@compiled
def _meet_triangle(
    triangle: int,
    p_x: float,
    p_y: float,
    p_z: float,
    d_x: float,
    d_y: float,
    d_z: float,
) -> tuple[float, float, float, float]:
    """Returns the range at which a ray meets a triangle, and the normal there.

    After Moeller and Trumbore (1997), with a tolerance at edges.

    Args:
        triangle: address of the numbers of the triangle.
        p_x, p_y, p_z: origin [m].
        d_x, d_y, d_z: unit direction.

    Returns:
        The range [m], inf for a miss; and the normal, of any length.
    """
    c_x, c_y, c_z = (
        read_double(triangle),
        read_double(triangle + 8),
        read_double(triangle + 16),
    )
    a_x = read_double(triangle + 24) - c_x
    a_y = read_double(triangle + 32) - c_y
    a_z = read_double(triangle + 40) - c_z
    b_x = read_double(triangle + 48) - c_x
    b_y = read_double(triangle + 56) - c_y
    b_z = read_double(triangle + 64) - c_z
    s_x, s_y, s_z = p_x - c_x, p_y - c_y, p_z - c_z
    n_x = a_y * b_z - a_z * b_y
    n_y = a_z * b_x - a_x * b_z
    n_z = a_x * b_y - a_y * b_x
    det = -(n_x * d_x + n_y * d_y + n_z * d_z)
    size = abs(a_x) + abs(a_y) + abs(a_z) + abs(b_x) + abs(b_y) + abs(b_z)
    far = abs(s_x) + abs(s_y) + abs(s_z)
    rounding = _ROUNDING_TOLERANCE * size * far
    t_x = s_y * d_z - s_z * d_y
    t_y = s_z * d_x - s_x * d_z
    t_z = s_x * d_y - s_y * d_x
    u = b_x * t_x + b_y * t_y + b_z * t_z
    v = -(a_x * t_x + a_y * t_y + a_z * t_z)
    height = n_x * s_x + n_y * s_y + n_z * s_z
    if det < 0.0:
        det, u, v, height = -det, -u, -v, -height
    slack = -(_EDGE_TOLERANCE * det + rounding)
    is_beside = u < slack or v < slack or det - u - v < slack
    # In the plane of the triangle, as far as numbers tell: the ray meets the
    # edge of a neighbour instead.
    is_edge_on = rounding >= _LARGEST_ERROR * det
    if is_beside or is_edge_on or not height > 0.0:
        return math.inf, 0.0, 0.0, 0.0
    return height / det, n_x, n_y, n_z


@compiled
def _meet_curved(
    shape: int,
    p_x: float,
    p_y: float,
    p_z: float,
    d_x: float,
    d_y: float,
    d_z: float,
) -> tuple[float, float, float, float]:
    """Returns the range at which a ray meets a curved shape, and the normal.

    Args:
        shape: address of the numbers of the shape.
        p_x, p_y, p_z: origin [m].
        d_x, d_y, d_z: unit direction.

    Returns:
        The range [m], inf for a miss; and the normal, of any length.
    """
    q_x, q_y, q_z = (
        _row(shape, p_x, p_y, p_z) + read_double(shape + 24),
        _row(shape + 32, p_x, p_y, p_z) + read_double(shape + 56),
        _row(shape + 64, p_x, p_y, p_z) + read_double(shape + 88),
    )
    e_x, e_y, e_z = (
        _row(shape, d_x, d_y, d_z),
        _row(shape + 32, d_x, d_y, d_z),
        _row(shape + 64, d_x, d_y, d_z),
    )
    half = read_double(shape + 96)
    square = read_double(shape + 104) * read_double(shape + 104)
    is_cylinder = read_double(shape + 112) != 0.0
    nearest = math.inf
    n_x = n_y = n_z = 0.0
    # The straight part (0), and the ends.
    for part in range(-1, 2):
        if part == 0 or not is_cylinder:
            # A circle or a sphere: both of its roots.
            c_z = (q_z - part * half) * abs(part)
            e_c = e_z * abs(part)
            a = e_x * e_x + e_y * e_y + e_c * e_c
            b = q_x * e_x + q_y * e_y + c_z * e_c
            under = b * b - a * (q_x * q_x + q_y * q_y + c_z * c_z - square)
            if not (a > 0.0 and under >= 0.0):
                continue
            root = math.sqrt(under)
            for side in (-root, root):
                distance = (side - b) / a
                z = q_z + distance * e_z
                if part == 0:
                    is_on = abs(z) <= half
                else:
                    is_on = part * z >= half
                if is_on and 0.0 < distance < nearest:
                    nearest = distance
                    n_x = q_x + distance * e_x
                    n_y = q_y + distance * e_y
                    n_z = c_z + distance * e_c
        elif e_z != 0.0:
            distance = (part * half - q_z) / e_z
            x, y = q_x + distance * e_x, q_y + distance * e_y
            if x * x + y * y <= square and 0.0 < distance < nearest:
                nearest = distance
                n_x, n_y, n_z = 0.0, 0.0, float(part)
    return (
        nearest,
        _column(shape, n_x, n_y, n_z),
        _column(shape + 8, n_x, n_y, n_z),
        _column(shape + 16, n_x, n_y, n_z),
    )


@compiled
def _row(matrix: int, x: float, y: float, z: float) -> float:
    """Returns the product of a row of a (3, 4) matrix and a vector."""
    return (
        read_double(matrix) * x
        + read_double(matrix + 8) * y
        + read_double(matrix + 16) * z
    )


@compiled
def _column(matrix: int, x: float, y: float, z: float) -> float:
    """Returns the product of a column of a (3, 4) matrix and a vector."""
    return (
        read_double(matrix) * x
        + read_double(matrix + 32) * y
        + read_double(matrix + 64) * z
    )
