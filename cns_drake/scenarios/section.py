"""The base of all sections of a scenario."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, StringConstraints

Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9_]*$")]


class Section(BaseModel):
    """A section of a scenario file: known fields, finite values, immutable."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def field_off_by_default(default: Any, **constraints: Any) -> Any:
    """Returns a field that is written only if it differs from the default.

    Adding such a field does not change the text of scenarios without it.

    Args:
        default: the value without effect.
        constraints: further arguments of `pydantic.Field`.
    """
    return Field(
        default=default,
        exclude_if=lambda value: value == default,
        **constraints,
    )
