"""The strength of an echo, its detection and its error.

The same equation holds for all surfaces: the LiDAR equation of an extended
target (Wagner et al., ISPRS Journal 60, 2006):

    SNR(e, r) = S e exp(-2 (alpha + alpha_0) r) / r^2

Here e is the target's reflectivity times the cosine of incidence, and alpha is
the extinction of the weather. S and alpha_0 are constants of the unit. S and
alpha_0 follow from two rows of the unit's data sheet: the ranges at 80 % and at
10 % reflectivity. alpha_0 accounts for the whole deviation of these rows from 1
/ r^2.
"""

import math
from statistics import NormalDist
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import erf

from cns_drake.base import compiled
from cns_drake.units import ReturnsSheet, SheetRow

_Value = TypeVar("_Value", float, np.ndarray)

# The SNR that a unit detects in half of all cases: Ouster's sheet of the OS1
# (first generation) states 10 cm of range noise at an SNR of 12, its lowest.
THRESHOLD_SNR = 9.0
# Above this SNR, an echo is missed less than once in 10^13 times.
CERTAIN_SNR = 81.0
# Below this SNR, the probability of detection is 0 in double precision.
HOPELESS_SNR = 0.9


class LinkBudget(NamedTuple):
    """The parameters of a unit's SNR and range noise.

    The echo of a target at the range r [m] has an SNR of
    `S e exp(-2 (alpha + alpha_0) r) / r^2`. Here e is the target's
    reflectivity times the cosine of incidence, and alpha the extinction
    coefficient of the weather [1/m].

    Attributes:
        scale: S in this equation [m^2].
        own_extinction: alpha_0 in this equation [1/m].
        range_noise: standard deviation of a range at an SNR of 1 [m].
        range_floor: least standard deviation, at any SNR [m].
        range_bias: standard deviation of the range error that is constant for
            each laser; a part of `range_floor` [m].
    """

    scale: float
    own_extinction: float
    range_noise: float
    range_floor: float
    range_bias: float = 0.0


def fit_link_budget(sheet: ReturnsSheet) -> LinkBudget:
    """Returns the link budget that fits a data sheet's one or two rows exactly.

    Args:
        sheet: the data sheet; two rows have different ranges.
    """
    rows = sheet.rows
    # log(snr r^2 / e) = log(S) - 2 alpha_0 r at each row.
    logs = [
        math.log(stated_snr(row) * row.range**2 / row.reflectivity)
        for row in rows
    ]
    extinction = 0.0
    if len(rows) == 2:
        way = 2.0 * (rows[1].range - rows[0].range)
        extinction = (logs[0] - logs[1]) / way
    scale = math.exp(logs[0] + 2.0 * extinction * rows[0].range)
    noise = sheet.range_noise, sheet.range_floor, sheet.range_bias
    return LinkBudget(scale, extinction, *noise)


def stated_snr(row: SheetRow) -> float:
    """Returns the SNR at which a target is detected as a row states."""
    # `detection_probability`, solved for the root of the SNR.
    z = NormalDist().inv_cdf(row.probability)
    root = (z + math.sqrt(z * z + 4.0 * THRESHOLD_SNR)) / 2.0
    return root * root


@compiled
def target_snr(
    budget: LinkBudget, extinction: float, energy: _Value, distance: _Value
) -> _Value:
    """Returns the signal-to-noise ratio (SNR) of the echoes of targets.

    Args:
        budget: link budget of the unit.
        extinction: extinction coefficient of the weather [1/m].
        energy: reflectivity of each target times the cosine of incidence.
        distance: distance of each target, positive [m].
    """
    loss = 2.0 * (extinction + budget.own_extinction) * distance
    return budget.scale * energy * np.exp(-loss) / (distance * distance)


def detection_probability(snr: ArrayLike) -> np.ndarray:
    """Returns the probability that an echo with a given SNR is detected.

    The model compares a photon count with a threshold. The mean of the count is
    the SNR, and the standard deviation of the count is the root of the SNR
    (shot noise).
    """
    snr = np.asarray(snr)
    deviation = (snr - THRESHOLD_SNR) / np.sqrt(np.maximum(snr, 1e-9))
    probability = 0.5 * (1.0 + erf(deviation / np.sqrt(2.0)))
    return np.where(snr > CERTAIN_SNR, 1.0, probability)


@compiled
def range_deviation(budget: LinkBudget, snr: np.ndarray) -> np.ndarray:
    """Returns the standard deviation of a laser's ranges from shot to shot [m].

    The standard deviation over all lasers and shots is inversely proportional
    to the root of the SNR (Wagner et al., 2006), down to a limit set by the
    unit's clock and the shape of the pulses. The variance of the error that is
    constant for each laser is subtracted from the variance of all ranges.
    """
    whole = np.maximum(budget.range_noise / np.sqrt(snr), budget.range_floor)
    return np.sqrt(whole**2 - budget.range_bias**2)


@compiled
def echo_energy(budget: LinkBudget, snr: _Value, distance: _Value) -> _Value:
    """Returns the energy that a LiDAR infers from the SNR of an echo.

    `distance` is the range of the echo [m]. The energy is the reflectivity of
    the target times the cosine of incidence. The LiDAR assumes clear air.
    """
    gain = np.exp(2.0 * budget.own_extinction * distance)
    return snr * distance * distance * gain / budget.scale
