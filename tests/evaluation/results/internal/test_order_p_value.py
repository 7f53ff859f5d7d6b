"""How likely an order is that agrees as well as another one."""

import itertools
import math

import numpy as np
import pytest

from evaluation.results.table_comparison import _order_p_value


def test_the_order_of_families_by_hand():
    up = np.arange(5.0)
    swapped = np.array([0.0, 1.0, 2.0, 4.0, 3.0])
    assert _order_p_value(up, up) == pytest.approx(2 / 120)
    # Four of the ten pairs of neighbours swap in one step: 4 orders, and the
    # opposite of each.
    assert _order_p_value(up, swapped) == pytest.approx(10 / 120)
    assert math.isnan(_order_p_value(up, np.ones(5)))
    # An exact test: of all orders, at most a share of p has a p-value of p.
    orders = [np.array(one) for one in itertools.permutations(up)]
    found = np.array([_order_p_value(up, one) for one in orders])
    for level in (0.02, 0.05, 0.2, 0.5):
        assert np.mean(found <= level) <= level
    many = np.arange(9.0)
    assert _order_p_value(many, many) == pytest.approx(1e-4, abs=1e-4)
