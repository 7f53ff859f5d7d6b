"""`cns-eval real` on folders that the test fills: towns of boxes."""

import hashlib
import struct

from helpers.drive_files import make_scan, write_recording, yaw_pose
from helpers.internal.eval_program import run
from helpers.layered_scans import matrix, seen_from, town
import numpy as np
import pytest

from cns_drake.base import InputError, Reporter, choose_cluster
from evaluation.real import excerpts, measure_real
from evaluation.results import QueryRows, Results
from evaluation.study import engine

# Frames of KITTI 00 by name: seed of the town, yaw, x, y. The first and the
# third are of one place, as the second and the fourth are.
FRAMES = {
    "000026": (1, 0.1, 0.0, 0.0),
    "000560": (2, 1.0, 400.0, 0.0),
    "003528": (1, 2.5, 2.0, 1.0),
    "004481": (2, 1.2, 401.0, 2.0),
}
METHODS = ("layered-overlap", "plane-icp")


def fill(root, frames=FRAMES):
    """Writes the frames as revisits of KITTI 00; returns the folder's root."""
    folder = root / "kitti_00_revisits"
    folder.mkdir(parents=True)
    rows = ["# frame x y z qx qy qz qw"]
    for name, (seed, yaw, x, y) in frames.items():
        # A town stands about its first frame.
        origin = [200.0 * (2 * seed - 2), 0.0]
        scan = seen_from(town(seed), yaw, x - origin[0], y - origin[1])
        four = np.c_[scan, np.full(len(scan), 0.5)].astype("<f4")
        np.save(folder / f"{name}.npy", four)
        cells = x, y, 1.6, 0.0, 0.0, np.sin(yaw / 2), np.cos(yaw / 2)
        rows.append(" ".join(map(str, (int(name), *cells))))
    (folder / "poses.txt").write_text("\n".join(rows) + "\n")
    return root


def ask(capsys, folder, output, *words, methods=METHODS):
    """Runs the command; returns status, stdout, stderr."""
    chosen = [word for one in methods for word in ("--method", one)]
    return run(capsys, "real", folder, "--output", output, *chosen, *words)


def measure(patch, folder, output, methods=METHODS, simulated=None):
    """Returns both tables, and the notes; jobs run in this process."""
    notes = []

    def send(kind, *values):
        if kind == "note":
            notes.extend(values)

    def run_jobs(jobs, cluster):
        for job in jobs:
            # Of few scans; a job of 1400 m with a scan each 1e-6 m is not.
            assert job.cost < 100.0
            if not job.step.is_done():
                job.step.run(Reporter(send))

    patch.setattr(engine, "run_jobs", run_jobs)
    tables = measure_real(
        folder,
        output,
        choose_cluster(1, None),
        methods,
        simulated=simulated,
        on_note=notes.append,
    )
    return *tables, notes


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """Both tables, and the notes."""
    folder = tmp_path_factory.mktemp("real")
    with pytest.MonkeyPatch.context() as patch:
        return measure(patch, fill(folder / "scans"), folder / "out")


def values(results, **columns):
    return {
        row.metric: row.value
        for row in results.where(
            experiment="real", verified=False, **columns
        ).rows
    }


def test_each_scan_finds_the_other_of_its_place(measured):
    results, queries, _ = measured
    place = values(results, task="place")
    assert (place["places"], place["with_match"]) == (4, 4)
    assert place["r1"] == place["auc"] == 1.0
    answers = queries.answers[0].columns
    # Scan 0 finds scan 2, and so on; a scan never finds itself.
    assert answers["match_frame"].tolist() == [2, 3, 0, 1]
    wanted = [np.hypot(2, 1), np.hypot(1, 2)] * 2
    np.testing.assert_allclose(answers["distance"], wanted, atol=1e-6)
    assert values(results, task="pose")["rotation_median_deg"] < 6.0


def test_each_scan_is_localised_in_the_map_of_the_others(measured):
    results, _, _ = measured
    found = values(results, task="localise", method="plane-icp")
    assert found["success_03m_1deg"] == 1.0
    assert found["translation_median"] < 0.1
    rows = results.where(task="localise").rows
    assert {row.n for row in rows} == {4}
    assert {row.protocol for row in results.rows} == {"own"}


