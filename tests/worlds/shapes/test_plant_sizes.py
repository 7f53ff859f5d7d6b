"""Plants when they were younger."""

import numpy as np
import pytest

from worlds.shapes import OBJECTS, part_mesh, younger_plant


@pytest.mark.parametrize("species", ["palm", "spruce", "hedge", "plane_tree"])
def test_a_younger_plant_is_alike(species):
    plant = OBJECTS[species].build(np.random.default_rng(4))

    def extent(model):
        corners = np.concatenate(
            [part_mesh(p, model.meshes).vertices for p in model.parts]
        )
        return np.array([corners.min(axis=0), corners.max(axis=0)])

    top = extent(plant)[1, 2]
    young = younger_plant(plant, 0.4 * top)
    np.testing.assert_allclose(extent(young), 0.4 * extent(plant), atol=2e-3)
    assert younger_plant(plant, top) is plant
