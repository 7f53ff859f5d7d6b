"""Points on structures that another stage lacks, with stages of a few boxes."""

import json
import re

from helpers.drive_files import make_scan, write_recording, yaw_pose
from helpers.small_map import box_visual, world_text
import numpy as np
import pytest

from cns_drake.export import export_drive
from evaluation import open_drive
from evaluation.base import InputError
from worlds.maps import shipped_maps

# Instance -> name, class, its id, and its id if stage 01 lacks it. The ids are
# those of semantic-kitti.yaml: moving-car, -person, -bus, -truck, and
# moving-other-vehicle for all others. None: it is in stage 01.
STRUCTURES = {
    1: ("ground", "terrain", 72, None),
    2: ("old_car", "car", 10, None),
    3: ("new_car", "car", 10, 252),
    4: ("walker", "person", 30, 254),
    5: ("coach", "bus", 13, 257),
    6: ("lorry", "truck", 18, 258),
    7: ("tractor", "other-vehicle", 20, 259),
    8: ("new_tower", "building", 50, 259),
    9: ("young_tower", "building", 50, None),
    10: ("new_tree", "vegetation", 70, 259),
    11: ("gone_before", "pole", 80, 259),
    # The structure is in stages, but not in the table.
    12: ("shed", "unlabeled", 0, None),
    13: ("unlisted", "unlabeled", 0, 259),
}
NUM_SCANS = 3


def write_map(folder):
    """Two stages: 02 is later; only in it is `young_tower` of full height."""
    folder.mkdir()
    for stage in ("01", "02"):
        visuals = [
            box_visual(
                f"{name}/part",
                (9 * i, 0, 1, 0, 0, 0),
                (1, 1, 2 if stage == "01" else 4),
            )
            for i, (name, _, _, absent) in STRUCTURES.items()
            if (absent is None if stage == "01" else name != "gone_before")
        ]
        (folder / f"stage_{stage}.sdf").write_text(world_text(visuals))
    rows = [
        f"{instance},{name},{kind}"
        for instance, (name, kind, _, _) in STRUCTURES.items()
        if kind != "unlabeled"
    ]
    table = "\n".join(["instance,name,class", *rows]) + "\n"
    (folder / "structures.csv").write_text(table)
    return folder


def write_drive(folder, scenario, **changes):
    rng = np.random.default_rng(3)
    scans = []
    for _ in range(NUM_SCANS):
        scan = make_scan(rng.uniform(-50.0, 50.0, (200, 3)))
        # 0 is no structure.
        scan["instance"] = rng.integers(0, len(STRUCTURES) + 1, len(scan))
        labels = [0, *(entry[2] for entry in STRUCTURES.values())]
        scan["label"] = np.array(labels)[scan["instance"]]
        scans.append(scan)
    attachments = {
        "scenario.json": scenario,
        "structures.json": [
            {"instance": i, "name": name, "class": kind, "label": label}
            for i, (name, kind, label, _) in STRUCTURES.items()
        ],
        **changes,
    }
    write_recording(
        folder,
        scans,
        [yaw_pose(2.0 * i, 0.0, 0.0, 0.0) for i in range(NUM_SCANS)],
        attachments={k: v for k, v in attachments.items() if v is not None},
    )
    return folder


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    return write_map(tmp_path_factory.mktemp("map") / "town")


@pytest.fixture(scope="module")
def drive(town, tmp_path_factory):
    folder = tmp_path_factory.mktemp("recordings") / "town_02"
    return write_drive(folder, {"map": str(town), "stage": "02"})


def read_labels(folder, scan):
    stored = np.fromfile(
        folder / f"labels/{scan:06d}.label", dtype=np.dtype("<u4")
    )
    return stored & 0xFFFF, stored >> 16


def test_absent_structures_have_labels_of_moving_ones(drive, tmp_path):
    plain = export_drive(open_drive(drive), "kitti", tmp_path / "plain")
    marked = export_drive(
        open_drive(drive), "kitti", tmp_path / "marked", absent_in="01"
    )
    seen = set()
    for i in range(NUM_SCANS):
        before, instance = read_labels(plain, i)
        after, same = read_labels(marked, i)
        np.testing.assert_array_equal(same, instance)
        for k, number in enumerate(instance.tolist()):
            _, _, label, absent = STRUCTURES.get(number, (0, 0, 0, None))
            assert before[k] == label
            assert after[k] == (label if absent is None else absent)
        seen |= set(instance.tolist())
    assert seen == {0, *STRUCTURES}
    # The rest is as without the option.
    for path in plain.rglob("*.*"):
        if path.suffix != ".label" and path.name != "structures.json":
            other = marked / path.relative_to(plain)
            assert other.read_bytes() == path.read_bytes()


