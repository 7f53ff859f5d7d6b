"""The years of an ageing city, relative to today."""

from collections.abc import Iterable
from itertools import pairwise

from cns_drake.base import InputError

# A city ages by at most this many years, or was this many years younger.
LAST_YEAR = 200


def check_years(years: Iterable[int]) -> tuple[int, ...]:
    """Checks the years of an aged map, relative to today, and returns them.

    Raises:
        InputError: the years do not ascend, or a year is more than
            `LAST_YEAR` years from today.
    """
    found = tuple(years)
    text = " ".join(map(str, found))
    if not found or any(a >= b for a, b in pairwise(found)):
        raise InputError(f"--years: {text or 'none'}: not in ascending order")
    if max(map(abs, found)) > LAST_YEAR:
        raise InputError(
            f"--years: {text}: none may be beyond {LAST_YEAR} years"
        )
    return found
