"""Compares methods by their answers to the same queries."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import itertools
from typing import Any
import zlib

import numpy as np

from cns_drake.base import InputError, value_errors
from evaluation.recognition import (
    Difference,
    common_blocks,
    compared_by_right_answers,
)
from evaluation.results.table import Answers


def check_same_queries(first: Answers, second: Answers) -> None:
    """Raises an error unless two methods answered the same queries.

    Raises:
        InputError: the two methods answered different queries, or the queries
            are in other blocks of street.
    """
    frames, others = (a.columns["query_frame"] for a in (first, second))
    two = (
        f"{first.experiment}: {first.database}, {first.query}:"
        f" {first.label} and {second.label}"
    )
    if not np.array_equal(frames, others):
        raise InputError(f"{two} answered different queries")
    with value_errors(f"{two}: column block"):
        common_blocks([first.outcomes, second.outcomes])


def drive_number(queries: Answers) -> int:
    """Returns a number that identifies the query drive in all tables."""
    return zlib.crc32(f"{queries.map} {queries.query}".encode())


def compared_answers(
    answers: Mapping[str, Sequence[Answers]],
) -> dict[tuple[Any, Any], Difference]:
    """Returns the difference of the mean R@1 between any two methods.

    Args:
        answers: method -> its answers in each condition. The conditions must be
            the same for all methods.

    Returns:
        The differences, see
        `evaluation.recognition.sign_flips.compared_by_right_answers`.

    Raises:
        InputError: two methods answered different queries.
    """
    for of_condition in zip(*answers.values(), strict=True):
        for pair in itertools.combinations(of_condition, 2):
            check_same_queries(*pair)
    return compared_by_right_answers(
        {
            name: [in_condition.outcomes for in_condition in of_method]
            for name, of_method in answers.items()
        },
        [
            drive_number(in_condition)
            for in_condition in next(iter(answers.values()), ())
        ],
    )
