"""Validators of pairs of fields that exclude, replace or need each other.

Each function returns a validator of the later one of two fields, with the value
of the earlier one. An invalid earlier field has its own error, and the
validator adds no second one.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pydantic import AfterValidator, ValidationInfo


def given_with(other: str, fault: str) -> AfterValidator:
    """Requires both fields or neither; `fault` is the error otherwise."""
    return _validator(other, lambda one, two: one == two, fault)


def given_instead_of(other: str, fault: str) -> AfterValidator:
    """Requires exactly one of both; `fault` is the error otherwise."""
    return _validator(other, lambda one, two: one != two, fault)


def never_given_with(other: str, fault: str) -> AfterValidator:
    """Requires at most one of both; `fault` is the error otherwise."""
    return _validator(other, lambda one, two: not (one and two), fault)


def _validator(
    other: str, fits: Callable[[bool, bool], bool], fault: str
) -> AfterValidator:
    def check(value: Any, info: ValidationInfo) -> Any:
        if other in info.data and not fits(
            _is_given(value), _is_given(info.data[other])
        ):
            raise ValueError(fault)
        return value

    return AfterValidator(check)


def _is_given(value: object) -> bool:
    """Returns whether a value is neither None, False nor zero."""
    return value is not None and value != 0
