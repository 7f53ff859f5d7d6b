"""Methods with their settings, which can be factors of an experiment."""

from collections.abc import Mapping
import itertools
import math
from typing import Any, NamedTuple

from evaluation.study.experiments.factors import (
    Changes,
    split_values,
    table_value,
)

# A study of more variants would not end.
_MOST_VARIANTS = 1000


class MethodVariant(NamedTuple):
    """A method with one combination of its settings.

    Attributes:
        name: name of the method, or its Python file.
        settings: (name, value) of each setting, as text.
        columns: path of each setting, such as `methods.solid.ranges` -> its
            value in a table.
    """

    name: str
    settings: tuple[tuple[str, str | tuple[str, ...]], ...]
    columns: Changes


def method_variants(
    methods: Mapping[str, Mapping[str, Any]],
) -> list[MethodVariant]:
    """Returns each method with each combination of its varied settings.

    Args:
        methods: name of a method -> its settings. A setting with a list of
            values is varied.

    Raises:
        ValueError: a setting has no values, or the same value twice, or there
            are too many combinations.
    """
    found: list[MethodVariant] = []
    for name, settings in methods.items():
        place = f"methods.{name}"
        fixed, varied = split_values(settings, (place,))
        # Counted before any is made: a short file can ask for millions.
        number = len(found) + math.prod(map(len, varied.values()))
        if number > _MOST_VARIANTS:
            raise ValueError(
                f"{place}: {number} variants of methods, more than"
                f" {_MOST_VARIANTS}"
            )
        for some in itertools.product(*varied.values()):
            chosen = {**fixed, **dict(zip(varied, some, strict=True))}
            found.append(
                MethodVariant(
                    name,
                    tuple(
                        (path.removeprefix(f"{place}."), _setting_text(one))
                        for path, one in chosen.items()
                    ),
                    {path: table_value(one) for path, one in chosen.items()},
                )
            )
    return found


def _setting_text(value: Any) -> str | tuple[str, ...]:
    return tuple(map(str, value)) if isinstance(value, list) else str(value)
