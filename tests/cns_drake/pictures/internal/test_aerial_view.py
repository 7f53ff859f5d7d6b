"""Drives from above: the view shows all of them, north up."""

import numpy as np
import pytest

from cns_drake.pictures.aerial_pictures import view_from_above

pytestmark = pytest.mark.slow


def test_the_view_shows_every_position_north_up():
    rng = np.random.default_rng(4)
    positions = rng.uniform([-300, 20, 0], [100, 180, 8], (200, 3))
    view = view_from_above(positions)
    pixels, shown = view.project(positions, 500, 500)
    assert len(shown) == 200
    assert np.corrcoef(pixels[:, 0], positions[:, 0])[0, 1] > 0.999
    assert np.corrcoef(pixels[:, 1], positions[:, 1])[0, 1] < -0.999
    # The drives fill the picture: the margin is 40 m on 400 m of width.
    assert np.ptp(pixels[:, 0]) > 380
