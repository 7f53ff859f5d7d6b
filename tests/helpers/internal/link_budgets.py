"""How far a unit with calibrated returns can see."""

import numpy as np

from cns_drake.sensors.returns.link_budget import HOPELESS_SNR, fit_link_budget


def reach_of(returns):
    """Range of a white target that faces the unit in clear air [m].

    Even the least part of an echo suffices there.
    """
    return np.sqrt(fit_link_budget(returns).scale / HOPELESS_SNR)
