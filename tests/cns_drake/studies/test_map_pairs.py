"""The frozen test pairs: their table, and what is refused."""

import pytest

from cns_drake.base.errors import InputError
from cns_drake.scenarios.shipped import shipped_maps
from cns_drake.studies.map_pairs import frozen_pairs, make_pair, score_pairs


def test_twelve_pairs_are_frozen():
    pairs = frozen_pairs()
    assert len(pairs) == 12
    imported = [one for one in pairs.values() if one.years is None]
    assert len(imported) == 4
    assert all(len(one.sha256) == 64 for one in imported)
    assert {one.source for one in pairs.values() if one.years} == set(
        shipped_maps()
    )
    assert len({one.seed for one in pairs.values()}) == 12


def test_other_files_are_refused(tmp_path):
    pair = frozen_pairs()["delft"]
    with pytest.raises(InputError, match="no such file; --files"):
        make_pair(pair, tmp_path / "a", tmp_path, 1.0, print)
    (tmp_path / "delft.json").write_text("{}")
    with pytest.raises(InputError, match="not the file of the test pair"):
        make_pair(pair, tmp_path / "a", tmp_path, 1.0, print)
    with pytest.raises(InputError, match="unknown pair 'paris'"):
        score_pairs(["paris"], [], tmp_path, None, 1.0, print)
