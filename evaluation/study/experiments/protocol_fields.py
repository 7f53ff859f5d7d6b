"""Fields of an experiment that describe a protocol of place recognition."""

from dataclasses import replace
from typing import Literal, get_type_hints

from pydantic import ConfigDict, create_model

from cns_drake.base import InputError, validated
from evaluation.recognition import (
    PROTOCOLS,
    ProtocolFieldError,
    RetrievalProtocol,
)
from evaluation.study.experiments.conditions import (
    Condition,
)
from evaluation.study.experiments.nested_fields import (
    Changes,
)

# The fields of a protocol that a study can vary. Both settings of geometric
# verification are measured in any case; matches are by distance, and drives
# differ.
_ProtocolFields = create_model(  # type: ignore[call-overload]  # Fields are computed.
    "_ProtocolFields",
    __config__=ConfigDict(extra="forbid", strict=True, allow_inf_nan=False),
    **{
        name: (kind, None)
        for name, kind in get_type_hints(
            RetrievalProtocol, localns={"PlaceScan": Literal["middle", "first"]}
        ).items()
        if name not in ("verified", "overlap", "exclude_recent")
    },
)


def protocol_from_fields(
    fields: Changes, source: object, place: str = "protocol"
) -> RetrievalProtocol:
    """Returns the protocol that some fields of an experiment describe.

    Args:
        fields: field -> value. The field `base` names a protocol; by default
            `random-yaw`. Fields that are not given have the values of this
            protocol.
        source: file of the experiment, for error messages.
        place: name of the section with these fields, for error messages.

    Raises:
        InputError: a field is unknown or out of range.
    """
    values = dict(fields)
    base = values.pop("base", "random-yaw")
    if not isinstance(base, str) or base not in PROTOCOLS:
        raise InputError(
            f"{source}: {place}.base: {base!r} is none of"
            f" {', '.join(PROTOCOLS)}"
        )
    validated(_ProtocolFields, values, f"{source}: {place}")
    try:
        return replace(PROTOCOLS[base], **values)
    except ProtocolFieldError as error:
        where = f"{source}: {place}.{error.field}"
        raise InputError(f"{where}: {error.fault}") from None


def condition_protocol(
    condition: Condition, source: object
) -> RetrievalProtocol:
    """Returns the protocol of a condition, as by `protocol_from_fields`."""
    return protocol_from_fields(condition.changes.get("protocol", {}), source)
