"""What holds of every reader of drives, whatever the format.

Each library that reads for the program leaves something out, or demands more
than the format; `LEFT_OUT` lists what is known of each.
"""

from concurrent.futures import ThreadPoolExecutor
import multiprocessing
import os
import pickle
import shutil
import time

from helpers.bags import cloud, header, pose, write_bag
from helpers.drive_files import T0_NS, make_scan, yaw_pose
from helpers.drive_folders import NUM_SCANS, STAMPS_NS, WRITERS, X_WB
import numpy as np
import pytest

from evaluation.base import (
    NS_PER_S,
    InputError,
    listed,
    user_errors,
    value_errors,
)
from evaluation.drives import (
    DataSet,
    Drive,
    FileDrive,
    PosedFiles,
    check_same_world,
    data_sets,
    open_drive,
    register_data_set,
)

NUM = 12
STAMPS = [T0_NS + 100_000_000 * k for k in range(NUM)]
CLOUD = "sensor_msgs/msg/PointCloud2"
ODOMETRY = "nav_msgs/msg/Odometry"
# Every printable character of ASCII but the slash, and some others.
NAMES = "".join(map(chr, range(32, 127))).replace("/", "") + "äß字"


def scan_of(k):
    return make_scan(np.random.default_rng(k).uniform(-20.0, 20.0, (50 + k, 3)))


def entries():
    """Returns clouds, and more poses than clouds, in the order of time."""
    found = [
        ("/points", CLOUD, ns, cloud(scan_of(k), "os", ns))
        for k, ns in enumerate(STAMPS)
    ]
    for k in range(-2, 3 * NUM):
        ns = T0_NS + 33_000_000 * k
        fields = {
            "header": header(ns, "map"),
            "child_frame_id": "os",
            "pose": {"pose": pose(yaw_pose(0.5 * k, 0.0, 0.0, 0.01 * k))},
        }
        found.append(("/odom", ODOMETRY, ns, fields))
    return sorted(found, key=lambda one: one[2])


def bag(storage, ending=""):
    def make(folder, log_times=None):
        return write_bag(
            folder / f"ride{ending}", entries(), storage, log_times=log_times
        )

    return make


def folder_of(write):
    """Returns a function that writes a drive in the layout of a data set."""

    def make(folder):
        rng = np.random.default_rng(3)
        scans = [rng.uniform(-20.0, 20.0, (50 + k, 3)) for k in range(8)]
        write(folder / "town_01", scans)
        return folder / "town_01"

    return make


def read_own(path, stamp_ns):
    return np.load(path)


class OwnFiles(FileDrive):
    """A drive of a plug-in that has a file for each scan."""

    def __init__(self, path, columns=None):
        scans = PosedFiles(
            listed(path, "*.npy"),
            STAMPS_NS,
            X_WB,
            world_frame="odom",
        )
        super().__init__(path, scans, read_own)


class OwnDrive(Drive):
    """A drive of a plug-in that has one file."""

    world_frame = "odom"

    def __init__(self, path, columns=None):
        self.name = path.stem
        self.path = path

    files = property(lambda self: (self.path,))
    stamps_ns = property(lambda self: STAMPS_NS)
    X_WS = property(lambda self: X_WB)

    def __len__(self):
        return NUM_SCANS

    def scan(self, index):
        with value_errors(self.path), user_errors(self.path):
            return np.load(self.path)[index]


def own(suffix):
    """Returns a function that writes a drive for one of these readers."""

    def make(folder):
        rng = np.random.default_rng(4)
        scans = np.zeros((NUM_SCANS, 40), [(axis, "<f4") for axis in "xyz"])
        for axis in "xyz":
            scans[axis] = rng.uniform(-20.0, 20.0, scans.shape)
        path = folder / f"town{suffix}"
        if suffix == ".one":
            with path.open("wb") as stream:
                np.save(stream, scans)
            return path
        path.mkdir()
        for k, scan in enumerate(scans):
            np.save(path / f"{k}.npy", scan)
        return path

    return make


@pytest.fixture(autouse=True)
def _plug_ins(monkeypatch):
    assert "mcap" in {*data_sets()}  # All are loaded.
    monkeypatch.setattr(data_sets(), "_members", {**data_sets()._members})
    for kind, suffix in ((OwnFiles, ".own"), (OwnDrive, ".one")):
        register_data_set(
            DataSet(
                kind.__name__,
                lambda path, suffix=suffix: path.suffix == suffix,
                kind,
                f"`*{suffix}`",
            )
        )


BAGS = {
    "ROS 1": bag("none", ".bag"),
    "ROS 1, bz2": bag("bz2", ".bag"),
    "SQLite": bag("sqlite3"),
    "SQLite, files compressed": bag("sqlite3-file"),
    "MCAP": bag("mcap"),
    "MCAP, files compressed": bag("mcap-file"),
}
OWN = {"a plug-in's files": own(".own"), "a plug-in's drive": own(".one")}
READERS = {
    **BAGS,
    **{name: folder_of(write) for name, write in WRITERS.items()},
    **OWN,
}


