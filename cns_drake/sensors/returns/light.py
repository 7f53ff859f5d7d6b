"""The hits of rays, and the light that returns along them."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from cns_drake.ray_casting import SceneHits
from cns_drake.sensors.returns.materials import BEADS, RETRO, Materials
from evaluation.base import compiled

# The retro-reflective sheeting of signs and plates works up to this angle.
_RETRO_COSINE = 0.5


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
def reflected_light(
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
        energy[k] = reflected_energy(
            share[k], geometry[k], cosine[k], materials
        )
    return Light(beam, distance, energy, geometry)


@compiled
def reflected_energy(
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
