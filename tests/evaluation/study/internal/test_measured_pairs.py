"""Pairs of which some drives cannot be read."""

from helpers.length_task import LengthTask, Unreadable
import pytest

from evaluation.base import Cluster, FailedJobsError, Store
from evaluation.drives import RecordingSource, open_drive
from evaluation.recognition import RECORDED_PROTOCOL
from evaluation.study import Pair, StudyDrive
from evaluation.study.run import measure_pairs

pytestmark = pytest.mark.slow


def test_a_drive_that_cannot_be_read_stops_its_pairs_alone(towns, tmp_path):
    paths = [towns / f"town_0{k}" for k in (1, 2)]
    one, two = (StudyDrive(p.name, RecordingSource(p)) for p in paths)
    gone = StudyDrive("gone_01", Unreadable())
    task = LengthTask({}, "mine.yaml")
    pairs = [
        Pair(
            "town",
            (a.name, b.name),
            {},
            1,
            None,
            RECORDED_PROTOCOL,
            (a,),
            b,
            RECORDED_PROTOCOL,
        )
        for a, b in ((gone, one), (one, two), (gone, two))
    ]
    store = Store(tmp_path / "parts")
    with pytest.raises(FailedJobsError) as raised:
        measure_pairs(
            {pair: [task] for pair in pairs}, (), store, Cluster(2), print
        )
    assert str(raised.value) == "gone 01: FILE: cannot be read"
    assert [store.has(*task.keys(pair)) for pair in pairs] == [
        False,
        True,
        False,
    ]
    lengths = [len(open_drive(path)) for path in paths]
    assert task.found(pairs[1], store) == lengths
