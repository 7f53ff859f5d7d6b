"""What every section of a scenario has in common."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, StringConstraints

Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9_]*$")]


class Section(BaseModel):
    """A section of a scenario file: known fields, finite, never changed."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def field_off_by_default(default: Any, **constraints: Any) -> Any:
    """Returns a field that is written only where it is not the default.

    A scenario that does not use it is then written as it was before there was
    such a field.

    Args:
        default: the value without effect.
        constraints: further arguments of `pydantic.Field`.
    """
    return Field(
        default=default,
        exclude_if=lambda value: value == default,
        **constraints,
    )
