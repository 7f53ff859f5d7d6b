"""What buildings draw, against closed forms."""

import numpy as np
import pytest

from worlds.shapes import Dice


def test_numbers_lie_in_their_ranges_and_keep_their_digits():
    dice = Dice(np.random.default_rng(1))
    numbers = [dice.uniform(2.0, 3.0, 2) for _ in range(400)]
    assert all(2.0 <= x <= 3.0 and round(x, 2) == x for x in numbers)
    assert np.mean(numbers) == pytest.approx(2.5, abs=0.05)
    assert {dice.whole(2, 5) for _ in range(100)} == {2, 3, 4}
    assert {dice.pick("abc") for _ in range(100)} == set("abc")
    assert np.mean([dice.chance(0.3) for _ in range(2000)]) == pytest.approx(
        0.3, abs=0.04
    )


def test_each_channel_of_a_tinted_colour_has_its_own_factor():
    dice = Dice(np.random.default_rng(2))
    rgb = (0.2, 0.4, 0.8)
    factors = np.array([dice.tinted(rgb, 0.5, 1.0) for _ in range(200)]) / rgb
    assert factors.min() >= 0.5 - 0.0025
    assert factors.max() <= 1.0 + 0.0025
    assert np.abs(np.corrcoef(factors.T) - np.eye(3)).max() < 0.25
