"""Fog, rain and snowfall: extinction of a beam, and back-scatter.

Rain consists of drops, and snow consists of flakes. Their sizes and places are
random. The number of drops or flakes per volume and diameter follows Marshall
and Palmer (1948) for rain and Sekhon and Srivastava (1970) for snow,

    N(D) = N_0 exp(-L D) [1/(m3 mm)]

with N_0 = 8000 and L = 4.1 R^-0.21 for rain, N_0 = 2500 R^-0.94 and L = 2.29
R^-0.45 for snow; D is the diameter in mm (for a flake, the diameter of the
melted drop); R is the rate in mm/h of water. Extinction follows geometric
optics: each drop counts with twice its cross-section. The back-scatter of a
raindrop follows LISA (Kilic et al., 2021). The back-scatter of a flake follows
from the lidar ratio of ice crystals, 25 sr (Young and Vaughan, 2009).

Fog is a homogeneous medium. With the meteorological visibility V [m], its
extinction is alpha = ln 20 / V [1/m], and its back-scatter coefficient is 0.046
/ V [1/(m sr)] (Rasshofer et al., 2011).

docs/scenarios.md, "The model of calibrated returns", lists what it lacks.
"""

from dataclasses import dataclass
import functools
import math
from typing import NamedTuple

import numpy as np

from cns_drake.sensors.returns import link_budget
from evaluation.base import check_fields, exp


def _geometric_sequence(first: float, last: float, count: int) -> np.ndarray:
    """Returns `count` numbers, each the same multiple of the one before."""
    return exp(np.linspace(math.log(first), math.log(last), count))


# Diameters of drops; smaller ones are not detectable [mm].
_DIAMETERS_MM = _geometric_sequence(0.05, 12.0, 120)
# Refractive index of water near 900 nm.
_WATER_INDEX = 1.328
# The extinction of a flake is twice its area. The back-scatter of a Lambertian
# target is rho / pi times its area: rho = 2 pi / 25 sr.
_FLAKE_REFLECTIVITY = 2.0 * np.pi / 25.0
# Distances at which scattering is tabulated [m].
_DISTANCES = _geometric_sequence(0.3, 60.0, 96)
# The aperture of a unit: the radius of a beam at its start [m].
_APERTURE = 0.004
# The receiver sees nothing of the beam up to the first distance, and all of it
# beyond the second one [m]. Surfaces are bright enough at any distance.
_OVERLAP = (1.0, 3.0)


@dataclass(frozen=True)
class Weather:
    """Fog, rain and snowfall during a drive; by default the air is clear.

    Attributes:
        visibility: meteorological visibility in fog [m]; None without fog.
        rain: rate of rain [mm/h].
        snowfall: rate of snowfall, as melted water [mm/h].

    Raises:
        TypeError: a value is of another type.
        ValueError: a value is out of range.

    Example:
        from cns_drake import Weather

        print(Weather(visibility=100.0, rain=5.0).extinction)
    """

    visibility: float | None = None
    rain: float = 0.0
    snowfall: float = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
        if self.visibility is not None and not 5.0 <= self.visibility <= 1e6:
            raise ValueError(
                f"visibility: {self.visibility} is not within 5 m and 1000 km"
            )
        for name in ("rain", "snowfall"):
            rate = getattr(self, name)
            if not 0.0 <= rate <= 300.0:
                raise ValueError(f"{name}: {rate} is not within 0 to 300 mm/h")

    @property
    def is_clear(self) -> bool:
        """Whether the air neither attenuates nor scatters light."""
        return self.visibility is None and self.rain == self.snowfall == 0.0

    @property
    def extinction(self) -> float:
        """Extinction coefficient alpha of the air [1/m]."""
        fog = 0.0
        if self.visibility is not None:
            fog = math.log(20.0) / self.visibility
        return fog + sum(
            _extinction_of(number) for number, _ in self.drops(_DIAMETERS_MM)
        )

    def drops(self, diameters_mm: np.ndarray) -> list[tuple[np.ndarray, float]]:
        """Returns size distribution and reflectivity of raindrops and flakes.

        Args:
            diameters_mm: (D,) diameters of drops, or of melted flakes [mm].

        Returns:
            A pair for rain if it rains, followed by a pair for snow if it
            snows. Each pair consists of the number density N(D) at the
            diameters, (D,) [1/(m3 mm)], and the reflectivity of a drop or
            flake.
        """
        kinds = []
        if self.rain > 0.0:
            slope = 4.1 * math.pow(self.rain, -0.21)
            fresnel = ((_WATER_INDEX - 1.0) / (_WATER_INDEX + 1.0)) ** 2
            kinds.append((8000.0 * exp(-slope * diameters_mm), fresnel))
        if self.snowfall > 0.0:
            slope = 2.29 * math.pow(self.snowfall, -0.45)
            number = 2500.0 * math.pow(self.snowfall, -0.94)
            kinds.append(
                (number * exp(-slope * diameters_mm), _FLAKE_REFLECTIVITY)
            )
        return kinds


