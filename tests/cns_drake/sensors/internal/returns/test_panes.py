"""Wide beams, leaves and panes, against closed forms."""

import numpy as np
import pytest

from cns_drake.sensors.returns.propagation import pane_shares


def test_panes_share_light_by_fresnel():
    reflected, through = pane_shares(1.0)
    # Glass of n = 1.52: 4.3 % a face, 0.918 through a pane, 0.843 there and
    # back.
    face = (0.52 / 2.52) ** 2
    assert face == pytest.approx(0.043, abs=5e-4)
    assert through == pytest.approx((1 - face) / (1 + face))
    assert through == pytest.approx(0.918, abs=5e-4)
    assert through**2 == pytest.approx(0.843, abs=5e-4)
    assert reflected + through == pytest.approx(1.0)
    # At Brewster's angle all light in the plane of incidence enters.
    brewster = np.cos(np.arctan(1.52))
    reflected, _ = pane_shares(brewster)
    inner = np.sqrt(1.0 - (1.0 - brewster**2) / 1.52**2)
    across = ((brewster - 1.52 * inner) / (brewster + 1.52 * inner)) ** 2
    assert reflected == pytest.approx(across / (1.0 + across))
