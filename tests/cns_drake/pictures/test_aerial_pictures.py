"""Drives from above: the view shows all of them, north up."""

from helpers.small_map import write_small_map
from matplotlib.image import imread
import numpy as np
import pytest
import yaml

from cns_drake.pictures.aerial_pictures import draw_drives, view_from_above
from cns_drake.scenarios.scenario_files import load_scenario
from cns_drake.scenarios.shipped import shipped_drives

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
        r, g, b = np.moveaxis(panel, -1, 0)
        # Saturated red and blue belong to the route: the boxes are grey.
        assert np.count_nonzero((r > 0.6) & (g < 0.4) & (b < 0.2)) > 100
        assert np.count_nonzero((b > 0.6) & (r < 0.4)) > 100
    assert np.abs(left - right).max() > 0.5
    assert [path.name for path in picture.parent.iterdir()] == ["drives.png"]
