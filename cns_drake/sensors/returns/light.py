"""The hits of rays, and the light that returns along them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.ray_casting.ray_casting_scene import SceneHits
from cns_drake.sensors.returns.materials import BEADS, RETRO, Materials

# The retro-reflective sheeting of signs and plates works up to this angle.
_RETRO_COSINE = 0.5

# A named tuple of arrays with as many rows each.
_Table = TypeVar("_Table", bound=Any)


def select(table: _Table, rows: np.ndarray) -> _Table:
    """Returns some rows of a table, which is a named tuple of arrays.

    Args:
        table: named tuple of arrays with N rows each.
        rows: indices of the rows, or a mask (N,).
    """
    if rows.dtype == bool:
        rows = np.flatnonzero(rows)
    return table._make(values.take(rows, axis=0) for values in table)


def join(tables: Sequence[_Table]) -> _Table:
    """Concatenates the rows of tables, which are named tuples of arrays."""
    return tables[0]._make(map(np.concatenate, zip(*tables, strict=True)))


class BeamHits(NamedTuple):
    """The hits of N rays.

    Attributes:
        d_Wset: (N, 3) float64 unit directions of the rays in the world.
        ranges: (N,) float64 ranges with the precision of float32 [m]; inf for a
            miss.
        geometry: (N,) int32 index of the geometry that was hit; -1 for a miss.
        normals_W: (N, 3) float32 unit normals in the world that face the rays'
            origins; zero for a miss.
        is_outside: (N,) bool, whether the ray hit the outside of a surface.
        cosine: (N,) float64 cosine of the angle of incidence.
    """

    d_Wset: np.ndarray
    ranges: np.ndarray
    geometry: np.ndarray
    normals_W: np.ndarray
    is_outside: np.ndarray
    cosine: np.ndarray

    @classmethod
    def of(cls, d_Wset: np.ndarray, hits: SceneHits) -> BeamHits:
        """Returns the hits of N rays, with the cosines of their incidence.

        Args:
            d_Wset: (N, 3) unit directions of the rays in the world.
            hits: result of casting the rays, with normals.
        """
        cosine = -(hits.normals_W * d_Wset).sum(axis=1)
        return cls(
            d_Wset,
            hits.ranges.astype(float),
            hits.geometry,
            hits.normals_W,
            hits.is_outside,
            np.clip(cosine, 0.0, 1.0),
        )


class Shots(NamedTuple):
    """The N beams of a revolution, one per row, in the order of casting.

    The LiDAR may fire the beams in another order.

    Attributes:
        key: key of the frame's random numbers; see
            `cns_drake.sensors.returns.random_numbers.frame_key`.
        beam: (N,) firing number of the beam in each row.
        p_WSset: (K, 3) positions of the lasers in the world [m]; the beam in
            row i starts at `p_WSset[i % K]`.
        times: (T,) float32 firing times as fractions of the revolution; the
            beam in row i fires at `times[i % T]`.
        divergence: half angle of a beam [rad].
        max_range: how far light is followed [m].
        materials: materials of all geometries.
        cast: function that casts rays, given origins (N, 3), directions (N, 3),
            times (N,) and the maximum length of each ray (N,).
    """

    key: np.uint64
    beam: np.ndarray
    p_WSset: np.ndarray
    times: np.ndarray
    divergence: float
    max_range: float
    materials: Materials
    cast: Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray], SceneHits]


class Light(NamedTuple):
    """N portions of returning light, each reflected by one surface.

    Attributes:
        beam: (N,) int64 number of each portion's beam.
        distance: (N,) float64, from the time of flight [m].
        energy: (N,) float64 product of reflectivity, cosine of incidence, and
            fraction of the beam's light that reaches the surface and returns.
        geometry: (N,) int32 index of the reflecting geometry.
    """

    beam: np.ndarray
    distance: np.ndarray
    energy: np.ndarray
    geometry: np.ndarray


@compiled
def reflect(
    beam: np.ndarray,
    share: np.ndarray,
    distance: np.ndarray,
    geometry: np.ndarray,
    cosine: np.ndarray,
    materials: Materials,
) -> Light:
    """Returns the light that surfaces reflect along N rays.

    Args:
        beam: (N,) number of the beam of each ray.
        share: (N,) fraction of a beam's light that each ray represents.
        distance: (N,) length of each ray's path to the surface [m].
        geometry: (N,) index of the geometry that each ray hits.
        cosine: (N,) cosine of the angle of incidence.
        materials: materials of the geometries.
    """
    energy = np.empty(len(beam))
    for k in range(len(beam)):
        energy[k] = reflected(share[k], geometry[k], cosine[k], materials)
    return Light(beam, distance, energy, geometry)


@compiled
def reflected(
    share: float, geometry: int, cosine: float, materials: Materials
) -> float:
    """Returns the light that a surface reflects along one ray.

    Args:
        share: light of the ray, as a fraction of the beam's light.
        geometry: index of the geometry that the ray hits.
        cosine: cosine of the angle of incidence.
        materials: materials of the geometries.

    Returns:
        `share` times the reflectivity, times a factor for the angle of
        incidence that depends on the kind of material.
    """
    energy = share * materials.reflectivity[geometry]
    if materials.kind[geometry] == BEADS:
        return energy
    if materials.kind[geometry] == RETRO:
        return energy if cosine > _RETRO_COSINE else 0.0
    return energy * (
        cosine + materials.rough[geometry] * (1.0 - cosine * cosine)
    )


# Edge of the large cells of equal albedo: areas, as of repairs [m].
_AREA_SIZE = 5.0
# Edge of the middle-sized cells: patches [m].
_PATCH_SIZE = 0.35
# Edge of the small cells: grains [m].
_GRAIN_SIZE = 0.06
# How much the brightness of areas varies.
_AREA_CONTRAST = 0.15
# How much darker the darkest stain is.
_DARKEST_STAIN = 1.15
# Height of a wall's courses [m].
_COURSE_HEIGHT = 0.3
# Width of objects that hang on a wall [m].
_FITTING_WIDTH = 0.25
# Height of objects that hang on a wall [m].
_FITTING_HEIGHT = 1.2
# Fraction of the wall that these objects cover.
_FITTING_SHARE = 0.16
# Greatest distance along a beam by which rough ground ends it early or late
# [m].
_FARTHEST = 1.0
# Height error of the mean of a spot on rough ground, as a fraction of the
# distance.
_ROUGH = 1.5e-4
# Lengths of the waves of the ground [m].
_WAVES = 11.3, 7.9, 17.1
# Albedo varies from a ninth of its mean to nine times its mean.
_DARKEST = -0.8


@compiled
def texture(
    light: Light,
    row: np.ndarray,
    p_WSset: np.ndarray,
    d_Wset: np.ndarray,
    materials: Materials,
    group_of: np.ndarray,
    normal_matrices: np.ndarray,
    p_WLset: np.ndarray,
) -> Light:
    """Returns light whose energies and distances vary with surface texture.

    Each spot of a surface has an albedo and a height above the mean surface.
    Albedo and height are hashes of the spot's position in the surface's own
    frame, so that all scans of all drives find the same values at a spot.
    Bright spots are higher than dark spots, so their distances are shorter. The
    axes of the hash cells are not parallel to walls or floors.

    Args:
        light: the light that smooth, uniform surfaces would return.
        row: (B,) row in `d_Wset` of each of the B beams, which are in the order
            of `light`.
        p_WSset: (K, 3) positions of the sensor in the world [m]. The beam in
            row i of `d_Wset` starts at position i mod K.
        d_Wset: (B, 3) unit directions of the beams in the world.
        materials: materials of the geometries.
        group_of, normal_matrices, p_WLset: the three arrays that
            `RayCastingScene.surface_frames` returns.
    """
    energy, distance = light.energy.copy(), light.distance.copy()
    # As names of their own, fields are fast.
    beam, geometry = light.beam, light.geometry
    contrast, relief = materials.contrast, materials.relief
    tufts, swell = materials.tufts, materials.swell
    fittings, stains = materials.fittings, materials.stains
    for k in range(len(energy)):
        part = contrast[geometry[k]]
        if part == 0.0:
            continue
        ray = row[beam[k]]
        group = group_of[geometry[k]]
        place = ray % len(p_WSset) if len(p_WSset) > 1 else 0
        x = y = z = 0.0
        for i in range(3):
            away = p_WSset[place, i] - p_WLset[group, i]
            away += distance[k] * d_Wset[ray, i]
            x += normal_matrices[group, i, 0] * away
            y += normal_matrices[group, i, 1] * away
            z += normal_matrices[group, i, 2] * away
        a = 0.7071 * x + 0.5417 * y + 0.4545 * z
        b = -0.6124 * x + 0.7899 * y + 0.0113 * z
        c = -0.3529 * x - 0.2863 * y + 0.8908 * z
        grain = cell_number(a / _GRAIN_SIZE, b / _GRAIN_SIZE, c / _GRAIN_SIZE)
        patch = cell_number(a / _PATCH_SIZE, b / _PATCH_SIZE, c / _PATCH_SIZE)
        area = cell_number(a / _AREA_SIZE, b / _AREA_SIZE, c / _AREA_SIZE)
        # Most patches are a little brighter than the mean, few much darker.
        dull = 0.4 - 0.085 * (1.0 - patch) ** 4
        share = part * (dull + grain * grain * grain) + _AREA_CONTRAST * area
        # Stains lie in dark areas, most of all; the square has a mean of 4 / 3.
        stain = 1.5 * stains[geometry[k]] * (1.0 - area) ** 2
        if patch + 1.0 < stain:
            share -= _DARKEST_STAIN * (1.0 - (patch + 1.0) / stain)
        share = min(max(share, _DARKEST), -_DARKEST)
        energy[k] *= (1.0 + share) / (1.0 - share)
        distance[k] -= relief[geometry[k]] * grain
        if tufts[geometry[k]] + swell[geometry[k]] > 0.0:
            # A tall blade stops a flat beam far in front of the blade's foot.
            down = max(-d_Wset[ray, 2], 0.01)
            height = 0.5 + 0.35 * patch + 0.15 * grain
            height *= tufts[geometry[k]]
            if swell[geometry[k]] > 0.0:
                height += swell[geometry[k]] * _swell(a, b)
            height += _ROUGH * distance[k] * grain
            distance[k] -= max(min(height / down, _FARTHEST), -_FARTHEST)
        out = fittings[geometry[k]]
        if out > 0.0:
            distance[k] -= (
                0.04 * out * cell_number(0.0, 0.0, z / _COURSE_HEIGHT)
            )
            thing = cell_number(
                a / _FITTING_WIDTH, b / _FITTING_WIDTH, z / _FITTING_HEIGHT
            )
            if thing > 1.0 - 2.0 * _FITTING_SHARE:
                distance[k] -= out * (0.5 + 0.5 * patch)
    return Light(light.beam, distance, energy, light.geometry)


@compiled
def _swell(a: float, b: float) -> float:
    """Returns a smooth function of a place on the ground [m], from -1 to 1."""
    first, second, third = _WAVES
    crossed = _wave(a / first) * _wave(b / second)
    return 0.5 * crossed + 0.5 * _wave((a + b) / third)


@compiled
def _wave(turns: float) -> float:
    """Returns about the sine of an angle in turns, made of parabolas."""
    part = turns - np.floor(turns) - 0.5
    return -16.0 * part * (0.5 - abs(part))


@compiled
def cell_number(a: float, b: float, c: float) -> float:
    """Returns a random number from -1 to 1 that depends on a cell of a grid.

    All points (a, b, c) with the same integer parts give the same number.
    """
    z = (
        np.uint64(np.int64(np.floor(a))) * np.uint64(0x9E3779B97F4A7C15)
        ^ np.uint64(np.int64(np.floor(b))) * np.uint64(0xC2B2AE3D27D4EB4F)
        ^ np.uint64(np.int64(np.floor(c))) * np.uint64(0x165667B19E3779F9)
    )
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    return (
        np.float64((z ^ (z >> np.uint64(27))) >> np.uint64(11)) * 2.0**-52 - 1
    )