@pytest.fixture(params=READERS)
def made(request, tmp_path):
    return READERS[request.param](tmp_path)


def contents(drive):
    """Returns everything that is read of a drive, as bytes."""
    return [
        drive.stamps_ns.tobytes(),
        drive.X_WS.tobytes(),
        *(drive.scan(k).tobytes() for k in range(len(drive))),
    ]


def scan_bytes(drive, k):
    return drive.scan(k).tobytes()


def test_opened_twice_and_pickled(made):
    first = open_drive(made)
    known = contents(first)
    assert len(known) > NUM_SCANS
    second = open_drive(made)
    # The two are read in turn.
    for k in range(len(first)):
        assert scan_bytes(second, k) == scan_bytes(first, k)
    assert contents(second) == known
    assert contents(pickle.loads(pickle.dumps(first))) == known
    assert second.notes == first.notes


def test_read_by_threads(made):
    """One drive is read by threads in any order, while it is not read yet."""
    known = contents(open_drive(made))
    drive = open_drive(made)
    order = np.random.default_rng(5).integers(0, NUM_SCANS, 120).tolist()
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda k: scan_bytes(drive, k), order))
    assert found == [known[2 + k] for k in order]


GROUND_TRUTH = {
    "mulran": "global_pose.csv",
    "helipr": "LiDAR_GT/*",
    "nclt": "../groundtruth*",
    "boreas": "applanix/*",
    "cns": "gt.csv",
}


@pytest.mark.parametrize("name", GROUND_TRUTH)
def test_a_gap_of_ground_truth_needs_an_option(tmp_path, name):
    """Its receiver did not see the satellites for a while."""
    folder = READERS[name](tmp_path)
    (table,) = folder.glob(GROUND_TRUTH[name])
    lines = table.read_text().splitlines(keepends=True)
    table.write_text("".join(lines[:4] + lines[5:]))
    assert len(open_drive(folder, pose_gap=0.21)) == NUM_SCANS
    said = r"0\.2 s apart, more than 0\.19 s \(--pose-gap SECONDS allows more"
    with pytest.raises(InputError, match=said):
        open_drive(folder, pose_gap=0.19)


@pytest.mark.parametrize("name", OWN)
def test_a_plug_ins_odom_is_of_one_drive(tmp_path, name):
    (tmp_path / "other").mkdir()
    paths = [OWN[name](one) for one in (tmp_path, tmp_path / "other")]
    first, second = map(open_drive, paths)
    check_same_world(first, open_drive(paths[0]))
    with pytest.raises(InputError, match="poses in frame 'odom/"):
        check_same_world(first, second)


def _read_in_fork(drive, order, sender):
    try:
        sender.send([scan_bytes(drive, k) for k in order])
    except Exception as error:
        sender.send(error)


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_read_by_forks(made):
    """Forks share the opened files with their parent, which reads on."""
    drive = open_drive(made)
    known = contents(drive)
    context = multiprocessing.get_context("fork")
    rng = np.random.default_rng(6)
    workers = []
    for _ in range(3):
        order = rng.permutation(NUM_SCANS).tolist() * 3
        receiver, sender = context.Pipe(False)
        worker = context.Process(
            target=_read_in_fork, args=(drive, order, sender)
        )
        worker.start()
        workers.append((worker, receiver, order))
    for k in rng.integers(0, NUM_SCANS, 60).tolist():
        assert scan_bytes(drive, k) == known[2 + k]
    for worker, receiver, order in workers:
        assert receiver.recv() == [known[2 + k] for k in order]
        worker.join()
    # No fork has taken away what its parent reads.
    assert contents(drive) == known


@pytest.mark.parametrize("name", BAGS)
@pytest.mark.parametrize("order", ["reversed", "shuffled", "equal"])
def test_any_order_of_log_times(tmp_path, name, order):
    (tmp_path / "own").mkdir()
    known = contents(open_drive(BAGS[name](tmp_path / "own")))
    stamps = np.array([one[2] for one in entries()])
    log_times = {
        "reversed": stamps[::-1],
        "shuffled": np.random.default_rng(7).permutation(stamps),
        "equal": np.full(len(stamps), T0_NS),
    }[order]
    assert contents(open_drive(BAGS[name](tmp_path, log_times))) == known


@pytest.mark.parametrize("name", READERS)
def test_a_path_with_every_character(tmp_path, name):
    (tmp_path / "plain").mkdir()
    path = READERS[name](tmp_path / "plain")
    known = contents(open_drive(path))
    odd = tmp_path / NAMES
    shutil.copytree(tmp_path / "plain", odd)
    drive = open_drive(odd / path.relative_to(tmp_path / "plain"))
    assert contents(drive) == known
    assert contents(pickle.loads(pickle.dumps(drive))) == known


