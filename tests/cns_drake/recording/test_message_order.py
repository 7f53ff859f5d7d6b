import pytest

from cns_drake.recording import BagWriter, Topic
from evaluation.base import InputError
from evaluation.drives import TF


def test_stamps_are_not_before_the_epoch(tmp_path):
    with BagWriter(
        tmp_path / "drive",
        [Topic("/tf", TF)],
        start_ns=0,
        attachments={},
        scenario={},
    ) as bag:
        with pytest.raises(InputError, match=r"drive: /tf: .* before the ep"):
            bag.write("/tf", -1, b"", 0)
        bag.write("/tf", 0, b"", 0)
