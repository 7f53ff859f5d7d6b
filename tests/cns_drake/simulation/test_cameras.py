"""Cameras of a scenario: images, depths, classes, places and stamps.

Oracle: the points of an exact LiDAR, projected by the messages alone.
"""

import base64
import io
import math
import re

from helpers.bag_recordings import messages_by_topic
from helpers.message_digests import message_digests
from helpers.tiny_drive import tiny_scenario
import numpy as np
from PIL import Image
import pytest
from scipy.spatial.transform import Rotation

from cns_drake.scenarios import load_scenario
from cns_drake.sensors import check_renderer
from cns_drake.simulation import simulate
from evaluation.base import InputError
from evaluation.drives import McapDrive

LIDARS = {
    "lidar": {"preset": "os1-32", "columns": 600, "rate": 10, "resolution": 0}
}
CAMERAS = {
    "front": {
        "width": 320,
        "height": 240,
        "rate": 5,
        "fov_y_deg": math.degrees(1.2),
        "xyz": [0.5, 0.2, 1.9],
        "rpy_deg": [3.0, 6.0, -11.0],
        "depth": True,
        "label": True,
    },
    "left": {"width": 64, "height": 32, "rate": 10, "rpy_deg": [0, 0, 90]},
}
FRAMES = 5


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cameras")
    (folder / "structures.csv").write_text(
        "instance,name,class\n1,ground,terrain\n2,hall,building\n"
    )
    scenario = tiny_scenario(
        folder, lidars=LIDARS, cameras=CAMERAS, frames=FRAMES
    )
    return simulate(scenario, folder / "out").folder


@pytest.fixture(scope="module")
def messages(recording):
    return messages_by_topic(recording)


def frames_of(messages):
    """Returns frame -> its pose in base_link."""
    poses = {}
    for one in messages["/tf_static"][0][1].transforms:
        place, turn = one.transform.translation, one.transform.rotation
        X = np.eye(4)
        quaternion = [turn.x, turn.y, turn.z, turn.w]
        X[:3, :3] = Rotation.from_quat(quaternion).as_matrix()
        X[:3, 3] = place.x, place.y, place.z
        poses[one.child_frame_id] = X
    return poses


@pytest.mark.slow
def test_topics_and_stamps(messages):
    scans = [stamp for stamp, _ in messages["/lidar/points"]]
    assert len(scans) == FRAMES
    for topic, kind in (
        ("/front/image", "CompressedImage"),
        ("/front/depth", "Image"),
        ("/front/label", "Image"),
        ("/front/camera_info", "CameraInfo"),
        ("/left/image", "CompressedImage"),
        ("/left/camera_info", "CameraInfo"),
    ):
        name = topic.split("/")[1]
        expected = scans[:: 2 if name == "front" else 1]
        assert [stamp for stamp, _ in messages[topic]] == expected
        for stamp, message in messages[topic]:
            assert message.__msgtype__ == f"sensor_msgs/msg/{kind}"
            assert message.header.frame_id == name
            own = message.header.stamp
            assert own.sec * 10**9 + own.nanosec == stamp
    assert {"/left/depth", "/left/label"}.isdisjoint(messages)


def test_optical_frames_lie_where_the_scenario_says(messages):
    """z is ahead, x to the right, y down."""
    X_BC = frames_of(messages)["front"]
    R = Rotation.from_euler(
        "xyz", CAMERAS["front"]["rpy_deg"], degrees=True
    ).as_matrix()
    np.testing.assert_allclose(X_BC[:3, 3], CAMERAS["front"]["xyz"])
    for column, axis in ((2, R[:, 0]), (0, -R[:, 1]), (1, -R[:, 2])):
        np.testing.assert_allclose(X_BC[:3, column], axis, atol=1e-9)


def test_camera_info_is_that_of_the_field_of_view(messages):
    info = messages["/front/camera_info"][0][1]
    focal = 120.0 / np.tan(0.6)
    # Drake renders half a pixel off its own K.
    K = [[focal, 0, 159.0], [0, focal, 119.0], [0, 0, 1]]
    np.testing.assert_allclose(info.k.reshape(3, 3), K)
    assert (info.width, info.height) == (320, 240)


def test_points_of_the_lidar_meet_depths_and_classes(recording, messages):
    """Within 2 cm of what lies half a pixel around; edges may differ."""
    poses = frames_of(messages)
    X_CL = np.linalg.inv(poses["front"]) @ poses["lidar"]
    K = messages["/front/camera_info"][0][1].k.reshape(3, 3)
    scans = McapDrive(recording)
    seen = set()
    for k, (depth, label) in enumerate(
        zip(messages["/front/depth"], messages["/front/label"], strict=True)
    ):
        depth, label = depth[1], label[1]
        assert (depth.encoding, label.encoding) == ("32FC1", "16UC1")
        Z = depth.data.view("<f4").reshape(240, 320)
        classes = label.data.view("<u2").reshape(240, 320)
        scan = scans.scan(2 * k)
        p = np.stack([scan["x"], scan["y"], scan["z"]], axis=1).astype(float)
        p_C = p @ X_CL[:3, :3].T + X_CL[:3, 3]
        ahead = p_C[:, 2] > 0.5
        p_C = p_C[ahead]
        expected = scan["label"][ahead]
        u, v = (p_C @ K.T)[:, :2].T / p_C[:, 2]
        col, row = np.rint([u, v]).astype(int)
        inside = (col > 0) & (col < 319) & (row > 0) & (row < 239)
        col = col[inside]
        row = row[inside]
        z = p_C[inside, 2]
        assert len(z) > 500
        around = np.stack(
            [Z[row + i, col + j] for i in (-1, 0, 1) for j in (-1, 0, 1)]
        )
        low, high = around.min(axis=0), around.max(axis=0)
        is_edge = high - low > 0.2 * z
        assert is_edge.mean() < 0.2
        sure = ~is_edge
        assert (z > low - 0.02)[sure].all()
        assert (z < high + 0.02)[sure].all()
        same = classes[row, col] == expected[inside]
        assert same[sure].mean() > 0.99
        seen |= set(np.unique(classes).tolist())
    # The sky has no class.
    assert seen == {0, 50, 72}


