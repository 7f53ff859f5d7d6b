from helpers.driven_walls import ROUTE, driven_map, wall
from matplotlib.colors import rgb_to_hsv
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.patches import Patch
import numpy as np
import pytest

from evaluation.base import GONE_RGB, NEW_RGB
from evaluation.recognition import RANDOM_YAW_PROTOCOL
from evaluation.results import (
    LAST,
    OWN,
    STAGE,
    ChangePicture,
    Results,
    Row,
    change_section,
    made_by,
    save_figure,
)


def test_new_gone_and_hidden_points_have_colours_of_their_own(tmp_path):
    rng = np.random.default_rng(2)
    ground = np.c_[rng.uniform(-70, 70, (20000, 2)), np.zeros(20000)]
    # The new wall hides the hut behind it; the shed on the left is gone.
    hut, new, shed = wall(40.0, 8.0, 6.0), wall(15.0, 30.0), wall(-20.0, 8.0)
    earlier = driven_map(np.concatenate([ground, hut, shed]), ROUTE)
    later = driven_map(np.concatenate([ground, new]), ROUTE)
    picture = ChangePicture("town", ("01", "02"), tmp_path)
    picture.draw(earlier, later)
    assert [file.exists() for file in picture.files] == [True, True]
    image = imread(picture.files[0])
    # Without paper: it lies on light and on dark pages.
    assert image[0, 0, 3] == 0.0
    hue = rgb_to_hsv(image[..., :3])
    is_strong = (hue[..., 1] > 0.5) & (image[..., 3] > 0.9)
    for rgb, most in ((NEW_RGB, 40000), (GONE_RGB, 20000)):
        wanted = rgb_to_hsv(np.array(rgb) / 255.0)[0]
        number = (is_strong & (np.abs(hue[..., 0] - wanted) < 0.03)).sum()
        assert 1000 < number < most


def test_legend_of_a_figure_is_not_in_the_picture_of_the_page(tmp_path):
    figure = Figure(figsize=(2, 1))
    handle = Patch(color="red", label="gone")
    legend = figure.legend(handles=[handle], loc="lower center")
    save_figure(figure, tmp_path / "figure", ("png", "webp"))
    printed = imread(tmp_path / "figure.png")[..., :3]
    on_page = imread(tmp_path / "figure.webp")[..., :3] / 255.0
    red = [1.0, 0.0, 0.0]
    assert (np.abs(printed - red) < 0.2).all(axis=2).any()
    assert on_page.min() > 0.9
    # Nor is its room.
    height = 1.0 - legend.get_window_extent().y1 / figure.bbox.height
    ratio = on_page.shape[0] / on_page.shape[1]
    assert ratio == pytest.approx(0.5 * height, abs=0.01)


def test_pairs_of_stages_have_files_of_their_own(tmp_path):
    pairs = [("1_2", "3"), ("1", "2_3"), ("1%u2", "3"), ("1", "2%u3")]
    stems = {ChangePicture("x", one, tmp_path).stem for one in pairs}
    assert len(stems) == len(pairs)


def test_a_change_stands_once_beside_that_of_its_control():
    def row(database, query, stage, metric, value):
        return Row(
            "stages", "town", database, query, 1, {STAGE: stage}, "change", "",
            False, metric=metric, value=value, **made_by(RANDOM_YAW_PROTOCOL),
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
    assert cells == ["0.25", "0.02", "0.12", "", ""]
