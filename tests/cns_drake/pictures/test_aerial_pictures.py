"""Drives from above: the view shows all of them, north up."""

from helpers.small_map import write_small_map
from matplotlib.colors import to_rgb
from matplotlib.image import imread
import numpy as np
import pytest
import yaml

from cns_drake.pictures import draw_drives
from cns_drake.scenarios import load_scenario
from worlds.maps import recordable_drives

pytestmark = pytest.mark.slow


@pytest.mark.night
def test_drives_are_drawn_over_their_stages(tmp_path):
    folder = write_small_map(tmp_path / "boxes")
    scenarios = {}
    for stage in ("01", "04"):
        source = recordable_drives()[f"metropolis_{stage}"]
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
