from functools import partial
import zlib

from helpers.meshcat_pages import (
    colors,
    objects,
    properties,
    read_commands,
    tracks,
    vertices,
)
from helpers.scripted_car import film
import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
import pytest

from cns_drake.pictures import ShownStages, height_rgb
from cns_drake.scene import load_world
from cns_drake.sensors import POINT_DTYPE
from evaluation.base import InputError
from worlds.shapes import CLASS_RGB

PERIOD = 0.05
NUM_FRAMES = 101
SPEED = 10.0
X_BSs = {
    "lidar": RigidTransform(RollPitchYaw(0.0, 0.0, 0.5), [0.0, 0.0, 1.6]),
    "rear": RigidTransform(RollPitchYaw(0.1, 0.2, 3.0), [-1.0, 0.5, 1.0]),
}
STRUCTURES = """instance,name,class
1,ground,terrain
2,hall_001,building
3,hall_002,building
4,lamp_001,pole
"""
GROUND = (
    '<visual name="ground/slab"><pose>0 0 -0.1 0 0 0</pose><geometry><box>'
    "<size>80 80 0.2</size></box></geometry></visual>"
)
HALL_001 = (
    '<visual name="hall_001/wall"><pose>-15 8 3 0 0 0.3</pose><geometry>'
    "<box><size>8 4 6</size></box></geometry><material><diffuse>0.8 0.5 0.2 1"
    "</diffuse></material></visual>"
)
HALL_001_HIGHER = HALL_001.replace("8 4 6", "8 4 12").replace("8 3 0", "8 6 0")
HALL_002 = (
    '<visual name="hall_002/wall"><pose>10 8 4 0 0 0</pose><geometry><box>'
    "<size>10 4 8</size></box></geometry></visual>"
)
LAMP_001 = (
    '<visual name="lamp_001/post"><pose>0 -5 3 0 0 0</pose><geometry>'
    "<cylinder><radius>0.2</radius><length>6</length></cylinder></geometry>"
    "</visual>"
)
VEHICLE = """<sdf version="1.9"><model name="vehicle">
<link name="base_link"><visual name="body"><pose>1 0 1 0 0 0</pose>
<geometry><box><size>4 2 1</size></box></geometry><material>
<diffuse>0.1 0.2 0.9 1</diffuse></material></visual></link>
<link name="wheel"><pose>2 0 0.3 0 0 0</pose><visual name="tyre">
<pose>0 0 0 1.5708 0 0</pose><geometry><cylinder><radius>0.3</radius>
<length>2</length></cylinder></geometry></visual></link>
<joint name="axle" type="revolute"><parent>base_link</parent>
<child>wheel</child><axis><xyz>0 1 0</xyz></axis></joint>
</model></sdf>"""