def test_an_own_registration_function(tmp_path, monkeypatch):
    text = (
        "def other(): pass\ndef localise(map, scan, start): return start, 1.0"
    )
    for name in ("mine", "icp"):
        (tmp_path / f"{name}.py").write_text(text)
    mine = str(tmp_path / "mine.py")
    scans = fill(tmp_path / "scans")
    results, _, _ = measure(monkeypatch, scans, tmp_path / "out", (mine,))
    found = values(results, task="localise", method="mine")
    # The start is 2 m off.
    assert found["translation_median"] == pytest.approx(2.0)
    assert {row.task for row in results.rows} == {"localise"}
    both = ("icp", str(tmp_path / "icp.py"))
    with pytest.raises(InputError, match="'icp' is there twice"):
        measure(monkeypatch, scans, tmp_path / "out", both)


def test_scans_that_are_alone_are_counted(tmp_path, monkeypatch):
    # The limit is 7.5 m.
    alone = {
        **{name: FRAMES[name] for name in ("000026", "003528")},
        "004481": (1, 0.0, 2.0, 8.51),
    }
    scans = fill(tmp_path / "scans", alone)
    results, _, notes = measure(monkeypatch, scans, tmp_path / "out", ("icp",))
    (note,) = (one for one in notes if "localised" in one)
    assert note.startswith("kitti_00_revisits: 2 of 3 scans localised")
    assert {row.n for row in results.rows} == {2}
    # The results of an earlier run are used.
    results, _, notes = measure(monkeypatch, scans, tmp_path / "out", ("icp",))
    assert not any("localised" in one for one in notes)
    assert {row.n for row in results.rows} == {2}


def test_scans_without_any_other_near_leave_no_table(tmp_path, monkeypatch):
    scans = fill(tmp_path / "scans", {"000026": FRAMES["000026"]})
    with pytest.raises(InputError, match="nothing could be measured"):
        measure(monkeypatch, scans, tmp_path / "out", ("icp",))
    assert not (tmp_path / "out" / "results.csv").exists()


def test_what_is_missing_or_another_is_named(measured):
    lines = measured[2]
    for name in ("kitti_00/velodyne/*.bin", "nclt/*.bin"):
        assert f"{name}: not there, skipped" in lines
    assert any(
        line.endswith("kitti_00_revisits: other scans than known, still used")
        for line in lines
    )
    assert "hdl-64e: no simulated scan of it to judge" in lines


@pytest.mark.night
def test_simulated_scans_add_places(tmp_path, capsys):
    folder = fill(tmp_path / "scans")
    drives = tmp_path / "drives"
    for name, preset in (("one", "hdl-64e"), ("two", "hdl-32e")):
        scenario = {"map": name, "lidars": {"lidar": {"preset": preset}}}
        write_recording(
            drives / f"{name}_01",
            [make_scan(town(7 + k)) for k in range(3)],
            [yaw_pose(20.0 * k, 0.0, 0.0, 0.0) for k in range(3)],
            attachments={"scenario.json": scenario},
        )
    output = tmp_path / "out"
    options = ("--simulated", drives, "--jobs", 1)
    status, out, err = ask(
        capsys, folder, output, *options, methods=METHODS[:1]
    )
    assert (status, out) == (0, f"{output / 'results.csv'}\n"), err
    results = Results.read(output)
    # Those of the other unit stay away.
    place = values(results, task="place")
    assert (place["places"], place["r1"]) == (7, 1.0)
    assert "kitti_00_revisits: thinned scans, not judged" in err
    assert len(QueryRows.read(output).answers) == 2
    # Beside another table, each has its own values.
    status, out, err = run(capsys, "compare", "--rankings", output, output)
    assert status == 2
    assert "fewer than two methods" in err


