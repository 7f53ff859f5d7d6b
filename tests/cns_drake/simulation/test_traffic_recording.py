"""Recordings with traffic: interrupted, cut short, exported."""

from helpers.meshcat_pages import objects, read_commands, tracks
from helpers.recorded_traffic import write_rounds
from helpers.small_city import ROADS
from helpers.small_map import write_small_map
from helpers.tiny_drive import tiny_scenario
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cns_drake.export import export_drive
from cns_drake.simulation import simulate
from evaluation.drives import McapDrive
from worlds.shapes import MOVING_IDS

pytestmark = pytest.mark.slow

# More than fits into a chunk of the recording.
FRAMES = 30
UNIT = {
    "preset": "vlp-16",
    "columns": 64,
    "range_noise": 0.02,
    "motion_distortion": True,
}


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    folder = tmp_path_factory.mktemp("traffic")
    town = write_small_map(folder / "town")
    (town / "roads.yaml").write_text(ROADS)
    write_rounds(town / "traffic.npz")
    # The ids of traffic follow this one: they need more than a byte.
    with (town / "structures.csv").open("a") as table:
        table.write("300,mast,pole\n")
    return tiny_scenario(
        folder,
        world=None,
        map=str(town),
        stage="04",
        traffic={"vehicles": 20, "walkers": 50, "seed": 11},
        lidars={"lidar": UNIT},
        frames=FRAMES,
    )


@pytest.fixture(scope="module")
def recording(scenario, tmp_path_factory):
    # As deep as others: the way to the map is recorded.
    return simulate(scenario, tmp_path_factory.mktemp("whole")).folder


@pytest.fixture(scope="module")
def moving(recording):
    """Instance -> label of the moving objects in all scans."""
    found = {}
    for scan in McapDrive(recording):
        rows = scan[scan["label"] >= min(MOVING_IDS.values())]
        found.update(
            zip(rows["instance"].tolist(), rows["label"].tolist(), strict=True)
        )
    return found


def messages(folder):
    """Returns topic, time and bytes of all messages."""
    path = folder / f"{folder.name}_0.mcap"
    with path.open("rb") as stream:
        return [
            (channel.topic, message.log_time, message.data)
            for _, channel, message in make_reader(stream).iter_messages()
        ]


def test_a_shorter_recording_begins_alike(scenario, recording, tmp_path):
    """The plan of traffic is that of the whole drive."""
    short = scenario.model_copy(update={"frames": 5})
    cut = messages(simulate(short, tmp_path).folder)
    whole = messages(recording)
    assert {topic for topic, _, _ in cut} >= {"/objects", "/lidar/points"}
    # `/tf` goes on to the end of the last scan.
    end = max(stamp for topic, stamp, _ in cut if topic == "/lidar/points")
    assert [one for one in cut if one[1] <= end] == [
        one for one in whole if one[1] <= end
    ]
    assert {topic for topic, stamp, _ in cut if stamp > end} <= {"/tf"}


def test_a_page_moves_vehicles_and_walkers(scenario, tmp_path):
    """They move like the recorded boxes, which are fixed to vehicles."""
    short = scenario.model_copy(update={"frames": 12})
    page = tmp_path / "page.html"
    folder = simulate(short, tmp_path, page_file=page).folder
    commands = read_commands(page.read_text())
    drawn, moved = objects(commands), tracks(commands)
    names = {
        str(number): one["name"]
        for number, one in McapDrive(folder).instances.items()
    }
    boxes = read_boxes(folder)
    first, last = boxes[0], boxes[-1]
    walkers = [name for name in names.values() if name.startswith("walker")]
    assert len(walkers) == 50
    assert moved.keys() >= {f"/moving/{name}" for name in walkers}
    ways = []
    for number in first.keys() & last.keys():
        if not names[number].startswith("traffic"):
            continue
        path = f"/moving/{names[number]}"
        assert any(key.startswith(f"{path}/") for key in drawn)
        keys = moved[path]
        assert [key["time"] for key in keys[".position"]] == [0, 5, 10, 11]
        p_FCs = [
            Rotation.from_quat(keys[".quaternion"][k]["value"]).inv()
            .apply(box - keys[".position"][k]["value"])
            for k, box in ((0, first[number]), (-1, last[number]))
        ]  # fmt: skip
        np.testing.assert_allclose(p_FCs[1], p_FCs[0], atol=1e-6)
        ways.append(np.linalg.norm(last[number] - first[number]))
    assert len(ways) > 5
    assert max(ways) > 1.0


def read_boxes(folder):
    """Returns for each message of `/objects` the centres of boxes, by id."""
    with (folder / f"{folder.name}_0.mcap").open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        return [
            {
                one.id: np.array(
                    [
                        one.bbox.center.position.x,
                        one.bbox.center.position.y,
                        one.bbox.center.position.z,
                    ]
                )
                for one in message.detections
            }
            for *_, message in reader.iter_decoded_messages(["/objects"])
        ]


def test_kitti_has_moving_labels_and_instances(recording, moving, tmp_path):
    # Scans show cars, people, and a class that needs more than a byte.
    assert {252, 254} < set(moving.values())
    assert max(moving.values()) > 255
    assert min(moving) > 300
    folder = export_drive(McapDrive(recording), "kitti", tmp_path)
    drive = McapDrive(recording)
    names = {i: one["class"] for i, one in drive.instances.items()}
    for instance, label in moving.items():
        assert label == MOVING_IDS[names[instance]]
    exported = {}
    for k, scan in enumerate(drive):
        stored = np.fromfile(folder / f"labels/{k:06d}.label", "<u4")
        np.testing.assert_array_equal(stored & 0xFFFF, scan["label"])
        np.testing.assert_array_equal(stored >> 16, scan["instance"])
        rows = stored[(stored & 0xFFFF) >= 252]
        exported.update(
            zip((rows >> 16).tolist(), (rows & 0xFFFF).tolist(), strict=True)
        )
    assert exported == moving
