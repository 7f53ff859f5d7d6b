"""Pictures of stages: positions of structures, and visible changes."""

from matplotlib.image import imread
import numpy as np
import pytest

from cns_drake.pictures import draw_stages, load_views
from evaluation.base import InputError
from worlds.maps import shipped_maps


@pytest.mark.slow
@pytest.mark.night
def test_stages_are_drawn_side_by_side(small_map, tmp_path):
    view = load_views(shipped_maps()["metropolis"] / "views.yaml")["street"]
    stages = {name: small_map / f"stage_{name}.sdf" for name in ("01", "04")}
    path = tmp_path / "pictures" / "stages.png"
    draw_stages(stages, view, path)
    picture = imread(path)
    middle = picture.shape[1] // 2
    left, right = picture[:, :middle, :3], picture[:, -middle:, :3]
    assert np.abs(left - right).max() > 0.2  # The stages differ,
    # and both halves of both rows, above the colour bar, show something.
    for half in (left, right):
        for rows in np.array_split(half[: int(0.85 * len(half))], 2):
            assert rows.std() > 0.02
    assert [p.name for p in path.parent.iterdir()] == ["stages.png"]


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("street: {position: [0, 0], target: [1, 1, 1]}", "street.position"),
        ("street: {position: [0, 0, 1]}", "street.target"),
        (
            "street: {position: [0, 0, 1], target: [0, 0, 1]}",
            "street: position and target are the same",
        ),
        (
            "street: {position: [0, 0, 1], target: [1, 0, 1], fov_y_deg: 0}",
            "street.fov_y_deg",
        ),
        (
            "street: {position: [0, 0, 1], target: [1, 0, 1], fov_y: 50}",
            "street.fov_y: ",
        ),
        ("street: {position: [0, 0, .inf], target: [1, 0, 1]}", "position.2"),
        ("- 1", "views.yaml: "),
    ],
)
def test_bad_views_are_named(tmp_path, text, fault):
    path = tmp_path / "views.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=fault) as caught:
        load_views(path)
    assert "\n" not in str(caught.value)


def test_missing_views(tmp_path):
    with pytest.raises(InputError, match=r"views\.yaml: No such file"):
        load_views(tmp_path / "views.yaml")
