"""Models of input files that do not accept true and false as numbers."""

from __future__ import annotations

from typing import Any, get_args

from pydantic import BaseModel, ValidationInfo, field_validator


class InputModel(BaseModel):
    """A model of an input file in which true and false are not numbers.

    By itself, pydantic reads them as 1 and 0.
    """

    @field_validator("*", mode="before")
    @classmethod
    def _check_numbers(cls, value: Any, info: ValidationInfo) -> Any:
        """Refuses true and false where only numbers can be."""
        if info.field_name is not None:
            kinds = _inner_types(cls.model_fields[info.field_name].annotation)
            takes_more = any(
                kind in (Any, bool, object)
                or (isinstance(kind, type) and issubclass(kind, BaseModel))
                for kind in kinds
            )
            if not takes_more and any(kind in (int, float) for kind in kinds):
                _refuse_truth(value)
        return value


def _inner_types(annotation: Any) -> list[Any]:
    """Returns a type and all types that it is made of."""
    inner = [
        kind
        for argument in get_args(annotation)
        for kind in _inner_types(argument)
    ]
    return [annotation, *inner]


def _refuse_truth(value: Any) -> None:
    if isinstance(value, bool):
        raise ValueError(f"{value} is no number")
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list | tuple):
        for entry in value:
            _refuse_truth(entry)
