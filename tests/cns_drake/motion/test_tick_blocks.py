"""Blocks of values give each time what it gets alone."""

import numpy as np
import pytest

from cns_drake.motion.tick_blocks import TickBlocks

PERIOD = 0.05


class Computed:
    """Two arrays of each time; it counts the calls."""

    def __init__(self):
        self.calls = []

    def __call__(self, times):
        self.calls.append(len(times))
        return times**2, np.outer(times, [1.0, -2.0])


@pytest.mark.parametrize("period", [PERIOD, None])
def test_each_time_gets_its_own_values(period):
    blocks = TickBlocks(Computed(), period, 4)
    multiples = PERIOD * np.arange(9)
    around = [np.nextafter(0.2, 0.0), np.nextafter(0.2, 1.0), 0.123]
    for time in [*multiples, *multiples[::-1], *around]:
        square, pair = blocks.at(time)
        assert square == time**2
        np.testing.assert_array_equal(pair, [time, -2.0 * time])


def test_a_block_is_computed_once():
    computed = Computed()
    blocks = TickBlocks(computed, PERIOD, 4)
    for tick in range(9):
        blocks.at(tick * PERIOD)
    assert computed.calls == [4, 4, 4]
    blocks.at(8 * PERIOD + 1e-9)
    assert computed.calls == [4, 4, 4, 1]
    blocks.at(8 * PERIOD)
    assert len(computed.calls) == 4
