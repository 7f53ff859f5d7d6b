"""Rows copied from messages equal those that rosbags decodes."""

from helpers.drive_files import TYPES
import numpy as np
import pytest

from evaluation.drives import ros_messages
from evaluation.drives.message_rows import MessageRows, imu_row, odometry_row

ROWS = {ros_messages.ODOMETRY: odometry_row, ros_messages.IMU: imu_row}


def fill(kind, rng, texts):
    """Returns a message of random numbers, with the given texts in order."""
    fields = {}
    for name, (_, inner) in TYPES.fielddefs[kind][1]:
        if inner in TYPES.fielddefs:
            fields[name] = fill(inner, rng, texts)
        elif inner[0] == "string":
            fields[name] = texts.pop(0)
        elif inner[0] in ("int32", "uint32"):
            fields[name] = int(rng.integers(1 << 30))
        elif inner[0] == "float64":
            fields[name] = float(rng.normal())
        else:
            fields[name] = rng.normal(size=inner[1])
    return TYPES.types[kind](**fields)


def serialize(kind, rng, texts=("map", "base_link"), *, little_endian=True):
    message = fill(kind, rng, list(texts))
    data = TYPES.serialize_cdr(message, kind, little_endian=little_endian)
    return memoryview(bytes(data))


def read(kind, messages):
    rows = MessageRows(kind, len(messages))
    for index, data in reversed(list(enumerate(messages))):
        rows.add(index, data)
    return rows.rows()


def decoded(kind, messages):
    return np.array(
        [ROWS[kind](TYPES.deserialize_cdr(one, kind)) for one in messages],
        MessageRows(kind, 0).rows().dtype,
    )


@pytest.mark.parametrize("kind", ROWS)
@pytest.mark.parametrize("order", [[True], [False], [True, False, True]])
def test_rows_are_the_decoded_messages(kind, order):
    rng = np.random.default_rng(1)
    messages = [
        serialize(kind, rng, little_endian=order[k % len(order)])
        for k in range(20)
    ]
    rows = read(kind, messages)
    assert rows.tobytes() == decoded(kind, messages).tobytes()


@pytest.mark.parametrize("kind", ROWS)
def test_a_message_that_is_cut_off_is_refused(kind):
    rng = np.random.default_rng(4)
    rows = MessageRows(kind, 2)
    rows.add(0, serialize(kind, rng))
    with pytest.raises(ValueError, match="cannot be decoded"):
        rows.add(1, serialize(kind, rng)[:-8])