def _extinction_of(number: np.ndarray) -> float:
    """Returns the extinction coefficient of drops or flakes [1/m].

    `number` is their number density at the diameters `_DIAMETERS_MM`.
    """
    area_mm2 = np.pi / 4.0 * _DIAMETERS_MM**2
    return 2e-6 * float(np.trapezoid(number * area_mm2, _DIAMETERS_MM))


class Scattering(NamedTuple):
    """Statistics of the echoes of drops and fog that a LiDAR detects.

    The energy of an echo is the reflectivity of a Lambertian target that fills
    the beam, faces the LiDAR, and would return an equally strong echo from the
    same distance.

    Attributes:
        distances: (R,) increasing distances [m].
        counts: (R,) mean number of drops per beam that are detected within each
            distance.
        energies: (R, Q) quantiles of the energy of a drop's echo at each
            distance.
        fog_energies: (R,) energy of the echo of fog at each distance; 0 without
            fog.
        fog_counts: (R,) share of the light from fog that comes from within each
            distance.
    """

    distances: np.ndarray
    counts: np.ndarray
    energies: np.ndarray
    fog_energies: np.ndarray
    fog_counts: np.ndarray


# Probabilities of the quantiles of energies.
_QUANTILES = (np.arange(16) + 0.5) / 16


@functools.lru_cache(maxsize=8)
def tabulate_scattering(
    weather: Weather,
    budget: link_budget.LinkBudget,
    divergence: float,
    resolution: float,
    min_range: float,
) -> Scattering:
    """Returns statistics of the weather's echoes that a LiDAR detects.

    Drops are a Poisson process in distance and diameter. Each drop is detected
    with a probability that follows from its SNR. The detected drops are
    therefore a Poisson process, too.

    Args:
        weather: fog, rain and snowfall.
        budget: link budget of the LiDAR: SNR by distance and reflectivity.
        divergence: half angle of a beam [rad].
        resolution: distance between two echoes below which they merge: half the
            length of a pulse [m].
        min_range: least range of the LiDAR [m].
    """
    # Slow to import, and most drives have clear air.
    from scipy.integrate import cumulative_trapezoid

    distances = _DISTANCES[min_range < _DISTANCES]
    # At no distance at all, light would be infinitely strong.
    distances = np.concatenate([[max(min_range, 1e-6)], distances])
    radius = _APERTURE + divergence * distances
    overlap = np.interp(distances, _OVERLAP, (0.0, 1.0))
    rate = np.zeros(len(distances))
    weights = np.zeros((len(distances), 0))
    energies = np.zeros((len(distances), 0))
    alpha = weather.extinction
    steps = np.gradient(_DIAMETERS_MM)
    for number, reflectivity in weather.drops(_DIAMETERS_MM):
        part = np.minimum(
            (_DIAMETERS_MM * 1e-3 / (2.0 * radius[:, None])) ** 2, 1.0
        )
        energy = reflectivity * part * overlap[:, None]
        snr = link_budget.target_snr(budget, alpha, energy, distances[:, None])
        detected = link_budget.detection_probability(snr)
        density = number * steps * detected * np.pi * radius[:, None] ** 2
        rate += density.sum(axis=1)
        weights = np.hstack([weights, density])
        energies = np.hstack([energies, energy])
    fog_energies, fog_rate = np.zeros((2, len(distances)))
    if weather.visibility is not None:
        # A Lambertian target of reflectivity 1 has a coefficient of 1 / pi.
        fog_energies = np.pi * 0.046 / weather.visibility * resolution * overlap
        fog_rate = overlap * exp(-2.0 * alpha * distances) / distances**2
    fog_counts = cumulative_trapezoid(fog_rate, distances, initial=0.0)
    return Scattering(
        distances,
        cumulative_trapezoid(rate, distances, initial=0.0),
        _weighted_quantiles(energies, weights),
        fog_energies,
        fog_counts / max(fog_counts[-1], 1e-300),
    )


def _weighted_quantiles(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Returns the quantiles `_QUANTILES` of each row of weighted values."""
    result = np.zeros((len(values), len(_QUANTILES)))
    for row, (value, weight) in enumerate(zip(values, weights, strict=True)):
        if weight.sum() > 0.0:
            order = np.argsort(value, kind="stable")
            share = np.cumsum(weight[order])
            place = np.searchsorted(share, _QUANTILES * share[-1])
            result[row] = value[order][place]
    return result
