"""Sessions, baselines and scores on small clouds with counted answers."""

from dataclasses import replace
import json
import os
import shutil

from helpers.internal.eval_program import assert_refused, run, run_program
from helpers.labelled_maps import clouds
import numpy as np
import pytest

from cns_drake.command_line import main
from evaluation.base import InputError
from evaluation.map_update import (
    Label,
    PairLabels,
    SessionPair,
    class_names,
    read_labels,
    read_session,
    score,
    structure_changes,
    write_structures,
)


def test_the_truth_scores_one(tmp_path):
    pair, truth = clouds(tmp_path)
    found = score(pair, truth, truth, {})
    assert found["miou"] == 1.0
    for part in (found, found["within_02m"], found["within_05m"]):
        for change in ("gone", "new"):
            assert part[f"precision_{change}"] == 1.0
            assert part[f"recall_{change}"] == 1.0


def test_a_class_that_the_truth_lacks_is_left_out_of_the_mean(tmp_path):
    pair, truth = clouds(tmp_path)
    truth.A[truth.A == Label.GONE] = Label.KEPT
    guess = truth.A.copy()
    guess[np.flatnonzero(guess == Label.KEPT)[:5]] = Label.GONE
    found = score(pair, truth, PairLabels(guess, truth.B), {})
    kept = sum(int((labels == Label.KEPT).sum()) for labels in truth)
    assert found["iou_gone"] == 0.0
    assert found["iou_kept"] == (kept - 5) / kept
    assert found["miou"] == pytest.approx((found["iou_kept"] + 2.0) / 3.0)


def test_each_mean_leaves_out_what_its_own_part_lacks(tmp_path):
    """Classes, distances and what does not move each lack labels of their own.

    Of the points, cars (10) have none gone, houses (40) none new.
    """
    pair, truth = clouds(tmp_path)
    _, guess = clouds(tmp_path / "other", seed=8)
    cars = np.arange(400) < 150
    truth.A[cars & (truth.A == Label.GONE)] = Label.KEPT
    truth.B[~cars & (truth.B == Label.NEW)] = Label.KEPT
    classes = np.where(cars, 10, 40).astype(np.uint16)
    poses = np.tile(np.eye(4), (1, 1, 1))
    poses[0, :3, 3] = 4.5, 4.5, 30.0
    pair = SessionPair(*(replace(s, classes=classes, X_WS=poses) for s in pair))
    found = score(pair, truth, guess, {})

    def mean_iou(parts):
        ious = []
        for labels in ((1,), (2,), (3,), (0, 4)):
            true, called = (
                np.concatenate(
                    [np.isin(one[k], labels)[parts[k]] for k in (0, 1)]
                )
                for one in (truth, guess)
            )
            if true.any():
                ious.append((true & called).sum() / (true | called).sum())
        return np.mean(ious), len(ious)

    far = [np.linalg.norm(s.points - [4.5, 4.5, 30.0], axis=1) for s in pair]
    number = 0
    for part, rows in (
        (found, [~cars | cars] * 2),
        (found["without_vehicles_and_people"], [~cars] * 2),
        (found["by_class"]["10"], [cars] * 2),
        (found["by_class"]["40"], [~cars] * 2),
        (found["by_distance"]["20-40"], [(d >= 20) & (d < 40) for d in far]),
    ):
        mean, classes_there = mean_iou(rows)
        assert part["miou"] == pytest.approx(mean)
        number += classes_there
    # All four, or three.
    assert number == 4 + 3 + 3 + 3 + 4


def test_all_kept_scores_what_counting_says(tmp_path):
    pair, truth = clouds(tmp_path)
    all_kept = np.full(400, Label.KEPT, np.uint8)
    found = score(pair, truth, PairLabels(all_kept, all_kept), {})
    kept = sum(int((labels == 1).sum()) for labels in truth)
    assert found["iou_kept"] == kept / 800
    for name in ("gone", "new", "unobserved"):
        assert found[f"iou_{name}"] == 0.0
    assert found["miou"] == kept / 800 / 4.0
    assert found["recall_gone"] == found["recall_new"] == 0.0
    assert found["precision_gone"] is None


