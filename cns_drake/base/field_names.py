"""Suggestions for misspelt keys: the most similar field of a model."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
import difflib
import typing

from pydantic import BaseModel


def nearest_field(
    model: type[BaseModel], place: Sequence[str | int]
) -> str | None:
    """Returns the field that is written most like an unknown one.

    Args:
        model: of the whole file.
        place: keys and indices that lead to the unknown field; the last is the
            field itself.
    """
    kinds: list[object] = [model]
    for part in place[:-1]:
        kinds = [inner for kind in kinds for inner in _inside(kind, part)]
    names = {
        field.alias or name
        for kind in kinds
        for one in _models(kind)
        for name, field in one.model_fields.items()
    }
    close = difflib.get_close_matches(str(place[-1]), sorted(names), n=1)
    return close[0] if close else None


def _models(kind: object) -> Iterator[type[BaseModel]]:
    """Yields the models that an annotation names at its top level."""
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        yield kind
    elif typing.get_origin(kind) not in (list, dict, tuple):
        for inner in typing.get_args(kind):
            yield from _models(inner)


def _inside(kind: object, part: str | int) -> Iterator[object]:
    """Yields what an annotation has at a key or index."""
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        for name, field in kind.model_fields.items():
            if part in (name, field.alias):
                yield field.annotation
        # The place has the name of one of the models to choose from.
        if part == kind.__name__:
            yield kind
        return
    arguments = typing.get_args(kind)
    if typing.get_origin(kind) is dict:
        yield arguments[1]
    elif typing.get_origin(kind) in (list, tuple):
        yield from arguments
    else:
        for inner in arguments:
            yield from _inside(inner, part)
