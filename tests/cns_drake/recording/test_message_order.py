from pathlib import Path

import pytest

from cns_drake.base.errors import InputError
from cns_drake.recording.bag_writer import MessageOrder


def test_stamps_are_not_before_the_epoch():
    order = MessageOrder(Path("drive"), [])
    with pytest.raises(InputError, match=r"drive: /tf: .* before the epoch"):
        order.takes("/tf", -1)
    assert order.takes("/tf", 0)
