"""First hits of beams: returning light, and continued rays."""

from __future__ import annotations

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.sensors.returns.footprint import Sides
from cns_drake.sensors.returns.light import Light
from cns_drake.sensors.returns.materials import GLASS, LEAVES, Materials
from cns_drake.sensors.returns.met import Met, copy_hit
from cns_drake.sensors.returns.propagation import Ways, add_light


def start_ways(
    beam: np.ndarray,
    row_of_beam: np.ndarray,
    p_WSset: np.ndarray,
    times: np.ndarray,
    rest: np.ndarray,
    met: Met,
    sides: Sides,
    side_met: Met,
    materials: Materials,
) -> tuple[Light, Light, Ways, Met]:
    """Returns what opaque surfaces send back, and the rays that meet others.

    Args:
        beam: (N,) number of each beam.
        row_of_beam: (N,) the inverse of that.
        p_WSset: (K, 3) positions of S, taken in turn.
        times: (T,) parts of the turn, taken in turn.
        rest: (N,) part of the light that its axis represents.
        met: by the axes of the beams.
        sides: rays at the sides of beams.
        side_met: by those; misses do not count.
        materials: of all geometries.

    Returns:
        The light along the axes of beams, at most one part for each beam and
        sorted by it, the light along rays at their sides, the rays that meet
        panes or leaves, and what they meet.
    """
    is_open = (materials.kind == GLASS) | (materials.kind == LEAVES)
    axes, others = Light.room_for(len(beam)), Light.room_for(len(sides.ray))
    count = _count(is_open, met.geometry) + _count(is_open, side_met.geometry)
    ways_met = Met.room_for(count)
    ways = Ways.room_for(count)._replace(d_Wset=ways_met.d_Wset)
    num_axes = _light_axes(row_of_beam, rest, met, materials, is_open, axes)
    num_others, num_ways = _start_ways(
        beam,
        p_WSset,
        times,
        rest,
        met,
        sides,
        side_met,
        materials,
        is_open,
        others,
        ways,
        ways_met,
    )
    return (
        axes.first(num_axes),
        others.first(num_others),
        ways.first(num_ways),
        ways_met.first(num_ways),
    )


@compiled
def _count(is_open: np.ndarray, geometry: np.ndarray) -> int:
    count = 0
    for one in geometry:
        if one >= 0 and is_open[one]:
            count += 1
    return count


@compiled
def _light_axes(
    row_of_beam: np.ndarray,
    rest: np.ndarray,
    met: Met,
    materials: Materials,
    is_open: np.ndarray,
    light: Light,
) -> int:
    """Fills in what comes back along axes of beams; returns how much."""
    num_parts = 0
    for beam in range(len(row_of_beam)):
        row = row_of_beam[beam]
        geometry = met.geometry[row]
        if geometry < 0 or rest[row] <= 0.0 or is_open[geometry]:
            continue
        add_light(
            light,
            num_parts,
            beam,
            met.ranges[row],
            materials,
            geometry,
            met.cosine[row],
            rest[row],
        )
        num_parts += 1
    return num_parts


@compiled
def _start_ways(
    beam: np.ndarray,
    p_WSset: np.ndarray,
    times: np.ndarray,
    rest: np.ndarray,
    met: Met,
    sides: Sides,
    side_met: Met,
    materials: Materials,
    is_open: np.ndarray,
    light: Light,
    ways: Ways,
    ways_met: Met,
) -> tuple[int, int]:
    """Fills in what else comes back, and what goes on; returns how many."""
    num_parts, num_ways = 0, 0
    for row in range(len(beam)):
        geometry = met.geometry[row]
        if geometry < 0 or rest[row] <= 0.0 or not is_open[geometry]:
            continue
        copy_hit(met, row, ways_met, num_ways)
        _start(ways, num_ways, beam, row, 0, p_WSset, times, rest[row])
        num_ways += 1
    for side in range(len(sides.ray)):
        geometry, row = side_met.geometry[side], sides.ray[side]
        if geometry < 0:
            continue
        share = sides.share[side]
        if is_open[geometry]:
            copy_hit(side_met, side, ways_met, num_ways)
            number = 1 + sides.number[side]
            _start(ways, num_ways, beam, row, number, p_WSset, times, share)
            num_ways += 1
        else:
            add_light(
                light,
                num_parts,
                beam[row],
                side_met.ranges[side],
                materials,
                geometry,
                side_met.cosine[side],
                share,
            )
            num_parts += 1
    return num_parts, num_ways


@compiled
def _start(
    ways: Ways,
    way: int,
    beam: np.ndarray,
    row: int,
    sub: int,
    p_WSset: np.ndarray,
    times: np.ndarray,
    share: float,
) -> None:
    """Fills in a ray from the unit, without its direction."""
    ways.beam[way] = beam[row]
    ways.sub[way] = sub
    ways.time[way] = times[row % len(times)]
    for axis in range(3):
        ways.p_Wset[way, axis] = p_WSset[row % len(p_WSset), axis]
    ways.length[way] = 0.0
    ways.energy[way] = share
    ways.depth[way] = np.inf
    ways.inside[way] = -1
    ways.reach[way] = np.inf