def test_the_digest_is_that_of_all_scans(tmp_path, monkeypatch):
    folder = fill(tmp_path / "scans")
    files = sorted((folder / "kitti_00_revisits").glob("*.npy"))
    whole = b"".join(file.read_bytes() for file in files)
    known = next(
        one for one in excerpts.EXCERPTS if one.folder == "kitti_00_revisits"
    )._replace(digest=hashlib.sha256(whole).hexdigest())
    monkeypatch.setattr(excerpts, "EXCERPTS", (known,))
    notes = []
    (found,) = excerpts.open_excerpts(folder, notes.append)
    assert notes == []
    X_WS = found.drive.X_WS[3]
    np.testing.assert_allclose(X_WS[:3, 3], [401.0, 2.0, 1.6])
    np.testing.assert_allclose(X_WS[:3, :3], matrix(1.2), atol=1e-12)
    files[0].write_bytes(files[1].read_bytes())
    (folder / "more").mkdir()
    excerpts.open_excerpts(folder, notes.append)
    assert [note.rpartition(": ")[2] for note in notes] == [
        "other scans than known, still used",
        "not known, left out",
    ]


def test_matrices_and_scans_without_times(tmp_path, capsys):
    folder = tmp_path / "nuscenes_1072"
    (folder / "velodyne").mkdir(parents=True)
    rows = []
    for k in range(3):
        scan = town(1) - [4.0 * k, 0.0, 0.0]
        four = np.c_[scan, np.full(len(scan), 17.0)].astype("<f4")
        four.tofile(folder / "velodyne" / f"{k:06d}.bin")
        rows.append(f"1 0 0 {4 * k} 0 1 0 0 0 0 1 1.84")
    (folder / "poses.txt").write_text("\n".join(rows))
    (one,) = excerpts.open_excerpts(tmp_path, lambda note: None)
    np.testing.assert_array_equal(one.drive.X_WS[:, 0, 3], [0.0, 4.0, 8.0])
    assert one.drive.scan(2).dtype.names == ("x", "y", "z", "intensity")
    assert one.drive.lidar_field.rings == 32
    (folder / "poses.txt").write_text("\n".join(rows[:2]))
    status, out, err = ask(capsys, tmp_path, tmp_path / "out")
    assert (status, out) == (2, "")
    assert err.endswith("poses.txt: 2 rows for 3 scans\n")


def test_faults_are_one_line(tmp_path, capsys):
    (tmp_path / "empty").mkdir()
    output = tmp_path / "out"
    for folder, fault in (
        ("none", "none: no such folder"),
        ("empty", "empty: no data set that is known (helipr_two_lidars, kit"),
    ):
        status, out, err = ask(capsys, tmp_path / folder, output)
        assert (status, out) == (2, "")
        assert fault in err
        assert len(err.splitlines()) == 1
        assert not (output / "results.csv").exists()
    status, out, err = ask(capsys, tmp_path, output, methods=("nothing",))
    assert (status, out) == (2, "")
    assert "nothing: neither a Python file nor one of" in err


def test_settings_of_methods(tmp_path, monkeypatch):
    """As in a study, they are columns; the height is in the digest."""
    scans = fill(tmp_path / "scans")
    monkeypatch.setattr(engine, "run_jobs", lambda jobs, cluster: None)
    with pytest.raises(InputError, match="no parameter 'rangs'"):
        measure_real(
            scans,
            tmp_path / "out",
            choose_cluster(1, None),
            ("solid",),
            ("solid.rangs=20",),
        )
    with pytest.raises(InputError, match="no method of place recognition"):
        measure_real(
            scans,
            tmp_path / "out",
            choose_cluster(1, None),
            ("icp",),
            ("icp.voxel=0.7",),
        )


def test_other_formats_without_poses(tmp_path, capsys):
    (tmp_path / "nclt").mkdir()
    hits = struct.pack("<HHHBB", 20400, 19800, 20040, 31, 0)
    (tmp_path / "nclt" / "1326652795280148.bin").write_bytes(hits)
    folder = tmp_path / "helipr_two_lidars"
    folder.mkdir()
    avia = struct.pack("<fffBBBI", 1.0, 2.0, 3.0, 7, 0, 1, 5)
    aeva = struct.pack("<5fiBf", 1.0, 2.0, 4.0, 0.5, -1.0, 3, 2, 9.0)
    for number in (0, 1, 10):
        (folder / f"avia_{number:06d}.bin").write_bytes(avia)
        (folder / f"aeva_{number:06d}.bin").write_bytes(aeva)
    found = excerpts.open_excerpts(tmp_path, lambda note: None)
    z = [one.drive.scan(0)["z"][0] for one in found]
    np.testing.assert_allclose(z, [-0.2 - 0.957, 3.0, 4.0], atol=1e-5)
    assert [len(one.drive) for one in found] == [1, 3, 3]
    # Nothing is asked of scans without poses.
    status, _, err = ask(capsys, tmp_path, tmp_path / "out", methods=["solid"])
    assert status == 2
    assert "no data set that these methods can measure" in err
    assert not (tmp_path / "out" / "results.csv").exists()


