from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.patches import Patch
import numpy as np
import pytest

from cns_drake.base import from_xyz
from evaluation.change import temporal_change
from evaluation.maps import VoxelAccumulator, VoxelMap
from evaluation.recognition import FAIR_PROTOCOL
from evaluation.results import (
    LAST,
    OWN,
    STAGE,
    ChangePictures,
    Results,
    Row,
    change_section,
    made_by,
    save_figure,
)
from evaluation.results.figure_files import PIXELS
from evaluation.results.sections.change_pictures import voxel_of_each


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


def test_panels_show_the_same_part_with_a_legible_scale(tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(
        "evaluation.results.sections.change_pictures.save_figure",
        lambda figure, *_: drawn.append(figure),
    )
    rng = np.random.default_rng(2)
    clouds = [
        np.c_[rng.uniform(-40, 40, (3000, 2)), rng.uniform(0, high, 3000)]
        for high in (5.0, 20.0)
    ]
    maps = []
    for cloud in clouds:
        accumulator = VoxelAccumulator(5.0, 10)
        accumulator.add(from_xyz(cloud))
        maps.append(accumulator.to_map())
    change = temporal_change(*(one.centroids_W for one in maps))
    pictures = ChangePictures("town", ("01", "02"), tmp_path)
    pictures.draw(change, tuple(clouds), tuple(maps))
    assert [len(figure.axes) for figure in drawn] == [2, 3]
    for figure in drawn:
        figure.draw_without_rendering()
        first, *others = figure.axes
        box = first.get_window_extent()
        for axes in others:
            assert axes.get_xlim() == first.get_xlim()
            assert axes.get_ylim() == first.get_ylim()
            other = axes.get_window_extent()
            np.testing.assert_allclose(other.size, box.size, atol=0.01)
            assert other.y0 == pytest.approx(box.y0, abs=0.01)
        for axes in figure.axes:
            (label,) = axes.texts
            assert label.get_text() == "50 m"
            assert label.get_path_effects()
    titles = [axes.get_title() for axes in drawn[1].axes]
    assert titles[2].endswith(f"TCR_sym {change.symmetric:.4f}")


def test_pairs_of_stages_have_files_of_their_own(tmp_path):
    pairs = [("1_2", "3"), ("1", "2_3"), ("1%u2", "3"), ("1", "2%u3")]
    stems = {ChangePictures("x", one, tmp_path).stems for one in pairs}
    assert len(stems) == len(pairs)


def test_a_change_stands_once_beside_that_of_its_control():
    def row(database, query, stage, metric, value):
        return Row(
            "stages", "town", database, query, 1, {STAGE: stage}, "change", "",
            False, metric=metric, value=value, **made_by(FAIR_PROTOCOL),
        )  # fmt: skip

    results = Results.of(
        row(database, query, stage, metric, value)
        for database, query in (("a", "b"), ("b", "a"))
        for stage, metric, value in (
            (LAST, "tcr_sym", 0.02),
            (LAST, "tcr_sym_masked", 0.01),
            (OWN, "tcr_sym", 0.25),
            (OWN, "tcr_sym_masked", 0.125),
        )
    )
    body = change_section(results, []).body
    assert body.count("a ↔ b") == 1
    assert "b ↔ a" not in body
    cells = [one.split("<")[0] for one in body.split("<td>")[1:]]
    assert cells == ["0.250", "0.020", "0.125", "", ""]
