"""The texture of surfaces: how albedo and height vary from place to place."""

from __future__ import annotations

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.ray_casting.ray_casting_scene import SurfaceFrames
from cns_drake.sensors.returns.light import Light
from cns_drake.sensors.returns.materials import Materials
from cns_drake.sensors.returns.random_numbers import cell_number

# Edge of large cells of equal albedo, such as repaired areas [m].
_AREA_SIZE = 5.0
# Edge of middle-sized cells of equal albedo (patches) [m].
_PATCH_SIZE = 0.35
# Edge of small cells of equal albedo (grains) [m].
_GRAIN_SIZE = 0.06
# How much the brightness varies between large cells.
_AREA_CONTRAST = 0.15
# How much darker the darkest stain is.
_DARKEST_STAIN = 1.15
# Height of a wall's courses [m].
_COURSE_HEIGHT = 0.3
# How far a wall's courses protrude, as a share of the objects on the wall.
_COURSE_SHARE = 0.04
# Width of objects that hang on a wall [m].
_FITTING_WIDTH = 0.25
# Height of objects that hang on a wall [m].
_FITTING_HEIGHT = 1.2
# Fraction of the wall that these objects cover.
_FITTING_SHARE = 0.16
# Greatest distance along a beam by which rough ground ends it early or late
# [m].
_MOST_SHIFT = 1.0
# Error of the mean height of a beam's spot on rough ground, as a fraction of
# the distance.
_MEAN_HEIGHT_ERROR = 1.5e-4
# Lengths of the ground's waves [m].
_WAVES = 11.3, 7.9, 17.1
# Albedo varies from a ninth of its mean to nine times its mean: the factor is
# (1 + share) / (1 - share), with a share from this value to its negative.
_DARKEST = -0.8


@compiled
def with_texture(
    light: Light,
    row: np.ndarray,
    p_WSset: np.ndarray,
    d_Wset: np.ndarray,
    materials: Materials,
    frames: SurfaceFrames,
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
        frames: frames with which the surfaces move.
    """
    energy, distance = light.energy.copy(), light.distance.copy()
    # As names of their own, fields are fast.
    beam, geometry = light.beam, light.geometry
    contrast, relief = materials.contrast, materials.relief
    tufts, swell = materials.tufts, materials.swell
    fittings, stains = materials.fittings, materials.stains
    normal_matrices, p_WLset = frames.normal_matrices, frames.p_WLset
    frame_of = frames.row
    for k in range(len(energy)):
        part = contrast[geometry[k]]
        if part == 0.0:
            continue
        ray = row[beam[k]]
        frame = frame_of[geometry[k]]
        place = ray % len(p_WSset) if len(p_WSset) > 1 else 0
        x = y = z = 0.0
        for i in range(3):
            away = p_WSset[place, i] - p_WLset[frame, i]
            away += distance[k] * d_Wset[ray, i]
            x += normal_matrices[frame, i, 0] * away
            y += normal_matrices[frame, i, 1] * away
            z += normal_matrices[frame, i, 2] * away
        a = 0.7071 * x + 0.5417 * y + 0.4545 * z
        b = -0.6124 * x + 0.7899 * y + 0.0113 * z
        c = -0.3529 * x - 0.2863 * y + 0.8908 * z
        grain = cell_number(a / _GRAIN_SIZE, b / _GRAIN_SIZE, c / _GRAIN_SIZE)
        patch = cell_number(a / _PATCH_SIZE, b / _PATCH_SIZE, c / _PATCH_SIZE)
        area = cell_number(a / _AREA_SIZE, b / _AREA_SIZE, c / _AREA_SIZE)
        share = _albedo_share(part, stains[geometry[k]], grain, patch, area)
        energy[k] *= (1.0 + share) / (1.0 - share)
        distance[k] -= relief[geometry[k]] * grain
        if tufts[geometry[k]] + swell[geometry[k]] > 0.0:
            # A tall blade stops a flat beam far in front of the blade's foot.
            down = max(-d_Wset[ray, 2], 0.01)
            height = 0.5 + 0.35 * patch + 0.15 * grain
            height *= tufts[geometry[k]]
            if swell[geometry[k]] > 0.0:
                height += swell[geometry[k]] * _swell(a, b)
            height += _MEAN_HEIGHT_ERROR * distance[k] * grain
            distance[k] -= max(min(height / down, _MOST_SHIFT), -_MOST_SHIFT)
        out = fittings[geometry[k]]
        if out > 0.0:
            course = cell_number(0.0, 0.0, z / _COURSE_HEIGHT)
            distance[k] -= _COURSE_SHARE * out * course
            fitting = cell_number(
                a / _FITTING_WIDTH, b / _FITTING_WIDTH, z / _FITTING_HEIGHT
            )
            if fitting > 1.0 - 2.0 * _FITTING_SHARE:
                distance[k] -= out * (0.5 + 0.5 * patch)
    return Light(light.beam, distance, energy, light.geometry)


@compiled
def _albedo_share(
    contrast: float, stains: float, grain: float, patch: float, area: float
) -> float:
    """Returns the share from which a spot's albedo follows; see `_DARKEST`.

    Args:
        contrast: how much the albedo varies within the surface.
        stains: part of the surface that is stained.
        grain, patch, area: numbers from -1 to 1 of the spot's small, medium and
            large cell.
    """
    # Most patches are a little brighter than the mean, few much darker.
    dull = 0.4 - 0.085 * (1.0 - patch) ** 4
    share = contrast * (dull + grain * grain * grain) + _AREA_CONTRAST * area
    # Stains lie in dark areas, most of all; the square has a mean of 4 / 3.
    stain = 1.5 * stains * (1.0 - area) ** 2
    if patch + 1.0 < stain:
        share -= _DARKEST_STAIN * (1.0 - (patch + 1.0) / stain)
    return min(max(share, _DARKEST), -_DARKEST)


@compiled
def _swell(a: float, b: float) -> float:
    """Returns a smooth function's value, -1 to 1, at a place on the ground."""
    first, second, third = _WAVES
    crossed = _wave(a / first) * _wave(b / second)
    return 0.5 * crossed + 0.5 * _wave((a + b) / third)


@compiled
def _wave(turns: float) -> float:
    """Returns nearly the sine of an angle in turns, from two parabolas."""
    part = turns - np.floor(turns) - 0.5
    return -16.0 * part * (0.5 - abs(part))