def write_stage(path, *visuals):
    path.write_text(
        '<sdf version="1.9"><world name="town"><model name="town">'
        f'<static>true</static><link name="city">{"".join(visuals)}</link>'
        "</model></world></sdf>"
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("world")
    (folder / "structures.csv").write_text(STRUCTURES)
    (folder / "vehicle.sdf").write_text(VEHICLE)
    write_stage(folder / "stage_01.sdf", GROUND, HALL_001)
    write_stage(folder / "stage_02.sdf", GROUND, HALL_001, HALL_002, LAMP_001)
    write_stage(folder / "stage_03.sdf", GROUND, HALL_001_HIGHER)
    return folder


def X_WB_at(time):
    return RigidTransform(
        RollPitchYaw(0.0, 0.0, 0.1 * time), [SPEED * time - 25.0, 1.0, 0.0]
    )


def scan_at(time, name):
    """A scan of 20 points, 3 m apart in z, so that thinning keeps all."""
    scan = np.zeros(20, POINT_DTYPE)
    scan["x"] = 5.0 + time
    scan["y"] = list(X_BSs).index(name)
    scan["z"] = 3.0 * np.arange(20)
    return scan


def imu_at(time):
    return (1.0 * time, 2.0 * time, 3.0 * time), (2 * time, 4 * time, 6 * time)


def drive(
    folder,
    stage,
    other_stage,
    num_frames=NUM_FRAMES,
    is_earlier=False,
    **kwargs,
):
    """Returns a recorder that has seen a drive of 0.5 m a frame."""
    world = load_world(folder / f"{stage}.sdf", vehicle=folder / "vehicle.sdf")
    other = other_stage and load_world(folder / f"{other_stage}.sdf")
    return film(
        world,
        X_WB_at,
        lambda time: (0.0, 0.0, 0.1, SPEED, 0.0, 0.0),
        imu_at,
        {name: partial(scan_at, name=name) for name in X_BSs},
        num_frames,
        period=PERIOD,
        angles_at={"axle": lambda time: time},
        X_BSs=X_BSs,
        shown=ShownStages(other, is_earlier=is_earlier),
        **kwargs,
    )


def page_commands(recorder, path):
    recorder.save(path, title="town_01")
    return read_commands(path.read_text())


@pytest.fixture(scope="module")
def early_page(folder):
    recorder = drive(folder, "stage_01", "stage_02")
    path = folder / "early.html"
    recorder.save(path, title="town_01")
    return path


@pytest.fixture(scope="module")
def early(early_page):
    return read_commands(early_page.read_text())


def test_city_is_one_mesh_for_each_class(early):
    drawn = {p for p in objects(early) if p.startswith("/city/")}
    assert drawn == {"/city/building", "/city/terrain"}
    ground = vertices(objects(early)["/city/terrain"])
    assert len(ground) == 8  # A box shares its corners.
    np.testing.assert_allclose(ground.min(axis=0), [-40, -40, -0.2], atol=1e-2)
    np.testing.assert_allclose(ground.max(axis=0), [40, 40, 0.0], atol=1e-2)


def test_city_stands_where_the_model_says(early):
    X_WG = RigidTransform(RollPitchYaw(0, 0, 0.3), [-15.0, 8.0, 3.0])
    p_GV = X_WG.inverse() @ vertices(objects(early)["/city/building"]).T
    np.testing.assert_allclose(
        np.abs(p_GV), np.tile([[4.0], [2.0], [3.0]], 8), atol=1e-2
    )


def test_city_has_its_own_colours(early):
    drawn, settings = objects(early), properties(early)
    diffuse = {"building": (0.8, 0.5, 0.2), "terrain": CLASS_RGB["terrain"]}
    for semantic_class, rgb in diffuse.items():
        path = f"/city/{semantic_class}"
        np.testing.assert_allclose(
            colors(drawn[path]), np.tile(rgb, (8, 1)) ** 1.8, atol=1e-6
        )
        # The material does not tint them.
        assert settings[path, "color"] == [1.0, 1.0, 1.0, 1.0]


def test_structures_that_the_stage_lacks_are_a_layer(early):
    assert {
        p for p in objects(early) if p.startswith(("/before", "/after"))
    } == {
        "/after/building",
        "/after/pole",
    }
    hall = vertices(objects(early)["/after/building"])
    np.testing.assert_allclose(hall.min(axis=0), [5, 6, 0], atol=1e-2)
    np.testing.assert_allclose(hall.max(axis=0), [15, 10, 8], atol=1e-2)
    # Off at first.
    assert properties(early)["/after", "visible"] is False


def test_lower_structures_are_a_layer(folder, tmp_path):
    recorder = drive(folder, "stage_01", "stage_03", num_frames=2)
    commands = page_commands(recorder, tmp_path / "lower.html")
    drawn = objects(commands)
    hall = vertices(drawn["/after/building"])
    assert hall[:, 2].max() == pytest.approx(12.0)
    assert vertices(drawn["/city/building"])[:, 2].max() == pytest.approx(6.0)
    assert properties(commands)["/after", "visible"] is False


@pytest.mark.parametrize("is_earlier", [True, False])
def test_structures_that_the_stage_has_in_addition_are_a_layer(
    folder, tmp_path, is_earlier
):
    recorder = drive(
        folder, "stage_02", "stage_01", is_earlier=is_earlier, num_frames=2
    )
    commands = page_commands(recorder, tmp_path / "late.html")
    drawn = objects(commands)
    side = "/after" if is_earlier else "/before"
    assert {p for p in drawn if p.startswith(("/before", "/after"))} == {
        f"{side}/building",
        f"{side}/pole",
    }
    assert properties(commands)[side, "visible"] is True
    # The structure is not in the city as well; it needs a colour of its own.
    assert len(vertices(drawn["/city/building"])) == 8
    assert "/city/pole" not in drawn


def test_without_another_stage_all_is_city(folder, tmp_path):
    recorder = drive(folder, "stage_02", None, num_frames=2)
    drawn = objects(page_commands(recorder, tmp_path / "alone.html"))
    assert not [p for p in drawn if p.startswith(("/before", "/after"))]
    assert len(vertices(drawn["/city/building"])) == 16
    assert "/city/pole" in drawn


def test_vehicle_moves_through_every_frame(early):
    drawn = objects(early)
    body = vertices(drawn["/vehicle/base_link/0"])
    np.testing.assert_allclose(body.min(axis=0), [-1, -1, 0.5], atol=1e-2)
    keys = tracks(early)["/vehicle/base_link"]
    positions = keys[".position"]
    assert [key["time"] for key in positions] == list(range(NUM_FRAMES))
    for frame, (position, rotation) in enumerate(
        zip(positions, keys[".quaternion"], strict=True)
    ):
        X_WB = X_WB_at(frame * PERIOD)
        np.testing.assert_allclose(
            position["value"], X_WB.translation(), atol=1e-9
        )
        x, y, z, w = rotation["value"]
        assert (x, y) == pytest.approx((0.0, 0.0), abs=1e-9)
        assert 2.0 * np.arctan2(z, w) == pytest.approx(0.1 * frame * PERIOD)


def test_wheels_turn(early):
    keys = tracks(early)["/vehicle/wheel"]
    last = keys[".quaternion"][-1]["value"]
    X_WB = X_WB_at((NUM_FRAMES - 1) * PERIOD)
    R = X_WB.rotation() @ RollPitchYaw(0, 5.0, 0).ToRotationMatrix()
    expected = R.ToQuaternion().wxyz()[[1, 2, 3, 0]]
    assert abs(np.dot(last, expected)) == pytest.approx(1.0)


def test_motion_is_taken_down_at_every_frame(folder):
    seen = drive(folder, "stage_01", None, num_frames=3).drive
    assert seen.speeds == [SPEED] * 3
    steps = np.outer(np.arange(3) * PERIOD, [1.0, 2.0, 3.0])
    np.testing.assert_allclose(seen.specific_forces_I, steps)
    np.testing.assert_allclose(seen.angular_velocities_I, 2 * steps)


def unpacked(scan):
    """Returns the points of a packed scan (N, 3), as its docstring says.

    Also returns the intensities and kinds (N, 2).
    """
    planes = np.frombuffer(zlib.decompress(scan.data), np.uint8)
    planes = planes.reshape(8, -1).astype(int)
    low, high = planes[:6].reshape(3, 2, -1).swapaxes(0, 1)
    signless = low + 256 * high
    steps = np.where(signless % 2, -(signless + 1) // 2, signless // 2)
    q = np.cumsum(steps, axis=1).astype(np.int16)
    marks = np.cumsum(planes[6:], axis=1).astype(np.uint8)
    return np.array(scan.origin) + scan.grid * q.T, marks.T


def test_scans_have_every_point_where_it_was_measured(folder):
    scans = drive(folder, "stage_01", "stage_02", num_frames=5).drive.scans
    assert scans.stride == 1
    for k, scan in enumerate(scans.scans):
        expected = []
        for name, X_BS in X_BSs.items():
            points = scan_at(k * PERIOD, name)
            p_SR = np.stack([points["x"], points["y"], points["z"]])
            expected.append((X_WB_at(k * PERIOD) @ X_BS @ p_SR).T)
        assert scan.frame == k
        np.testing.assert_allclose(
            unpacked(scan)[0], np.concatenate(expected), atol=scan.grid / 1.99
        )
    assert len(scans.scans) == 5


def test_points_tell_intensity_class_and_change(folder):
    """Of stage 02, stage 01 lacks the second hall and the lamp."""
    world = load_world(folder / "stage_02.sdf", vehicle=folder / "vehicle.sdf")
    other = load_world(folder / "stage_03.sdf")
    scan = np.zeros(6, POINT_DTYPE)
    scan["z"] = [0.0, 3.0, 3.0, 3.0, 11.9, 12.9]
    scan["instance"] = [1, 3, 4, 2, 2, 2]
    scan["label"] = [72, 50, 80, 252, 50, 50]
    scan["intensity"] = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5]

    def kinds(world, other):
        recorder = film(
            world,
            lambda time: RigidTransform(),
            lambda time: np.zeros(6),
            imu_at,
            {"lidar": lambda time: scan},
            1,
            period=PERIOD,
            X_BSs={"lidar": RigidTransform()},
            shown=ShownStages(other),
        )
        (packed,) = recorder.drive.scans.scans
        return unpacked(packed)[1]

    intensities, marks = kinds(world, other).T
    assert (np.diff(intensities.astype(int)) > 0).all()
    assert (intensities[0], intensities[-1]) == (0, 63)
    assert (marks >= 128).tolist() == [False, True, True, False, False, False]
    terrain, building, pole, car, *halls = (marks & 127).tolist()
    assert halls == [building, building]
    assert len({terrain, building, pole, car}) == 4
    # Above 6.5 m, the hall of stage 03 is what stage 01 lacks.
    higher = load_world(folder / "stage_03.sdf", vehicle=folder / "vehicle.sdf")
    scan["z"][3] = 6.4
    marks = kinds(higher, load_world(folder / "stage_01.sdf"))[:, 1]
    assert (marks[3:] >= 128).tolist() == [False, True, True]


def test_points_are_the_brighter_the_higher():
    luminance = height_rgb(np.linspace(-1.0, 26.0, 10)) @ [
        0.2126,
        0.7152,
        0.0722,
    ]
    assert (np.diff(luminance[1:-1]) > 0.0).all()


def test_the_route_is_a_ribbon_of_one_colour(early):
    route = objects(early)["/route"]
    p = vertices(route).reshape(2, NUM_FRAMES, 3)
    middle = p.mean(axis=0)
    for frame in (0, 60, NUM_FRAMES - 1):
        np.testing.assert_allclose(
            middle[frame][:2],
            X_WB_at(frame * PERIOD).translation()[:2],
            atol=1e-2,
        )
    # Its vertices have no colours of their own.
    assert "color" not in route["data"]["attributes"]


def test_one_frame_makes_a_page(folder, tmp_path):
    recorder = drive(folder, "stage_01", None, num_frames=1)
    commands = page_commands(recorder, tmp_path / "one.html")
    assert "/vehicle/base_link" in tracks(commands)
    assert "/route" not in objects(commands)


def test_page_that_cannot_be_written_is_named(folder, tmp_path):
    recorder = drive(folder, "stage_01", None, num_frames=1)
    path = tmp_path / "none" / "page.html"
    with pytest.raises(InputError, match=r"page\.html: No such file"):
        recorder.save(path)