def test_the_table_of_structures_names_them(drive, tmp_path):
    marked = export_drive(
        open_drive(drive), "kitti", tmp_path / "out", absent_in="01"
    )
    table = json.loads((marked / "structures.json").read_text())
    assert {entry["instance"]: entry.get("absent_in") for entry in table} == {
        instance: None if absent is None else "01"
        for instance, (_, _, _, absent) in STRUCTURES.items()
    }


def test_our_reader_takes_them(drive, tmp_path):
    marked = export_drive(
        open_drive(drive), "kitti", tmp_path / "out", absent_in="01"
    )
    read = open_drive(marked)
    labels, instances = read_labels(marked, 1)
    np.testing.assert_array_equal(read.scan(1)["label"], labels)
    np.testing.assert_array_equal(read.scan(1)["instance"], instances)
    assert labels.max() == 259
    assert read.instances[8]["absent_in"] == "01"


def test_its_own_stage_lacks_only_what_was_never_there(drive, tmp_path):
    marked = export_drive(
        open_drive(drive), "kitti", tmp_path / "out", absent_in="02"
    )
    for i in range(NUM_SCANS):
        labels, instances = read_labels(marked, i)
        assert set(instances[labels > 251]) == {11}


@pytest.mark.parametrize("format_name", ["cns", "tum"])
def test_formats_without_labels(drive, tmp_path, format_name):
    with pytest.raises(InputError, match=r"--absent-in: .* has no labels"):
        export_drive(
            open_drive(drive), format_name, tmp_path / "out", absent_in="01"
        )
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("changes", "stage", "fault"),
    [
        ({}, "07", r"town: no stage '07'; it has: 01, 02$"),
        ({}, "../town/stage_01", r"town: no stage '\.\./.*; it has: 01, 02$"),
        ({"scenario.json": {"world": "hall.sdf"}}, "01", "in a stage of a map"),
        ({"scenario.json": None}, "01", "in a stage of a map"),
        (
            {"scenario.json": {"map": "/nowhere", "stage": "02"}},
            "01",
            "map: /nowhere: no such folder",
        ),
        ({"structures.json": None}, "01", "has no list of structures"),
        (
            {"structures.json": [{"instance": 1, "name": "ground"}]},
            "01",
            r"structures\.csv: ground: not the structure 1 of .*has changed",
        ),
        (
            {"structures.json": []},
            "01",
            r"structures\.csv: ground: not the structure 1 of .*has changed",
        ),
    ],
)
def test_faults_are_one_line(town, tmp_path, changes, stage, fault):
    drive = write_drive(
        tmp_path / "rec/town_02", {"map": str(town), "stage": "02"}, **changes
    )
    with pytest.raises(InputError) as caught:
        export_drive(
            open_drive(drive), "kitti", tmp_path / "out", absent_in=stage
        )
    assert re.search(fault, str(caught.value))
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists()


def test_points_without_instances(town, tmp_path):
    write_recording(
        tmp_path / "rec/town_02",
        [make_scan(np.ones((2, 3)))[["x", "y", "z", "intensity"]]],
        [np.eye(4)],
        attachments={
            "scenario.json": {"map": str(town), "stage": "02"},
            "structures.json": [
                {"instance": i, "name": name, "class": kind}
                for i, (name, kind, _, _) in STRUCTURES.items()
            ],
        },
    )
    with pytest.raises(InputError, match="scan 0: no field label"):
        export_drive(
            open_drive(tmp_path / "rec/town_02"),
            "kitti",
            tmp_path / "out",
            absent_in="01",
        )


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["downtown", "metropolis", "riverside", "suburbia"]
)
def test_the_first_stage_of_each_shipped_city_lacks_structures(name):
    first, *_, last = (
        set(re.findall(r'<visual name="([^"/]+)', path.read_text()))
        for path in sorted(shipped_maps()[name].glob("stage_*.sdf"))
    )
    assert last - first
