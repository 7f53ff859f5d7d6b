"""`cns-eval real` on bird's-eye images with poses."""

from functools import partial
import shutil

from helpers.drive_files import T0_NS, make_scan, write_recording, yaw_pose
from helpers.internal.eval_program import run, run_program
import numpy as np
from PIL import Image
import pytest

from cns_drake.base import InputError, Reporter
from cns_drake.command_line import main
from evaluation.clouds import image_points, read_image
from evaluation.real import image_sequences
from evaluation.real.excerpts import simulated_drives
from evaluation.real.image_sequences import (
    ImageSource,
    open_images,
    open_sequences,
)
from evaluation.real.real_study import judge_scans
from evaluation.results import QueryRows, Results

# Heading, x and y of each image: the second half passes the places of the first
# again, in another order, and one place is new.
POSES = (
    *((0.0, 40.0 * k, 0.0) for k in range(5)),
    *((0.0, 40.0 * k + 3.0, -1.0) for k in (3, 0, 4, 1)),
    (1.0, 900.0, 900.0),
)


def view(yaw, x, y):
    """Returns the image (151, 151) of a town from a pose."""
    rng = np.random.default_rng(4)
    image = np.zeros((151, 151), np.uint8)
    walls = rng.uniform([-40, -25], [240, 25], (400, 2))
    p = (walls - [x, y]) @ np.array(
        [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    )
    p = p[(np.abs(p) < 24.0).all(axis=1)]
    for ahead, left in np.trunc(p / 0.4).astype(int):
        image[75 - ahead, 74 - left : 77 - left] = 255
        image[75 - ahead, 75 - left] = 102
    return image


def fill(root, name="09", poses=POSES):
    """Writes a sequence; returns the folder of the data sets."""
    folder = root / "kitti_bev" / name
    (folder / "imgs").mkdir(parents=True)
    rows = []
    for k, (yaw, x, y) in enumerate(poses):
        Image.fromarray(view(yaw, x, y)).save(
            folder / "imgs" / f"{k:06d}.png", format="PNG"
        )
        c, s = np.cos(yaw), np.sin(yaw)
        # The height changes, which an image from above does not show.
        rows.append([c, -s, 0, x, s, c, 0, y, 0, 0, 1, 30.0 * k])
    np.savetxt(folder / "pose.txt", rows)
    return root


def ask(capsys, root, output, *words):
    return run(capsys, "real", root, "--output", output, *words)


@pytest.mark.slow
def test_places_are_found_in_images(tmp_path, capsys):
    root = fill(tmp_path / "data")
    methods = "--method", "scan-context++", "--method", "solid"
    output = tmp_path / "out"
    status, out, err = ask(capsys, root, output, *methods, "--jobs", 1)
    assert (status, out) == (0, f"{output / 'results.csv'}\n"), err
    results = Results.read(output).where(task="place", verified=False)
    assert {(row.map, row.method) for row in results.rows} == {
        ("kitti_09", "scan-context++")
    }
    values = {row.metric: row.value for row in results.rows}
    assert (values["places"], values["with_match"]) == (5, 4)
    assert values["r1"] == 1.0
    answers = QueryRows.read(output).answers[0].columns
    assert answers["match_frame"].tolist() == [3, 0, 4, 1]
    np.testing.assert_allclose(answers["distance"], np.hypot(3, 1), atol=1e-6)
    for note in (
        "kitti_09: no frames of the published evaluation: the first 5 of 10",
        "kitti_09: 4 of 5 queries have a place within 5 m; the others are left",
        "kitti_bev: not for solid: these need scans",
    ):
        assert note in err


def test_frames_of_the_published_evaluation(tmp_path, monkeypatch):
    split = {"05": ((1, 3), (4, 9))}
    monkeypatch.setattr(image_sequences, "_SPLITS", split)
    root = fill(tmp_path, "05")
    notes = []
    (found,) = open_sequences(root / "kitti_bev", notes.append)
    assert found.name == "kitti_05"
    # Frame 8 is at place 1.
    assert found.places.source.frames == (1, 2)
    assert found.queries.source.frames == (8,)
    assert notes == [
        "kitti_05: 1 of 5 queries have a place within 5 m; the others are left"
        " out"
    ]
    drive = found.queries.source()
    np.testing.assert_allclose(drive.X_WS[0, :3, 3], [43.0, -1.0, 0.0])
    assert drive.stamps_ns.tolist() == [800_000_000]
    # The files and the poses identify a sequence.
    before = found.queries.source.identity()
    assert before == found.queries.source.identity()
    table = root / "kitti_bev" / "05" / "pose.txt"
    table.write_text(table.read_text().replace("e+00", "e+0"))
    assert before != found.queries.source.identity()


def test_a_few_queries_each_have_one_place(tmp_path):
    """Every second query has a match; four of them are asked, evenly."""
    # Places are 1 m apart, so that up to nine are near a query.
    poses = [(0.0, 1.0 * k, 0.0) for k in range(40)]
    poses += [(0.0, 1.0 * k, 3.0 + 90.0 * (k % 2)) for k in range(40)]
    root = fill(tmp_path, "town", poses)
    notes = []
    (found,) = open_sequences(root / "kitti_bev", notes.append, 4)
    assert found.name == "town"
    assert found.queries.source.frames == (40, 52, 66, 78)
    # Costs are estimated by it.
    assert (found.places.num_scans, found.queries.num_scans) == (4, 4)
    near = [
        {k for k in range(40) if np.hypot(k - query + 40, 3.0) <= 5.0}
        for query in found.queries.source.frames
    ]
    places = found.places.source.frames
    assert places == tuple(sorted(places))
    assert [len(one & {*places}) for one in near] == [1, 1, 1, 1]
    # Not the nearest one of each.
    assert places != (0, 12, 26, 38)
    assert notes[1:] == [
        "town: 20 of 40 queries have a place within 5 m; the others are left"
        " out",
        "town: 4 of these queries, and 4 of 40 places",
    ]
    (again,) = open_sequences(root / "kitti_bev", notes.append, 4)
    assert again == found
    # There are no more than twenty.
    (every,) = open_sequences(root / "kitti_bev", notes.append, 30)
    assert every.queries.source.frames == tuple(range(40, 80, 2))


def test_places_and_queries_may_have_folders_of_their_own(tmp_path):
    """Two drives of different lengths, such as two sessions."""
    drives = tmp_path / "places", tmp_path / "queries"
    folder = tmp_path / "made" / "kitti_bev" / "town"
    for drive, poses in zip(drives, (POSES[:5], POSES[5:8]), strict=True):
        made = fill(drive, "one", poses) / "kitti_bev" / "one"
        shutil.copytree(made, folder / drive.name)
    (found,) = open_sequences(folder.parent, lambda note: None)
    assert found.places.source.frames == (0, 1, 2, 3, 4)
    assert found.queries.source.frames == (0, 1, 2)
    opened = [one.source() for one in (found.places, found.queries)]
    assert [one.world_frame for one in opened] == ["town", "town"]
    np.testing.assert_allclose(opened[1].X_WS[1, :2, 3], [3.0, -1.0])
    (shown,) = open_images(folder.parent)
    assert shown.source().files == opened[0].files
    # They are no recordings.
    assert simulated_drives(tmp_path / "made", "hdl-64e", print) == []
    shutil.rmtree(folder / "queries")
    with pytest.raises(InputError, match=r"queries.imgs: no image"):
        open_sequences(folder.parent, lambda note: None)


def export(capsys, drive, output, *words):
    words = "export", drive, "--format", "bev-images", *words
    return run_program(
        capsys, "cns-drake", main, *words, "--output", str(output)
    )


def test_a_drive_becomes_images(tmp_path, capsys):
    """Of columns of three, two and one voxel, and one beyond the reach."""
    column = [[10.1, 0.1, z] for z in (-1.7, -1.3, 0.3)]
    column += [[0.1, 8.1, z] for z in (0.1, 0.5)]
    scan = make_scan(np.array([*column, [-4.1, 0.1, 0.1], [30.0, 0.1, 0.1]]))
    poses = [yaw_pose(2.0 * k, 1.0, 0.5, 0.3 * k) for k in range(3)]
    drive = write_recording(tmp_path / "town", [scan] * 3, poses)
    output = tmp_path / "made" / "kitti_bev" / "town"
    status, out, err = export(capsys, drive, output)
    assert (status, out) == (0, f"{output}\n"), err
    expected = np.zeros((151, 151), np.uint8)
    expected[75 - 25, 75] = 255
    expected[75, 75 - 20] = 128
    for k in range(3):
        image = read_image(output / "imgs" / f"{k:06d}.png")
        np.testing.assert_array_equal(image, expected)
    X_WS = np.loadtxt(output / "pose.txt").reshape(3, 3, 4)
    expected_poses = np.array(poses)[:, :3]
    expected_poses[:, 2, 3] += 1.6  # Height of the LiDAR.
    np.testing.assert_allclose(X_WS, expected_poses, atol=1e-12)
    status, _, err = export(capsys, drive, output)
    assert (status, err.count("\n")) == (2, 1), err
    assert str(output) in err
    assert sorted(one.name for one in output.parent.iterdir()) == ["town"]


def test_images_are_of_scans_without_motion(tmp_path, capsys):
    """A wall that the vehicle approaches by 1 m during each scan."""
    number = 100
    scan = make_scan(np.tile([20.1, 0.1, 0.1], (number, 1)))
    scan["z"][1::2] = 0.5
    scan["t"] = np.arange(number) * 1_000_000
    section = {"preset": "cns", "motion_distortion": True}
    drive = write_recording(
        tmp_path / "town",
        [scan] * 6,
        [yaw_pose(1.0 * k, 0.0, 0.0, 0.0) for k in range(6)],
        stamps_ns=[T0_NS + k * 100_000_000 for k in range(6)],
        attachments={
            "scenario.json": {"map": "town", "lidars": {"lidar": section}}
        },
    )
    status, _, err = export(capsys, drive, tmp_path / "images")
    assert (status, err.count("the motion is taken out")) == (0, 1), err
    assert "used as taken" not in err
    image = read_image(tmp_path / "images" / "imgs" / "000002.png")
    # From 20.1 m to 21.1 m.
    rows = 75 - np.unique(np.trunc((20.1 + np.arange(100) / 100) / 0.4))
    expected = np.zeros((151, 151), np.uint8)
    expected[rows.astype(int), 75] = 255
    np.testing.assert_array_equal(image, expected)


def test_a_sequence_without_a_revisit_is_left_out(tmp_path, capsys):
    root = fill(tmp_path, poses=POSES[:4])
    notes = []
    assert open_sequences(root / "kitti_bev", notes.append) == []
    assert "kitti_09: 0 of 2 queries have a place within 5 m" in notes[-1]
    assert open_sequences(root / "none", notes.append) == []
    status, out, err = ask(
        capsys, root, root / "out", "--method", "scan-context++"
    )
    assert (status, out) == (2, "")
    assert "no data set that these methods can measure" in err
    assert not (root / "out" / "results.csv").exists()


def blocks(seed, share):
    """Returns an image (151, 151) of blocks; a share of them is filled."""
    rng = np.random.default_rng(seed)
    counts = rng.integers(1, 11, (51, 51)) * (rng.random((51, 51)) < share)
    counts[25, 25] = 10
    image = np.rint(counts * 25.5).astype(np.uint8)
    image = np.repeat(np.repeat(image, 3, axis=0), 3, axis=1)[1:152, 1:152]
    # Nothing lies beyond the reach of an image.
    image[:12] = image[-12:] = 0
    image[:, :12] = image[:, -12:] = 0
    return image


class Scanned:
    """A drive of scans whose images are blocks."""

    world_frame = "world"
    scenario = None

    def __init__(self, share):
        self.share = share
        self.X_WS = np.tile(np.eye(4), (6, 1, 1))
        self.X_WS[:, 0, 3] = 40.0 * np.arange(6)

    def __len__(self):
        return 6

    def scan(self, k):
        """Returns points at random inside their voxels, with intensities."""
        rng = np.random.default_rng(k)
        points = image_points(blocks(100 + k, self.share))
        points = points + rng.uniform(-0.19, 0.19, points.shape)
        return np.column_stack([points, rng.integers(0, 100, len(points))])


@pytest.mark.slow
@pytest.mark.night
def test_images_are_told_from_images_of_scans(tmp_path, monkeypatch):
    judge = pytest.importorskip("evaluation.real.judge")

    monkeypatch.setattr(judge, "_TREES", 10)
    monkeypatch.setattr(judge, "_NEIGHBOURHOODS", 40)
    folder = tmp_path / "imgs"
    folder.mkdir()
    rows = []
    for k in range(6):
        Image.fromarray(blocks(k, 0.3)).save(folder / f"{k}.png")
        rows.append([1, 0, 0, 40 * k, 0, 1, 0, 0, 0, 0, 1, 0])
    np.savetxt(tmp_path / "pose.txt", rows)
    source = ImageSource(tmp_path, "images", tuple(range(6)))
    found = {}
    for share in (0.3, 0.6):
        made = (partial(Scanned, share),)
        result = judge_scans(Reporter(print), source, made)
        # An image has neither intensities nor rings.
        assert not {"intensity", "roughness"} & set(result["auc"])
        found[share] = result["auc"]["all"]
    # Images are judged against images, too.
    same = judge_scans(Reporter(print), source, (source,))
    assert same["auc"]["all"] < 0.75
    assert found[0.3] < 0.75
    assert found[0.6] > 0.95


def test_methods_that_need_scans_measure_nothing(tmp_path, capsys):
    root = fill(tmp_path)
    status, out, err = ask(capsys, root, root / "out", "--method", "icp")
    assert (status, out) == (2, "")
    assert "no data set that these methods can measure" in err


def broken(tmp_path, name, change):
    """Returns the fault of a sequence after a change of its folder."""
    folder = fill(tmp_path / name) / "kitti_bev" / "09"
    change(folder)
    with pytest.raises(InputError) as caught:
        open_sequences(folder.parent, lambda note: None)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def without_images(folder):
    for file in (folder / "imgs").iterdir():
        file.unlink()


def without_the_last_row(folder):
    rows = (folder / "pose.txt").read_text().splitlines()[:-1]
    (folder / "pose.txt").write_text("\n".join(rows))


def without_a_column(folder):
    np.savetxt(folder / "pose.txt", np.loadtxt(folder / "pose.txt")[:, 1:])


def with_another_image(pixels):
    def change(folder):
        Image.fromarray(pixels).save(folder / "imgs" / "000003.png")

    return change


def test_faults_are_named(tmp_path):
    colour = np.zeros((151, 151, 3), np.uint8)
    for number, (change, fault) in enumerate(
        (
            (without_images, "imgs: no image (*.png) in it"),
            (lambda one: (one / "pose.txt").unlink(), "pose.txt"),
            (without_the_last_row, "pose.txt: 9 rows for 10 images"),
            (without_a_column, "pose.txt: rows of 11 numbers instead of 12"),
            (with_another_image(colour), "000003.png: an image of mode RGB"),
            (with_another_image(colour[:99, :, 0]), "151 x 99 pixels, not sq"),
            (
                lambda one: (one / "imgs" / "000003.png").write_bytes(b"P"),
                "000003.png: no image (PNG), or damaged",
            ),
        )
    ):
        assert fault in broken(tmp_path, str(number), change)
    (tmp_path / "kitti_bev").mkdir()
    with pytest.raises(InputError, match="no folder of a sequence in it"):
        open_sequences(tmp_path / "kitti_bev", lambda note: None)