@pytest.mark.parametrize("name", ["ROS 1", "SQLite", "MCAP"])
@pytest.mark.parametrize("is_folder", [False, True])
def test_endings_in_upper_case(tmp_path, name, is_folder):
    """As old disks of cameras and recorders have them."""
    path = BAGS[name](tmp_path)
    known = contents(open_drive(path))
    folder = path if path.is_dir() else tmp_path
    (file,) = (one for one in folder.iterdir() if one.suffix != ".yaml")
    (folder / "metadata.yaml").unlink(missing_ok=True)
    file = file.rename(file.with_suffix(file.suffix.upper()))
    assert contents(open_drive(folder if is_folder else file)) == known


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize("share", [0.3, 0.8])
def test_a_truncated_end_is_refused_by_name(tmp_path, name, share):
    """Of the greatest scan, as after a full disk or a broken download."""
    path = READERS[name](tmp_path)
    files = [path] if path.is_file() else [*path.rglob("*.*")]
    texts = (".yaml", ".csv", ".txt")
    files = [one for one in files if one.is_file() and one.suffix not in texts]
    largest = max(files, key=lambda one: one.stat().st_size)
    size = int(share * largest.stat().st_size)
    largest.write_bytes(largest.read_bytes()[: size - size % 16 + 5])
    with pytest.raises(InputError) as error:
        contents(open_drive(path))
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


# What a library does not read of a bag, or demands beyond its format: what
# makes such a bag, and how it is refused by name. What is missing here is read:
# of rosbags, bags of several files, compressed files, `callerid` of
# connections, several connections of a topic, and definitions of unknown types.
LEFT_OUT = {
    "rosbags: SQLite's write-ahead log": (
        "SQLite", "ride.db3-wal", "in this log only.*wal_checkpoint",
    ),
    "rosbags: SQLite's journal": ("SQLite", "ride.db3-journal", "undoes"),
    "rosbags: files that metadata.yaml does not list": (
        "SQLite", "ride_7.db3", r"ride_7.db3: not one of the files",
    ),
    "mcap: further files of a bag": (
        "MCAP", "ride_7.mcap", r"ride_7.mcap: not one of the files",
    ),
    "rosbags: a bag of ROS 1 that is being written": (
        "ROS 1", "ride_7.bag.active", "not finished",
    ),
    "rosbags: bags of ROS 1 of other times are joined": (
        "ROS 1", "copy.bag", "several recordings: .* of the same time",
    ),
    "a bag beside one of another kind": (
        "MCAP", "old.bag", "several recordings; give one of",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", LEFT_OUT)
def test_what_libraries_leave_out_is_refused_by_name(tmp_path, case):
    name, beside, words = LEFT_OUT[case]
    path = BAGS[name](tmp_path)
    folder = path.parent if path.is_file() else path
    (file,) = (one for one in folder.iterdir() if one.suffix != ".yaml")
    if "-" in beside:
        beside = file.name + beside[beside.index("-") :]
    (folder / beside).write_bytes(b"")
    if "-" in beside:  # SQLite leaves an empty one.
        assert len(open_drive(folder)) == NUM
    (folder / beside).write_bytes(file.read_bytes())
    with pytest.raises(InputError, match=words) as error:
        open_drive(folder)
    assert beside in str(error.value)


@pytest.fixture
def later(tmp_path, monkeypatch):
    """An empty cache, and a clock by which files changed a minute ago.

    Files that have just changed are not in the cache.
    """
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    now_ns = time.time_ns
    monkeypatch.setattr(time, "time_ns", lambda: now_ns() + 60 * NS_PER_S)
    (tmp_path / "one").mkdir()


@pytest.mark.usefixtures("later")
@pytest.mark.parametrize("name", BAGS)
def test_a_cache_that_is_cut_or_foreign_is_made_again(tmp_path, name):
    path = BAGS[name](tmp_path / "one")
    known = contents(open_drive(path))
    cached = [*(tmp_path / "cache").rglob("*.npz")]
    assert cached
    for file in cached:
        for data in (
            file.read_bytes()[:-40],
            b"",
            file.read_bytes().replace(b"\x01", b"\x02"),
            cached[-1].read_bytes(),
        ):
            file.write_bytes(data)
            assert contents(open_drive(path)) == known


@pytest.mark.usefixtures("later")
def test_a_cache_where_others_can_write_is_not_used(tmp_path):
    path = BAGS["MCAP"](tmp_path / "one")
    shared = tmp_path / "cache/cns-drake/bags"
    shared.mkdir(parents=True)
    shared.chmod(0o777)
    known = contents(open_drive(path))
    assert not [*shared.iterdir()]
    shared.chmod(0o700)
    assert contents(open_drive(path)) == known
    assert [*shared.iterdir()]
