from helpers.small_page import make_result
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.patches import Patch
import numpy as np
import pytest

from cns_drake.base.points import from_xyz
from evaluation.maps.voxel_maps import VoxelAccumulator, VoxelMap
from evaluation.report import curve_figures
from evaluation.report.figures import judge_points, top_view, voxel_of_each
from evaluation.results.drawing import PIXELS, save


def test_change_picture_has_the_colours_of_the_metric():
    other = np.array(
        [[x, y, z] for x in (0, 20) for y in (0, 20) for z in (0, 20)], float
    )
    points = np.array(
        [
            [0.0, 0.0, 4.4],
            [0.0, 0.0, 4.6],
            [10.0, 10.0, 10.0],
            [40.0, 0.0, 0.0],
            [24.0, 0.0, 0.0],
        ]
    )
    absent, in_hull = judge_points(points, other)
    assert absent.tolist() == [False, True, True, True, False]
    assert in_hull.tolist() == [True, True, True, False, False]


def test_view_from_above_shows_the_route_and_60_m_around():
    x = np.arange(0.25, 1000.0, 0.5)
    line = np.stack([x, np.full_like(x, 3.0), np.zeros_like(x)], axis=1)
    positions = np.array([[400.0, 3.0, 1.6], [500.0, 3.0, 1.6]])
    picture = top_view(line, positions)
    left, right, bottom, top = picture.extent
    np.testing.assert_allclose([left, right], [340.0, 560.0], atol=2.0)
    assert bottom <= 3.0 <= top
    assert picture.project(positions)[:, 0].tolist() == [400.0, 500.0]
    # Without a point in view the whole map is shown.
    far = top_view(line, positions + np.array([0.0, 500.0, 0.0]))
    assert far.extent[1] > 990.0


def test_points_of_pictures_have_their_voxels():
    accumulator = VoxelAccumulator(5.0, 10)
    rng = np.random.default_rng(8)
    accumulator.add(from_xyz(rng.uniform(-40, 40, (3000, 3))))
    points, coarse = accumulator.samples(), accumulator.to_map()
    owners = voxel_of_each(points, coarse)
    np.testing.assert_array_equal(
        coarse.indices[owners], np.floor((points - [0.0, 0.0, -2.5]) / 5.0)
    )
    assert set(owners) == set(range(len(coarse)))


@pytest.mark.parametrize("side", [-np.inf, 0.0, np.inf])
def test_points_on_a_border_have_a_voxel_beside_them(side):
    """This holds even if the voxel that seems to contain them is empty."""
    indices = np.array([[-9, 0, 0], [2, 4, 3], [2, 4, 5], [9, 9, 9]], np.int32)
    coarse = VoxelMap(indices, indices * 5.0, np.ones(4, np.int64), 5.0)
    low, high = indices[1] * 5.0 + [0.0, 0.0, -2.5], coarse.centres_W[1] + 2.5
    corners = np.array(np.meshgrid(*zip(low, high, strict=True))).T
    points = np.nextafter(corners.reshape(-1, 3), side)
    assert voxel_of_each(points, coarse).tolist() == [1] * 8


def test_legend_of_a_figure_is_not_in_the_picture_of_the_page(tmp_path):
    figure = Figure(figsize=(2, 1))
    figure.legend(handles=[Patch(color="red", label="gone")], loc="center")
    save(figure, tmp_path / "figure", PIXELS)
    printed = imread(tmp_path / "figure.png")[..., :3]
    on_page = imread(tmp_path / "figure.webp")[..., :3] / 255.0
    red = [1.0, 0.0, 0.0]
    assert (np.abs(printed - red) < 0.2).all(axis=2).any()
    assert on_page.min() > 0.9


def test_legends_stand_beside_the_curves(tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(
        curve_figures, "save", lambda figure, stem: drawn.append(figure)
    )
    result = make_result("scan-context++", [0, 1, 4, 6, 3])
    curve_figures.draw_pr_curves("town", [result], tmp_path / "pr")
    (figure,) = drawn
    figure.draw_without_rendering()
    for axes in figure.axes:
        legend = axes.get_legend().get_window_extent()
        assert legend.x0 >= axes.get_window_extent().x1
        assert legend.x1 <= figure.bbox.x1
        assert not any(
            legend.overlaps(other.get_window_extent()) for other in figure.axes
        )
