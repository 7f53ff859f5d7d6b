import itertools

from helpers.small_page import make_result
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.patches import Patch
import numpy as np
import pytest

from cns_drake.base.points import from_xyz
from evaluation.maps.voxel_maps import VoxelAccumulator, VoxelMap
from evaluation.methods import shipped_methods
from evaluation.report import curve_figures, map_figures
from evaluation.report.map_figures import (
    draw_routes,
    top_view,
    voxel_of_each,
)
from evaluation.results.figure_files import PIXELS, save_figure
from evaluation.results.figure_text import name_lines


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


def test_panels_of_routes_show_the_same_part_with_a_legible_scale(
    tmp_path, monkeypatch
):
    drawn = []
    monkeypatch.setattr(
        map_figures, "save_figure", lambda figure, *_: drawn.append(figure)
    )
    route = np.array([[0.0, 0.0, 1.6], [60.0, 0.0, 1.6]])
    x = np.arange(-50.0, 110.0, 0.5)
    wide = np.stack([x, 0.4 * x, np.zeros_like(x)], axis=1)
    views = [top_view(wide[cut], route) for cut in (slice(240), slice(90, 320))]
    draw_routes("town", ["01", "02"], views, [route, route], tmp_path / "a")
    (figure,) = drawn
    figure.draw_without_rendering()
    first, second = figure.axes
    assert first.get_xlim() == second.get_xlim()
    assert first.get_ylim() == second.get_ylim()
    np.testing.assert_allclose(first.get_xlim(), [-50.0, 110.0], atol=2.0)
    boxes = [axes.get_window_extent() for axes in figure.axes]
    np.testing.assert_allclose(boxes[0].size, boxes[1].size, atol=0.01)
    assert boxes[0].y0 == pytest.approx(boxes[1].y0, abs=0.01)
    for axes in figure.axes:
        (label,) = axes.texts
        assert label.get_text() == "50 m"
        assert label.get_path_effects()
        key = axes.get_legend().get_texts()
        assert [text.get_text() for text in key] == ["start", "end"]


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
    handle = Patch(color="red", label="gone")
    legend = figure.legend(handles=[handle], loc="lower center")
    save_figure(figure, tmp_path / "figure", PIXELS)
    printed = imread(tmp_path / "figure.png")[..., :3]
    on_page = imread(tmp_path / "figure.webp")[..., :3] / 255.0
    red = [1.0, 0.0, 0.0]
    assert (np.abs(printed - red) < 0.2).all(axis=2).any()
    assert on_page.min() > 0.9
    # Nor is its room.
    height = 1.0 - legend.get_window_extent().y1 / figure.bbox.height
    ratio = on_page.shape[0] / on_page.shape[1]
    assert ratio == pytest.approx(0.5 * height, abs=0.01)


def test_names_stand_beside_the_curves(tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(
        curve_figures, "save_figure", lambda figure, stem: drawn.append(figure)
    )
    # Curves that all end at the same place, and one above.
    results = [make_result(name, [0, 1, 4, 6, 3]) for name in shipped_methods()]
    curve_figures.draw_pr_curves("town", results, tmp_path / "pr")
    (figure,) = drawn
    figure.draw_without_rendering()
    for axes in figure.axes:
        boxes = [text.get_window_extent() for text in axes.texts]
        assert len(boxes) == len(results)
        for box in boxes:
            assert box.x0 >= axes.get_window_extent().x1
            assert box.x1 <= figure.bbox.x1
        for one, other in itertools.combinations(boxes, 2):
            assert not one.overlaps(other)
        for box, other in itertools.product(boxes, figure.axes):
            assert not box.overlaps(other.get_window_extent())


@pytest.mark.parametrize(
    ("ends", "heights"),
    [
        ((0.5, 0.2), (0.5, 0.2)),
        # Both move by half of what is missing, and keep their order.
        ((0.5, 0.52), (0.46, 0.56)),
        # None leaves the panel.
        ((0.0, 0.0, 1.0), (0.0, 0.1, 1.0)),
        ((1.0, 0.99), (1.0, 0.9)),
    ],
)
def test_names_move_apart_as_little_as_possible(ends, heights):
    figure = Figure()
    axes = figure.subplots()
    for number, end in enumerate(ends):
        axes.plot([0.0, 1.0], [0.3, end], label=str(number))
    axes.axhline(0.5)  # Has no name.
    axes.set_ylim(0.0, 1.0)
    name_lines(figure, axes, 0.1, 10.0)
    of_panel = axes.transAxes.inverted()
    found = {}
    for text in axes.texts:
        at = text.get_transform().transform(text.get_position())
        found[text.get_text()] = of_panel.transform(at)[1]
    assert [found[str(n)] for n in range(len(ends))] == pytest.approx(heights)
