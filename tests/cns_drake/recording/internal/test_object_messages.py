"""Messages of boxes: a reader gets the boxes that were written."""

from types import SimpleNamespace

import numpy as np
import pytest

from cns_drake.recording.object_messages import (
    BoxMessages,
    marked_boxes,
    marked_detections,
)
from evaluation.drives import DETECTIONS_3D, SCENE_UPDATE
from evaluation.drives.ros_messages import deserialize

CLASSES = ("car", "person", "bicyclist")
STAMP_NS = 1_700_000_012_345_678_901


def make_objects(seed, count=3):
    rng = np.random.default_rng(seed)
    quat_xyzw = rng.normal(size=(count, 4))
    return SimpleNamespace(
        # Ids of one to three digits begin the next box at odd places.
        instance=np.array([7, 45, 812], np.uint16)[:count],
        semantic_classes=CLASSES[:count],
        p_WO=rng.normal(scale=50.0, size=(count, 3)),
        quat_xyzw=quat_xyzw / np.linalg.norm(quat_xyzw, axis=1)[:, None],
        sizes=rng.uniform(0.5, 5.0, (count, 3)),
        v_WO=rng.normal(size=(count, 3)),
        yaw_rate=rng.normal(size=count),
        is_moving=np.array([True, False, True])[:count],
    )


def read_pose(pose):
    p, q = pose.position, pose.orientation
    return [p.x, p.y, p.z], [q.x, q.y, q.z, q.w]


def read_detection(one):
    assert one.results[0].hypothesis.score == 1.0
    assert read_pose(one.results[0].pose.pose) == read_pose(one.bbox.center)
    covariance = one.results[0].pose.covariance.reshape(6, 6)
    np.testing.assert_array_equal(covariance, 1e-12 * np.eye(6))
    name = one.results[0].hypothesis.class_id
    return one.id, name, one.bbox.center, one.bbox.size, one.header


def read_entity(one):
    assert [pair.key for pair in one.metadata] == ["class"]
    (cube,) = one.cubes
    header = SimpleNamespace(stamp=one.timestamp, frame_id=one.frame_id)
    return one.id, one.metadata[0].value, cube.pose, cube.size, header


@pytest.mark.parametrize(
    ("make", "kind", "boxes", "read"),
    [
        (marked_detections, DETECTIONS_3D, "detections", read_detection),
        (marked_boxes, SCENE_UPDATE, "entities", read_entity),
    ],
)
def test_a_reader_finds_every_box(make, kind, boxes, read):
    messages = BoxMessages(make)
    # Other boxes, then the first ones again: the values change each time.
    for seed, count in ((1, 3), (2, 3), (3, 2), (4, 0), (5, 3)):
        objects = make_objects(seed, count)
        found = deserialize(messages.encode(objects, STAMP_NS + seed), kind)
        assert len(getattr(found, boxes)) == count
        for k, one in enumerate(getattr(found, boxes)):
            number, name, pose, size, header = read(one)
            assert number == str(objects.instance[k])
            assert name == CLASSES[k]
            place, turn = read_pose(pose)
            np.testing.assert_array_equal(place, objects.p_WO[k])
            np.testing.assert_array_equal(turn, objects.quat_xyzw[k])
            assert [size.x, size.y, size.z] == objects.sizes[k].tolist()
            assert header.frame_id == "map"
            stamp = header.stamp.sec * 10**9 + header.stamp.nanosec
            assert stamp == STAMP_NS + seed
    if kind == SCENE_UPDATE:
        # All boxes before are removed, also those that the message does not
        # name.
        assert [one.type for one in found.deletions] == [1]