def test_images_are_jpegs_of_what_is_there(messages):
    picture = Image.open(io.BytesIO(messages["/front/image"][0][1].data))
    assert messages["/front/image"][0][1].format == "jpeg"
    assert picture.size == (320, 240)
    label = messages["/front/label"][0][1].data.view("<u2").reshape(240, 320)
    pixels = np.asarray(picture).astype(float)
    sky, ground = pixels[label == 0], pixels[label == 72]
    # A sky is blue above all, with clouds; grass is green.
    assert sky.mean(axis=0).argmax() == 2
    assert sky.mean(axis=0)[2] > 180.0
    assert ground.mean(axis=0).argmax() == 1
    assert ground.std(axis=0).min() > 2.0
    small = Image.open(io.BytesIO(messages["/left/image"][0][1].data))
    assert small.size == (64, 32)


@pytest.mark.night
def test_other_messages_are_those_without_cameras(recording, tmp_path):
    """And the same recording has the same bytes."""
    again = load_scenario(recording / "scenario.yaml")
    both = message_digests(simulate(again, tmp_path / "again").folder)
    assert both == message_digests(recording)
    without = simulate(again.replaced(cameras={}), tmp_path / "without").folder
    digests = message_digests(without)
    assert digests.keys() == both.keys() - {
        topic for topic in both if topic.startswith(("/front", "/left"))
    }
    for topic, digest in digests.items():
        # The frames of the cameras are added to it.
        assert (digest == both[topic]) == (topic != "/tf_static")


@pytest.mark.parametrize(
    ("camera", "fault"),
    [
        ({"fov": 1.0}, r"cameras\.c\.fov: "),
        ({"width": 4097}, r"cameras\.c\.width: .*4096"),
        ({"height": 0}, r"cameras\.c\.height: "),
        ({"width": "wide"}, r"cameras\.c\.width: "),
        ({"rate": 3}, r"cameras\.c\.rate: 3 does not divide 10"),
        ({"rate": 20}, r"cameras\.c\.rate: 20 does not divide 10"),
        ({"rate": 0}, r"cameras\.c\.rate: "),
        ({"fov_y_deg": 180.0}, r"cameras\.c\.fov_y_deg: "),
        ({"fov_y_deg": 0.0}, r"cameras\.c\.fov_y_deg: "),
        ({"rpy_deg": [0, 0, 3601]}, r"cameras\.c\.rpy_deg"),
        ({"fov_y": 50}, r"cameras\.c\.fov_y: .*did you mean fov_y_deg\?"),
        ({"rpy_deg": [0, 0]}, r"cameras\.c\.rpy_deg"),
        ({"xyz": [0, 0, float("nan")]}, r"cameras\.c\.xyz"),
    ],
)
def test_cameras_that_cannot_be(tmp_path, camera, fault):
    with pytest.raises(InputError, match=fault) as error:
        tiny_scenario(tmp_path, lidars=LIDARS, cameras={"c": camera})
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", ["lidar", "imu", "base_link", "map"])
def test_frames_have_names_of_their_own(tmp_path, name):
    with pytest.raises(InputError, match=f"cameras: '{name}' is the name of"):
        tiny_scenario(tmp_path, cameras={name: {}})


@pytest.mark.slow
def test_there_may_be_no_renderer(tmp_path, monkeypatch):
    """Without EGL's libraries, drawing ends the process that does it."""
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent")
    monkeypatch.delenv("DISPLAY", raising=False)
    check_renderer.cache_clear()
    scenario = tiny_scenario(tmp_path, cameras={"c": {}}, frames=2)
    with pytest.raises(InputError, match=r"^cameras: no renderer: .*libegl1"):
        simulate(scenario, tmp_path / "out")
    assert not (tmp_path / "out").exists()
    check_renderer.cache_clear()


def test_drive_page_shows_each_image_from_its_time(recording, tmp_path):
    scenario = load_scenario(recording / "scenario.yaml")
    page = tmp_path / "page.html"
    simulate(scenario, tmp_path / "out", page_file=page)
    text = page.read_text()
    for name, size, times in (
        ("front", (320, 240), ["0.00", "0.20", "0.40"]),
        ("left", (64, 32), ["0.00", "0.10", "0.20", "0.30", "0.40"]),
    ):
        end = text.index(f"<figcaption>Camera {name}</figcaption>")
        figure = text[text.rindex("<figure", 0, end) : end]
        found = re.findall(r'data-time="(.*?)" src=".*?base64,(.*?)"', figure)
        assert [time for time, _ in found] == times
        for _, jpeg in found:
            picture = Image.open(io.BytesIO(base64.b64decode(jpeg)))
            assert picture.size == size
