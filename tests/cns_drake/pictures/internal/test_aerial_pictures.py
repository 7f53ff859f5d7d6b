"""Drives from above: the view shows all of them, north up."""

from helpers.small_map import write_small_map
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.image import imread
import numpy as np
import pytest
import yaml

from cns_drake.pictures import draw_drives
from cns_drake.pictures.aerial_pictures import (
    _SIDE,
    _draw_key,
    _draw_route,
    _draw_scale_bar,
    view_from_above,
)
from cns_drake.scenarios import load_scenario, shipped_drives

pytestmark = pytest.mark.slow


def test_the_view_shows_every_position_north_up():
    rng = np.random.default_rng(4)
    positions = rng.uniform([-300, 20, 0], [100, 180, 8], (200, 3))
    view = view_from_above(positions)
    pixels, shown = view.project(positions, 500, 500)
    assert len(shown) == 200
    assert np.corrcoef(pixels[:, 0], positions[:, 0])[0, 1] > 0.999
    assert np.corrcoef(pixels[:, 1], positions[:, 1])[0, 1] < -0.999
    # The drives fill the picture: the margin is 40 m on 400 m of width.
    assert np.ptp(pixels[:, 0]) > 380


@pytest.mark.parametrize(
    ("width", "bar"), [(20.0, "20 m"), (320.0, "100 m"), (4000.0, "1000 m")]
)
def test_scale_bar_has_its_length(width, bar):
    view = view_from_above(np.array([[-width / 2, 9, 5], [width / 2, 9, 5]]))
    axes = Figure().subplots()
    _draw_scale_bar(axes, view)
    assert axes.texts[0].get_text() == bar
    length = float(bar.split()[0])
    ends = np.array([[0.0, 9.0, 5.0], [length, 9.0, 5.0]])
    pixels, _ = view.project(ends, _SIDE, _SIDE)
    left, right = axes.lines[0].get_xdata()
    assert right - left == pytest.approx(np.ptp(pixels[:, 0]))


def test_key_names_both_ends_of_a_route():
    figure = Figure()
    _draw_key(figure)
    (key,) = figure.legends
    assert [text.get_text() for text in key.get_texts()] == ["start", "end"]
    circle, square = (one.get_marker() for one in key.get_lines())
    assert (circle, square) == ("o", "s")


@pytest.mark.parametrize("degrees", [0.0, 30.0, 90.0, 200.0])
def test_arrow_heads_point_along_the_route(degrees):
    heading = np.deg2rad(degrees)
    along = np.array([np.cos(heading), np.sin(heading), 0.0])
    positions = np.linspace(-200.0, 200.0, 400)[:, None] * along
    axes = Figure().subplots()
    _draw_route(axes, view_from_above(positions), positions)
    heads = [
        line.get_marker()
        for line in axes.lines
        if isinstance(line.get_marker(), tuple)
    ]
    assert len(heads) > 3
    for corners, _, turned in heads:
        assert corners == 3
        # Zero points up, which is north; angles are against the clock.
        assert np.cos(np.deg2rad(turned + 90.0 - degrees)) > 0.999


@pytest.mark.night
def test_drives_are_drawn_over_their_stages(tmp_path):
    folder = write_small_map(tmp_path / "boxes")
    scenarios = {}
    for stage in ("01", "04"):
        source = shipped_drives()[f"metropolis_{stage}"]
        values = yaml.safe_load(source.read_text()) | {"map": "."}
        path = folder / f"sequence_{stage}.yaml"
        path.write_text(yaml.safe_dump(values))
        scenarios[f"boxes {stage}"] = load_scenario(path)
    picture = tmp_path / "new" / "drives.png"
    draw_drives(scenarios, picture)
    rgb = imread(picture)[..., :3]
    height, width, _ = rgb.shape
    assert 1.7 < width / height < 2.1
    left, right = rgb[:, : width // 2], rgb[:, width // 2 :]
    for panel in (left, right):
        # The route is nearly black: the boxes are grey.
        route = np.abs(panel - to_rgb("#1c2430")).max(axis=2) < 0.02
        assert np.count_nonzero(route) > 100
    assert np.abs(left - right).max() > 0.5
    assert [path.name for path in picture.parent.iterdir()] == ["drives.png"]
