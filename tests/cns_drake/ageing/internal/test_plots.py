"""Plots, and new buildings on them."""

import itertools

import numpy as np
import pytest
import shapely

from cns_drake.ageing.buildings import new_building
from cns_drake.ageing.plots import Plot


def test_a_plot_faces_its_street():
    street = shapely.box(-50, -20, 50, -10)
    for angle in (0.0, 40.0):
        area, way = (
            shapely.affinity.rotate(one, angle, origin=(0, 0))
            for one in (shapely.box(-8, -6, 8, 6), street)
        )
        plot = Plot.facing(area, way, 1.0)
        assert plot.yaw == pytest.approx(np.radians(angle), abs=1e-4)
        np.testing.assert_allclose(
            plot.inside(way).bounds, (-50, -20, 50, -10), atol=0.01
        )


def test_new_buildings_stay_on_their_plot():
    area = shapely.affinity.rotate(shapely.box(0, 0, 20, 14), 30)
    street = shapely.affinity.rotate(
        shapely.box(-20, -8, 40, -3), 30, origin=area.centroid
    )
    plot = Plot.facing(area, street, 0.0)
    made = [
        new_building(plot, 11.0, "walk_up", [], np.random.default_rng(k), "x")
        for k in range(6)
    ]
    kinds = {one.tags[0] for one in made}
    assert len(kinds) > 1
    assert "walk_up" not in kinds
    for one, other in itertools.pairwise(made):
        assert area.buffer(0.05).contains(one.footprint_W)
        assert one.name == f"{one.tags[0]}_x"
        assert other.semantic_class == "building"
