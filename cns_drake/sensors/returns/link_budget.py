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
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import erf

from evaluation.base import compiled
from evaluation.lidar_sheets import THRESHOLD_SNR, ReturnsSheet

_Value = TypeVar("_Value", float, np.ndarray)

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
        sheet: the data sheet; two rows have different ranges. A sheet refuses
            rows from which the SNR would rise with the range.
    """
    extinction = sheet.own_extinction
    first = sheet.rows[0]
    scale = math.exp(first.log_strength + 2.0 * extinction * first.range)
    noise = sheet.range_noise, sheet.range_floor, sheet.range_bias
    return LinkBudget(scale, extinction, *noise)


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
