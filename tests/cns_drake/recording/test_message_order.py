import pytest

from cns_drake.base.errors import InputError
from cns_drake.drives import ros_types
from cns_drake.recording.bag_writer import BagWriter
from cns_drake.recording.rosbag2_metadata import Topic


def test_stamps_are_not_before_the_epoch(tmp_path):
    with BagWriter(
        tmp_path / "drive",
        [Topic("/tf", ros_types.TF)],
        start_ns=0,
        attachments={},
        scenario={},
    ) as bag:
        with pytest.raises(InputError, match=r"drive: /tf: .* before the ep"):
            bag.write("/tf", -1, b"", 0)
        bag.write("/tf", 0, b"", 0)
