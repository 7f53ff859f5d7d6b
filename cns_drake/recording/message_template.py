"""Messages whose numbers and stamp alone change.

Their CDR form is made once. Filling in numbers takes a hundredth of that time.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from cns_drake.base.compiled import compiled
from cns_drake.base.recordings.ros_types import serialize

# Placeholders of numbers in a message: this and the following integers, which
# are exact in double precision and larger than any measurement.
_FIRST_MARK = 2.0**52
# Placeholder of the stamp: seconds and nanoseconds. No stamp of a drive has
# more than 10^9 nanoseconds.
_SEC_MARK, _NANOSEC_MARK = 0x5A17C0DE, 0x71B3E5A9
STAMP_MARK_NS = (_SEC_MARK, _NANOSEC_MARK)
# CDR begins with its encoding; alignment counts from behind it.
_ENCAPSULATION = 4
_NS_PER_S = 1_000_000_000


def number_marks(count: int) -> np.ndarray:
    """Returns (count,) placeholder numbers for the message of a template."""
    return _FIRST_MARK + np.arange(count)


class MessageTemplate:
    """The CDR form of a message, with places for float64 and for a stamp."""

    def __init__(self, message: Any, num_numbers: int):
        """Finds the places.

        Args:
            message: made with `number_marks(num_numbers)` and with times of
                the seconds and nanoseconds of `STAMP_MARK_NS`.
            num_numbers: N.

        Raises:
            ValueError: a number is missing.
        """
        self._data = np.frombuffer(serialize(message), np.uint8)
        numbers, words = self._views(self._data)
        with np.errstate(invalid="ignore"):
            which = numbers - _FIRST_MARK
            self._places = np.flatnonzero(
                (which >= 0) & (which < num_numbers) & (which % 1 == 0)
            )
        self._which = which[self._places].astype(int)
        if len(np.unique(self._which)) != num_numbers:
            raise ValueError("a message lacks some of its numbers")
        self._stamps = np.flatnonzero(
            (words[:-1] == _SEC_MARK) & (words[1:] == _NANOSEC_MARK)
        )

    @staticmethod
    def _views(data: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns all that can be a float64, and all that can be a uint32.

        Args:
            data: (..., L) bytes of messages.
        """
        body = data[..., _ENCAPSULATION:]
        size = body.shape[-1]
        return (
            body[..., : size // 8 * 8].view("<f8"),
            body[..., : size // 4 * 4].view("<u4"),
        )

    def fill(self, numbers: np.ndarray, stamp_ns: int) -> bytes:
        """Returns the CDR form of the message with N numbers and a stamp."""
        return self.fill_all(numbers[None], [stamp_ns])[0]

    def fill_all(
        self, numbers: np.ndarray, stamps_ns: Sequence[int]
    ) -> list[bytes]:
        """Returns the CDR form of many messages.

        Args:
            numbers: (K, N), a row for each message.
            stamps_ns: of each message [ns].
        """
        data = np.tile(self._data, (len(numbers), 1))
        floats, words = self._views(data)
        times = np.array([divmod(one, _NS_PER_S) for one in stamps_ns])
        _fill_in(floats, self._places, numbers, self._which)
        words[:, self._stamps] = times[:, :1]
        words[:, self._stamps + 1] = times[:, 1:]
        return [row.tobytes() for row in data]


@compiled
def _fill_in(
    floats: np.ndarray,
    places: np.ndarray,
    numbers: np.ndarray,
    which: np.ndarray,
) -> None:
    """Fills in numbers: NumPy takes three times as long.

    Args:
        floats: (K, F) all that can be a number in each of K messages, to fill.
        places: (P,) of numbers.
        numbers: (K, N).
        which: (P,) the number at each place.
    """
    for k in range(len(floats)):
        for n in range(len(places)):
            floats[k, places[n]] = numbers[k, which[n]]
