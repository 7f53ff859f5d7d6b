"""Pictures of stages: positions of structures, and visible changes."""

from matplotlib.image import imread
import numpy as np
from pydrake.geometry import FrameId, GeometryId
from pydrake.math import RigidTransform
import pytest

from cns_drake.base import InputError
from cns_drake.pictures import draw_stages, load_views
from cns_drake.pictures.camera_views import look_at
from cns_drake.pictures.stage_scene import render
from cns_drake.ray_casting import RayCastingScene
from cns_drake.scenarios import shipped_maps
from cns_drake.scene import EllipsoidSurface, PerceptionGeometry


def ball(position, rgb):
    return PerceptionGeometry(
        geometry_id=GeometryId.get_new_id(),
        name="ball",
        frame_id=FrameId.get_new_id(),
        X_FG=RigidTransform(position),
        surface=EllipsoidSurface((0.5, 0.5, 0.5)),
        rgb=rgb,
    )


@pytest.mark.parametrize("p_WT", [[9, 4, 1], [-3, -8, 6], [1, 2, -40]])
def test_look_at_points_x_at_the_target_and_z_up(p_WT):
    X_WC = look_at([1.0, 2.0, 3.0], p_WT)
    p_CT = X_WC.inverse() @ np.array(p_WT, float)
    np.testing.assert_allclose(p_CT[1:], 0.0, atol=1e-9)
    assert p_CT[0] > 0
    assert X_WC.rotation().matrix()[2, 2] >= -1e-9
    assert X_WC.rotation().IsValid()


def test_balls_appear_where_they_are_and_in_their_colours():
    geometries = [
        ball([10, 2.5, 0], (0.9, 0.1, 0.1)),  # Left.
        ball([10, -2.5, 0], (0.1, 0.1, 0.9)),  # Right.
        ball([10, 0, 2.0], (0.1, 0.9, 0.1)),  # Above.
    ]
    frames = {geometry.frame_id for geometry in geometries}
    scene = RayCastingScene(geometries, frames, lambda f: RigidTransform())
    picture = render(
        scene, geometries, RigidTransform(), width=160, height=90, fov_y_deg=50
    ).astype(int)
    scale = 45 / np.tan(np.deg2rad(25))
    for (y, z), channel in [((2.5, 0), 0), ((-2.5, 0), 2), ((0, 2.0), 1)]:
        column = int(80 - scale * y / 10)
        row = int(45 - scale * z / 10)
        pixel = picture[row, column]
        assert np.argmax(pixel) == channel
        assert pixel[channel] > 2 * np.delete(pixel, channel).max()
    sky = picture[5, 5]
    assert sky[2] >= sky[0] > 100


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
        ("street: [", "not readable as YAML"),
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
