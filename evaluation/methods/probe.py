"""PROBE (Lee, Lee, Yoo: RA-L 2026, arXiv 2603.05965), without learning.

A scan becomes two polar images: one of the greatest heights and one of
occupancy. The sensor's displacement between query and place is modelled by a
normal distribution. In polar coordinates, this distribution blurs the occupancy
across the rings and along the rings; along the rings, the blur decreases with
range. The blurred occupancy is the probability that a cell has a point.

The heights give the rotation between two scans, and a first similarity: the
cosine of the heights at this rotation. The probabilities are moved towards 1/2
where they are uncertain; the symmetric Kullback-Leibler divergence of the
probabilities gives a second similarity. The score is the product of the two.

The code follows the authors' program (github.com/shawrby/PROBE-descriptor,
BSD-3); on the same scans, scores agree to 1e-6. Deliberate differences:

- All places are compared. To save time, the program compares only the 50 places
  with the most similar means of the rings.
- A place without points within range is never a candidate, and a query without
  such points has no candidates.
- Scans with a narrow field of view get no special treatment.
"""

from collections.abc import Sequence
from dataclasses import dataclass
import math

import numpy as np
from pydantic import PositiveFloat, PositiveInt
from scipy.ndimage import gaussian_filter1d

from evaluation.base import poses
from evaluation.maps import packed_cells
from evaluation.methods.method import Method, MethodConfig
from evaluation.methods.registry import register

# Probabilities stay this far from 0 and 1.
_EPSILON = 1e-6
# A cell counts if the two scans' probabilities add up to more than this.
_SEEN = 1e-3
# Least blur along a ring [cells].
_LEAST_BLUR = 0.1
# Least fraction of a ring that counts as occupied.
_LEAST_DENSITY = 0.01


class ProbeConfig(MethodConfig):
    """Settings of PROBE. The defaults are from Table I of its paper.

    `sensor_height` has no effect: heights are measured in the LiDAR's frame.

    Attributes:
        voxel_size: side of the voxels to which each cloud is first downsampled
            [m]. The first point of each voxel stays.
        rings: number of bins of equal length in range, from 0 to `max_range`.
        sectors: number of equal cells of azimuth, over 360 deg.
        max_range: largest range of a point that is used [m].
        sigma_t: standard deviation of the displacement that is expected between
            a query and its place [m].
    """

    voxel_size: PositiveFloat = 0.5
    rings: PositiveInt = 40
    sectors: PositiveInt = 60
    max_range: PositiveFloat = 80.0
    sigma_t: PositiveFloat = 2.0


@dataclass(frozen=True)
class Probe:
    """Descriptor of one scan.

    Attributes:
        heights: (rings, sectors) greatest height in each cell, scaled to unit
            length over all cells; all NaN without a point within range.
        mu: (rings, sectors) float32 probability that a cell has a point. Scores
            depend on this precision, which the authors' program has, too.
    """

    heights: np.ndarray
    mu: np.ndarray

    def evidence(self) -> tuple[np.ndarray, np.ndarray]:
        """Returns the occupancy p of each cell, and the log-odds of p.

        p is the probability `mu`, moved towards 1/2 by the fraction
        sqrt(mu (1 - mu)) of its distance from 1/2. Both arrays are (rings,
        sectors).
        """
        mu = self.mu.astype(np.float64)
        sigma = np.sqrt(mu * (1.0 - mu))
        p = mu * (1.0 - sigma) + 0.5 * sigma
        p = np.clip(p, _EPSILON, 1.0 - _EPSILON)
        return p, np.log(p / (1.0 - p))


@dataclass(frozen=True)
class ProbeDatabase:
    """Descriptors of D places.

    Attributes:
        spectra: (D, rings, frequencies) spectra of `Probe.heights` over the
            azimuth.
        mu: (D, rings, sectors), see `Probe`.
        evidence: two arrays (D, rings, sectors), see `Probe.evidence`.
    """

    spectra: np.ndarray
    mu: np.ndarray
    evidence: tuple[np.ndarray, np.ndarray]


