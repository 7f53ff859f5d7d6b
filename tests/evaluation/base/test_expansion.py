"""The size of a graph that is expanded by its paths, against expanding it."""

import numpy as np
import pytest

from evaluation.base import check_expansion


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

        found = check_expansion(0, names.__getitem__, lambda one: 10 + one)
        assert found == expanded(0)


def test_what_names_its_parts_too_often_is_refused():
    assert check_expansion(0, lambda k: [1] * 100_001 * (k == 0)) == 100_002
    with pytest.raises(ValueError, match="its 2 parts stand for 100003,"):
        check_expansion(0, lambda k: [1] * 100_002 * (k == 0))
    with pytest.raises(ValueError, match=f"1001 parts stand for {2**1001 - 1}"):
        check_expansion(1000, lambda k: [k - 1] * 2 * (k > 0))
    # What is written out is not repeated.
    assert check_expansion(0, lambda k: range(1, 200_000) if k == 0 else ())


@pytest.mark.parametrize(
    "names", [{0: [0]}, {0: [1, 2], 1: [], 2: [3], 3: [0]}]
)
def test_what_contains_itself_is_refused(names):
    with pytest.raises(ValueError, match="contains itself"):
        check_expansion(0, names.__getitem__)
