"""A film shows traffic where it was recorded."""

from helpers.tiny_drive import tiny_scenario

from cns_drake import load_scenario
from cns_drake.simulation.film import with_some_traffic


def test_traffic_comes_where_it_was_recorded(tmp_path):
    shipped = load_scenario("metropolis_01")
    assert with_some_traffic(shipped).traffic.vehicles == 60
    assert with_some_traffic(shipped).traffic.walkers == 60
    busy = shipped.with_traffic(7)
    assert with_some_traffic(busy) == busy
    bare = tiny_scenario(tmp_path)
    assert with_some_traffic(bare) == bare