@register("probe")
class ProbeMethod(Method[Probe, ProbeDatabase]):
    """Place recognition by PROBE (Lee, Lee, Yoo: RA-L 2026).

    The score is from 0 to 1, by equation 16 of this paper.
    """

    title = "PROBE"
    source = "Lee, Lee, Yoo: RA-L 2026"
    order = 10
    Config = ProbeConfig
    skips_places = True
    config: ProbeConfig

    def describe(self, points: np.ndarray) -> Probe:
        config = self.config
        shape = config.rings, config.sectors
        voxels = np.floor(points / config.voxel_size).astype(np.int64)
        _, first = np.unique(packed_cells(voxels), return_index=True)
        x, y, z = points[first].T
        ring = np.hypot(x, y) * (config.rings / config.max_range)
        turn = np.arctan2(y, x) / (2.0 * math.pi) + 0.5
        near = ring <= config.rings
        # Rounding can put a value on the limit.
        cell = np.ravel_multi_index(
            (
                ring[near].astype(np.int64),
                (turn[near] * config.sectors).astype(np.int64),
            ),
            shape,
            mode="clip",
        )
        heights = np.full(math.prod(shape), -np.inf)
        np.maximum.at(heights, cell, z[near])
        occupied = np.isfinite(heights).reshape(shape)
        heights = np.where(occupied, heights.reshape(shape), 0.0)
        # The heights of a cloud without points nearby become NaN, and so does
        # its similarity to any place.
        length = float(np.linalg.norm(heights)) or math.nan
        return Probe(heights / length, self._blurred(occupied))

    def _blurred(self, occupied: np.ndarray) -> np.ndarray:
        """Returns the probabilities of cells (rings, sectors); eq. 3 to 7."""
        config = self.config
        step = config.max_range / config.rings
        mu = occupied.astype(np.float64)
        for number, row in enumerate(mu):
            density = max(float(row.mean()), _LEAST_DENSITY)
            arc = (number + 0.5) * step * (2.0 * math.pi / config.sectors)
            blur = config.sigma_t * math.sqrt(density) / arc
            mu[number] = gaussian_filter1d(
                row, max(blur, _LEAST_BLUR), mode="wrap"
            )
        mu = gaussian_filter1d(mu, config.sigma_t / step, 0, mode="constant")
        return np.clip(mu, 0.0, 1.0).astype(np.float32)

    def build_database(self, places: Sequence[Probe]) -> ProbeDatabase:
        evidence = zip(*(place.evidence() for place in places), strict=True)
        p, odds = (np.stack(one) for one in evidence)
        return ProbeDatabase(
            np.stack([np.fft.rfft(place.heights) for place in places]),
            np.stack([place.mu for place in places]),
            (p, odds),
        )

    def score(
        self, query: Probe, database: ProbeDatabase, *, exhaustive: bool = False
    ) -> np.ndarray:
        del exhaustive  # Always true here.
        cosines = self._cosines(query, database.spectra)
        scores = np.clip(cosines.max(axis=1), 0.0, 1.0)
        for place, shift in enumerate(cosines.argmax(axis=1)):
            turned = Probe(query.heights, np.roll(query.mu, shift, axis=1))
            counts = database.mu[place] + turned.mu > _SEEN
            p, odds = turned.evidence()
            # The symmetric divergence of two Bernoulli variables.
            divergence = 0.5 * (database.evidence[0][place] - p)
            divergence *= database.evidence[1][place] - odds
            total = float(divergence[counts].sum())
            scores[place] *= math.exp(-total / max(1, counts.sum()))
        return scores

    def relative_pose(
        self, query: Probe, database: ProbeDatabase, place: int
    ) -> np.ndarray | None:
        """Returns the query's heading relative to a place, as a pose (4, 4).

        The heading is a multiple of a sector; the translation is zero. The
        result is None if one of the two scans has no points within range.
        """
        cosines = self._cosines(query, database.spectra[place, None])[0]
        if np.isnan(cosines).any():
            return None
        # What the query sees in sector a, the place sees in a + shift.
        shift = int(cosines.argmax())
        return poses.yaw_pose(2.0 * math.pi * shift / self.config.sectors)

    def _cosines(self, query: Probe, spectra: np.ndarray) -> np.ndarray:
        """Returns the cosines with D places at all headings, (D, sectors)."""
        own = np.conj(np.fft.rfft(query.heights))
        products = np.einsum("drf,rf->df", spectra, own)
        return np.fft.irfft(products, n=self.config.sectors)