@pytest.mark.slow
def test_the_judge_tells_boxes_from_noise(tmp_path, monkeypatch):
    from evaluation.real import judge

    monkeypatch.setattr(judge, "_TREES", 5)
    for name in ("_PATCHES", "_NEIGHBOURHOODS"):
        monkeypatch.setattr(judge, name, 5)
    folder = tmp_path / "scans" / "nuscenes_1072"
    (folder / "velodyne").mkdir(parents=True)
    rng = np.random.default_rng(3)
    rows = []
    for k in range(3):
        scan = town(k) + rng.normal(0.0, 0.3, town(k).shape)
        four = np.c_[scan, rng.uniform(0.0, 99.0, len(scan))].astype("<f4")
        four.tofile(folder / "velodyne" / f"{k:06d}.bin")
        rows.append(f"1 0 0 {40 * k} 0 1 0 0 0 0 1 1.84")
    (folder / "poses.txt").write_text("\n".join(rows))
    scenario = {"map": "one", "lidars": {"lidar": {"preset": "hdl-32e"}}}
    write_recording(
        tmp_path / "drives" / "one_01",
        [make_scan(town(7 + k)) for k in range(4)],
        [yaw_pose(40.0 * k, 0.0, 0.0, 0.0) for k in range(4)],
        attachments={"scenario.json": scenario},
    )
    results, _, _ = measure(
        monkeypatch,
        tmp_path / "scans",
        tmp_path / "out",
        ("icp",),
        tmp_path / "drives",
    )
    found = results.where(task="judge")
    (row,) = found.where(method="all", metric="auc").rows
    assert row.value > 0.9
    assert (row.database, row.query) == ("simulated", "nuscenes_1072")
    (control,) = found.where(method="all", metric="auc_control").rows
    assert control.value < row.value
    # No scan is within 7.5 m of another one.
    assert {one.task for one in results.rows} == {"judge"}


def test_scans_are_in_the_order_of_their_numbers(tmp_path):
    """0.bin to 11.bin, beside files that macOS leaves."""
    folder = tmp_path / "nuscenes_1072"
    (folder / "velodyne").mkdir(parents=True)
    rows = []
    for k in range(12):
        scan = np.c_[town(1)[: 500 + k], np.full(500 + k, 17.0)]
        scan.astype("<f4").tofile(folder / "velodyne" / f"{k}.bin")
        (folder / "velodyne" / f"._{k}.bin").write_bytes(b"apple")
        rows.append(f"1 0 0 {4 * k} 0 1 0 0 0 0 1 1.84")
    (folder / "poses.txt").write_text("\n".join(rows))
    (one,) = excerpts.open_excerpts(tmp_path, lambda note: None)
    for k in range(12):
        assert len(one.drive.scan(k)) == 500 + k
        assert one.drive.X_WS[k, 0, 3] == 4.0 * k


def test_columns_of_other_scans_are_found(tmp_path):
    """nuScenes' own .bin files have a fifth column."""
    folder = tmp_path / "nuscenes_1072" / "velodyne"
    folder.mkdir(parents=True)
    scan = town(1)
    rings = np.arange(len(scan)) % 32
    points = np.c_[scan, rings * 0.0 + 17.0, 100.0 + rings]
    points.astype("<f4").tofile(folder / "0.bin")
    (folder.parent / "poses.txt").write_text("1 0 0 0 0 1 0 0 0 0 1 0")
    notes = []
    (one,) = excerpts.open_excerpts(tmp_path, notes.append)
    np.testing.assert_array_equal(
        one.drive.scan(0)["z"], scan[:, 2].astype("f4")
    )
    assert any("show 5 columns" in note for note in notes)
