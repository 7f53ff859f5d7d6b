"""The texture of surfaces: how albedo and height vary from place to place."""

import numpy as np

from cns_drake.ray_casting import SurfaceFrames
from cns_drake.sensors.returns.light import Light
from cns_drake.sensors.returns.materials import Materials
from cns_drake.sensors.returns.random_numbers import cell_number
from evaluation.base import compiled

# Unit vectors along the axes of the hash cells, as the rows of a rotation
# matrix. The axes are oblique to those of a surface's frame, so that walls and
# floors do not cut the cells along their faces.
_AXES = (
    (0.7071, 0.5417, 0.4545),
    (-0.6124, 0.7899, 0.0113),
    (-0.3529, -0.2863, 0.8908),
)
# Edge of large cells of equal albedo, such as repaired areas [m].
_AREA_SIZE = 5.0
# Edge of middle-sized cells of equal albedo (patches) [m].
_PATCH_SIZE = 0.35
# Edge of small cells of equal albedo (grains) [m].
_GRAIN_SIZE = 0.06
# How much the brightness varies between large cells.
_AREA_CONTRAST = 0.15
# How much brighter the brightest patch is.
_BRIGHTEST_PATCH = 0.4
# How fast the brightness decreases towards the darkest patch.
_PATCH_DECREASE = 0.085
# How much darker the darkest stain is.
_DARKEST_STAIN = 1.15
# Factor of the stained part of an area. Its product with the mean of the square
# that distributes stains among areas, 4 / 3, is 2: the range of `patch`.
_STAIN_FACTOR = 1.5
# Height of tufts, as a share of the greatest height: the mean, and the
# amplitudes from patch to patch and from grain to grain.
_TUFT_MEAN = 0.5
_TUFT_OF_PATCH = 0.35
_TUFT_OF_GRAIN = 0.15
# Least slope of a beam that ends on tufts or swell.
_LEAST_SLOPE = 0.01
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
    Bright spots are higher than dark spots, so their distances are shorter.

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
        x, y, z = _position_on_surface(
            p_WSset[place],
            d_Wset[ray],
            distance[k],
            normal_matrices[frame],
            p_WLset[frame],
        )
        a, b, c = _along_cells(x, y, z)
        grain = cell_number(a / _GRAIN_SIZE, b / _GRAIN_SIZE, c / _GRAIN_SIZE)
        patch = cell_number(a / _PATCH_SIZE, b / _PATCH_SIZE, c / _PATCH_SIZE)
        area = cell_number(a / _AREA_SIZE, b / _AREA_SIZE, c / _AREA_SIZE)
        share = _albedo_share(part, stains[geometry[k]], grain, patch, area)
        energy[k] *= (1.0 + share) / (1.0 - share)
        distance[k] -= relief[geometry[k]] * grain
        if tufts[geometry[k]] + swell[geometry[k]] > 0.0:
            height = tufts[geometry[k]] * _tuft_share(patch, grain)
            if swell[geometry[k]] > 0.0:
                height += swell[geometry[k]] * _swell(a, b)
            height += _MEAN_HEIGHT_ERROR * distance[k] * grain
            # A tall blade stops a flat beam far in front of the blade's foot.
            down = max(-d_Wset[ray, 2], _LEAST_SLOPE)
            distance[k] -= max(min(height / down, _MOST_SHIFT), -_MOST_SHIFT)
        out = fittings[geometry[k]]
        if out > 0.0:
            distance[k] -= _course(out, z)
            distance[k] -= _fitting(out, a, b, z, patch)
    return Light(light.beam, distance, energy, light.geometry)


@compiled
def _position_on_surface(
    p_WS: np.ndarray,
    d_W: np.ndarray,
    distance: float,
    normal_matrix: np.ndarray,
    p_WL: np.ndarray,
) -> tuple[float, float, float]:
    """Returns the end of a beam in the frame of the surface that it meets [m].

    Args:
        p_WS: (3,) position of the sensor in the world [m].
        d_W: (3,) unit direction of the beam in the world.
        distance: length of the beam [m].
        normal_matrix, p_WL: row of the surface's frame in the arrays of
            `SurfaceFrames`.
    """
    x = y = z = 0.0
    for i in range(3):
        away = p_WS[i] - p_WL[i]
        away += distance * d_W[i]
        x += normal_matrix[i, 0] * away
        y += normal_matrix[i, 1] * away
        z += normal_matrix[i, 2] * away
    return x, y, z


@compiled
def _along_cells(x: float, y: float, z: float) -> tuple[float, float, float]:
    """Converts a position to coordinates along the axes of the hash cells."""
    first, second, third = _AXES
    return (
        first[0] * x + first[1] * y + first[2] * z,
        second[0] * x + second[1] * y + second[2] * z,
        third[0] * x + third[1] * y + third[2] * z,
    )


@compiled
def _tuft_share(patch: float, grain: float) -> float:
    """Returns the height of a tuft as a share, 0 to 1, of the greatest height.

    `patch` and `grain` are as in `_albedo_share`.
    """
    return _TUFT_MEAN + _TUFT_OF_PATCH * patch + _TUFT_OF_GRAIN * grain


@compiled
def _course(out: float, z: float) -> float:
    """Returns how far a wall's course protrudes [m]; less than 0: recedes.

    Args:
        out: greatest reach of the objects on the wall [m].
        z: height in the wall's frame [m].
    """
    return _COURSE_SHARE * out * cell_number(0.0, 0.0, z / _COURSE_HEIGHT)


@compiled
def _fitting(out: float, a: float, b: float, z: float, patch: float) -> float:
    """Returns how far an object on a wall protrudes [m]; 0 without an object.

    Args:
        out: greatest reach of the objects [m].
        a, b: first two coordinates along the axes of the hash cells [m].
        z: height in the wall's frame [m].
        patch: as in `_albedo_share`.
    """
    fitting = cell_number(
        a / _FITTING_WIDTH, b / _FITTING_WIDTH, z / _FITTING_HEIGHT
    )
    if fitting > 1.0 - 2.0 * _FITTING_SHARE:
        return out * (0.5 + 0.5 * patch)
    return 0.0


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
    dull = _BRIGHTEST_PATCH - _PATCH_DECREASE * (1.0 - patch) ** 4
    share = contrast * (dull + grain * grain * grain) + _AREA_CONTRAST * area
    # Stains lie in dark areas, most of all.
    stain = _STAIN_FACTOR * stains * (1.0 - area) ** 2
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
