"""The size of a graph that is expanded by its paths, against expanding it."""

import numpy as np
import pytest

from cns_drake.scene.expansion import expanded_size


def test_sizes_are_those_of_the_expanded_graph():
    rng = np.random.default_rng(145)
    for _ in range(50):
        names = {
            one: rng.integers(one + 1, 9, rng.integers(4)).tolist()
            if one < 8
            else []
            for one in range(9)
        }

        def expanded(one, names=names):
            return 10 + one + sum(map(expanded, names[one]))

        found = expanded_size(0, names.__getitem__, lambda one: 10 + one)
        assert found == expanded(0)


def test_a_graph_of_any_number_of_paths_is_counted():
    assert expanded_size(1000, lambda k: [k - 1] * 2 * (k > 0)) == 2**1001 - 1


@pytest.mark.parametrize(
    "names", [{0: [0]}, {0: [1, 2], 1: [], 2: [3], 3: [0]}]
)
def test_what_contains_itself_is_refused(names):
    with pytest.raises(ValueError, match="contains itself"):
        expanded_size(0, names.__getitem__)
