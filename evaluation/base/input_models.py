"""Models of input files that do not accept true and false as numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, get_args

from pydantic import (
    BaseModel,
    ConfigDict,
    StringConstraints,
    ValidationInfo,
    field_validator,
)

if TYPE_CHECKING:
    from typing_extensions import Self

# The name of a drive or of a map, which names a folder.
Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9_]*$")]


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


class Section(InputModel):
    """A section of a scenario or of an experiment.

    Unknown fields and numbers that are not finite are errors. You cannot change
    a section after it was made.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    def replaced(self, **fields: Any) -> Self:
        """Returns a copy with some fields replaced, without checks."""
        return self.model_copy(update=fields)
