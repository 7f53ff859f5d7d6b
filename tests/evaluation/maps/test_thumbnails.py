import numpy as np

from evaluation.maps import MAX_POINTS, thumbnail


def test_cells_and_heights():
    points = np.array(
        [
            [0.1, 0.1, 0.4],  # 2 m above the ground.
            [0.4, 0.4, 1.4],  # Same cell, 3 m.
            [-0.1, 0.6, 100.0],  # Higher than a byte can say.
            [63.9, -64.0, -1.0],
            [64.1, 0.0, 1.0],  # Too far.
            [3.0, 3.0, -1.5],  # Road.
        ]
    )
    cells = thumbnail(points, 1.6, 0)
    assert cells.dtype == np.uint8
    assert sorted(cells.tolist()) == [
        [127, 129, 255],
        [128, 128, 30],
        [255, 0, 6],
    ]


def test_too_many_points_are_thinned_evenly():
    x = np.arange(-63.75, 64.0, 0.5)
    grid = np.stack(np.meshgrid(x, x), axis=-1).reshape(-1, 2)
    points = np.c_[grid, np.ones(len(grid))]
    first = thumbnail(points, 1.6, 3)
    assert first.shape == (MAX_POINTS, 3)
    np.testing.assert_array_equal(first, thumbnail(points, 1.6, 3))
    # Any first part of the points covers all quarters.
    quarters = (first[:200, :2] >= 128) @ [2, 1]
    assert np.bincount(quarters, minlength=4).min() > 30


def test_no_point():
    assert thumbnail(np.empty((0, 3)), 1.6, 0).shape == (0, 3)