def test_scores_are_those_of_sets(tmp_path):
    pair, truth = clouds(tmp_path)
    _, guess = clouds(tmp_path / "other", seed=8)
    found = score(pair, truth, guess, {})
    sets = [
        {(side, i) for side in (0, 1) for i in np.flatnonzero(t[side] == 2)}
        for t in (truth, guess)
    ]
    common = len(sets[0] & sets[1])
    assert found["iou_gone"] == common / len(sets[0] | sets[1])
    assert found["precision_gone"] == common / len(sets[1])
    assert found["recall_gone"] == common / len(sets[0])
    # By distance, by brute force.
    points = pair.A.points
    true, guessed = (points[sorted(i for _, i in one)] for one in sets)
    apart = np.linalg.norm(true[:, None] - guessed[None], axis=2)
    near = found["within_05m"]
    assert near["recall_gone"] == np.mean(apart.min(axis=1) <= 0.5)
    assert near["precision_gone"] == np.mean(apart.min(axis=0) <= 0.5)


def test_what_is_called_changed_is_counted(tmp_path):
    pair, truth = clouds(tmp_path)
    _, guess = clouds(tmp_path / "other", seed=8)
    changed = (Label.GONE, Label.NEW)
    pair = pair._replace(
        A=replace(pair.A, instances=np.arange(400, dtype=np.uint16) // 200)
    )
    found = score(pair, truth, guess, {})
    number = sum(
        (labels == k).sum() for labels, k in zip(guess, changed, strict=True)
    )
    assert found["called_points"] == number / 800
    # The only structure is the second half of A; more of it is kept.
    true, called = (
        (labels.A[200:] == Label.GONE).sum()
        > (labels.A[200:] == Label.KEPT).sum()
        for labels in (truth, guess)
    )
    assert found["called_structures"] == float(called)
    assert found["right_structures"] == float(true == called)
    # Parked cars count neither as points nor as structures.
    cars = np.full(400, 10, np.uint16)
    pair = pair._replace(A=replace(pair.A, classes=cars))
    found = score(pair, truth, guess, {})
    assert found["called_points"] == (guess.B == Label.NEW).mean()
    assert found["called_structures"] is None


def test_points_are_left_out(tmp_path):
    pair, truth = clouds(tmp_path)
    guess = PairLabels(*(labels.copy() for labels in truth))
    guess.A[:100] = np.where(truth.A[:100] == 1, 2, 1)
    assert score(pair, truth, guess, {})["miou"] < 1.0
    truth.A[:100] = Label.IGNORED
    assert score(pair, truth, guess, {})["miou"] == 1.0


def test_the_updated_map_is_the_nearest_points(tmp_path):
    """Points without a true label are not scored, but others lie near them."""
    pair, truth = clouds(tmp_path)
    _, guess = clouds(tmp_path / "other", seed=8)
    truth.A[:100] = truth.B[300:] = Label.IGNORED
    found = score(pair, truth, guess, {})["updated_map"]
    A, B = pair.A.points, pair.B.points
    # New (3) or newly seen (4) points of B are added.
    updated = np.concatenate([A[guess.A != 2], B[np.isin(guess.B, [3, 4])]])
    scored = np.concatenate(
        [
            A[(guess.A != 2) & np.isin(truth.A, [1, 2])],
            B[np.isin(guess.B, [3, 4]) & (truth.B != 255)],
        ]
    )
    own, other = (
        np.linalg.norm(one[:, None] - others, axis=2).min(axis=1)
        for one, others in ((scored, B), (B[truth.B != 255], updated))
    )
    assert found["accuracy"] == np.mean(own <= 0.2)
    assert found["completeness"] == np.mean(other <= 0.2)
    assert found["chamfer"] == pytest.approx((own.mean() + other.mean()) / 2)


def test_structures_that_one_world_has_need_no_point(tmp_path):
    pair, truth = clouds(tmp_path)
    a, b = (replace(one, instances=np.full(400, 7, np.uint16)) for one in pair)
    house = {"name": "house", "class": "building", "label": 50}
    car = {"name": "car", "class": "car", "label": 10}
    # A table is that of all stages.
    table = {7: house, 8: car, 9: {**house, "name": "shed"}}
    tables = table, table
    path = tmp_path / "structures.csv"
    present = {"house"}, {"house", "car", "shed"}
    rows = structure_changes(SessionPair(a, b), truth, tables, present)
    write_structures(path, rows)
    found = [(r.side, r.structure, r.points, r.alone, r.moves) for r in rows]
    assert found == [
        ("A", "house", 400, False, False),
        ("B", "house", 400, False, False),
        ("B", "car", 0, True, True),
        ("B", "shed", 0, True, False),
    ]
    assert rows[-1].verdict == "newly_seen"
    last = path.read_text().splitlines()[-1]
    assert last == "B,9,shed,building,50,0,0,0,newly_seen,1"


def write_maps(capsys, a, b, output):
    """Returns status, stdout and stderr of making maps of two recordings."""
    words = ("export", a, b, "--format", "map-sessions", "--output", output)
    return run_program(capsys, "cns-drake", main, *words)


def test_real_drives_need_only_labels(towns, tmp_path, capsys):
    """Maps of any recordings, with labels that a user brings."""
    output = tmp_path / "maps"
    drives = towns / "town_01", towns / "town_02"
    status, out, err = write_maps(capsys, *drives, output)
    assert (status, out) == (0, f"{output}\n"), err
    # A command that needs labels cannot come next.
    assert "next:" not in err
    for side, label in (("A", 1), ("B", 3)):
        size = len(read_session(output / side).points)
        labels = np.full(size, 255, np.uint8)
        labels[: size // 2] = label
        np.save(output / side / "truth.npy", labels)
    status, out, err = run(
        capsys, "map-update", output, "--baseline", "distance", "--json"
    )
    assert status == 0, err
    found = json.loads(out)
    assert found["method"] == "distance"
    assert 0.0 < found["miou"] < 1.0


def test_bad_labels_are_refused(tmp_path, capsys):
    folder = tmp_path / "pair"
    clouds(folder)
    good = folder / "B" / "truth.npy"
    for labels, words in (
        (np.zeros(3, np.uint8), "3 labels for the 400 points"),
        (np.full(400, 3, np.uint8), "point 0 has the label 3"),
        (np.full(400, 0.5), "not one whole number"),
    ):
        bad = tmp_path / "bad.npy"
        np.save(bad, labels)
        command = ["map-update", folder, "--labels-a", bad, "--labels-b", good]
        assert_refused(capsys, command, bad, words)
    assert_refused(
        capsys, ["map-update", folder, "--labels-a", good], "give both"
    )
    assert_refused(capsys, ["map-update", folder], folder / "B", "poses.txt")
    assert_refused(capsys, ["map-update", tmp_path], "no folder A")


def test_labels_of_a_cloud_are_its_predictions(tmp_path):
    """A cloud may contain the truth, too, and its points in any order."""
    pair, _ = clouds(tmp_path)
    points = pair.A.points
    random = np.random.default_rng(3)
    labels = random.integers(0, 3, len(points), dtype=np.uint8)
    path = tmp_path / "labels.ply"

    def read(points, labels, name="prediction", kind="float", of=pair.A):
        text = (
            f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n"
            f"property {kind} x\nproperty {kind} y\nproperty {kind} z\n"
            f"property uchar truth\nproperty uchar {name}\nend_header\n"
        )
        rows = zip(points, labels, strict=True)
        text += "".join("{} {} {} 1 {}\n".format(*p, k) for p, k in rows)
        path.write_text(text)
        return read_labels(path, of, truth=False)

    for order in np.arange(len(points)), random.permutation(len(points)):
        for kind in ("float", "double"):
            found = read(points[order], labels[order], kind=kind)
            np.testing.assert_array_equal(found, labels)
    with pytest.raises(InputError, match="no property `prediction`"):
        read(points, labels, "change")
    with pytest.raises(InputError, match=r"no point within 0\.02 m of point"):
        read(points[::-1] + 0.3, labels)
    with pytest.raises(InputError, match="too coarse to tell apart"):
        read(
            [(5, 0, 0), (0.012, 0, 0), (0.018, 0, 0)],
            [0, 1, 2],
            of=replace(
                pair.A, points=np.array([(0, 0, 0), (0.01, 0, 0), (5, 0, 0)])
            ),
        )


def write_column(path, kind, value):
    """Writes a map of three points with one more column, as text."""
    path.parent.mkdir(parents=True, exist_ok=True)
    name, kind = kind
    path.write_text(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\n"
        f"property double y\nproperty double z\nproperty {kind} {name}\n"
        f"end_header\n0 0 0 1\n1 0 0 {value}\n2 0 0 0\n"
    )


@pytest.mark.parametrize("name", ["instance", "label"])
@pytest.mark.parametrize(
    ("kind", "value", "expected"),
    [
        ("int", 65535, 65535),
        ("double", 3.0, 3),
        ("int", 65536, None),
        ("int", -1, None),
        ("uint", (7 << 16) + 50, None),
        ("float", 1.5, None),
        ("double", "nan", None),
        ("float", "inf", None),
    ],
)
def test_numbers_of_a_map_are_taken_as_they_are(
    tmp_path, name, kind, value, expected
):
    write_column(tmp_path / "A" / "map.ply", (name, kind), value)
    if expected is None:
        with pytest.raises(
            InputError, match=rf"map\.ply: {name}: .* of point 1 is no whole"
        ):
            read_session(tmp_path / "A")
        return
    session = read_session(tmp_path / "A")
    found = session.instances if name == "instance" else session.classes
    assert found.tolist() == [1, expected, 0]


def test_labels_that_lie_about_their_number(tmp_path, capsys):
    """They are refused in one line, whatever number their header has."""
    folder = tmp_path / "pair"
    clouds(folder)
    whole = (folder / "A" / "truth.npy").read_bytes()
    bad = tmp_path / "bad.npy"
    command = ["map-update", folder, "--labels-a", bad]
    command += ["--labels-b", folder / "B" / "truth.npy"]
    for shape in (
        b"(401,)",
        b"(399,)",
        *(b"(%d,)" % 10**k for k in (9, 18, 20)),
    ):
        # The header keeps its length.
        end = whole.index(b"\n")
        text = whole[:end].rstrip().replace(b"(400,)", shape)
        bad.write_bytes(text.ljust(end) + whole[end:])
        assert_refused(capsys, command, bad)
    bad.unlink()
    os.mkfifo(bad)
    assert_refused(capsys, command, bad, "not a regular file")


def test_classes_of_a_table_are_whole_numbers(tmp_path):
    table = tmp_path / "structures.csv"
    assert class_names(tmp_path) == {}
    table.write_text("label,class\n50,building\n,\n71,trunk\n")
    assert class_names(tmp_path) == {50: "building", 71: "trunk"}
    for label in ("9" * 4400, "x", "1.5", "nan"):
        table.write_text(f"label,class\n{label},building\n")
        with pytest.raises(InputError, match="line 2: label: "):
            class_names(tmp_path)


def test_half_a_folder_is_never_left(towns, tmp_path, capsys):
    late = shutil.copytree(towns / "town_02", tmp_path / "late")
    file = next(late.glob("*.mcap"))
    content = bytearray(file.read_bytes())
    middle = len(content) * 3 // 4
    content[middle : middle + 200] = bytes(200)
    file.write_bytes(content)
    output = tmp_path / "maps"
    status, out, err = write_maps(capsys, towns / "town_01", late, output)
    assert (status, out) == (2, "")
    assert file.name in err
    assert not output.exists()
    sound = [towns / "town_01", towns / "town_02", output]
    assert write_maps(capsys, *sound)[0] == 0
    status, _, err = write_maps(capsys, *sound)
    assert status == 2
    assert "exists already" in err
