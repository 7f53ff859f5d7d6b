"""Evaluates formulas in the YAML files of this package."""

from collections.abc import Mapping
from functools import cache
from types import CodeType
from typing import Any

# Functions that any formula may use; the caller of `value_of` supplies all
# others.
FUNCTIONS: Mapping[str, Any] = {
    "__builtins__": {},
    **{f.__name__: f for f in (int, len, max, min, range, round)},
}


def value_of(given: Any, names: dict[str, Any]) -> Any:
    """Returns the value of a formula, or of each formula in a list.

    Formulas are Python expressions as text, which may use the numbers and
    functions in `names`. Plain values are returned unchanged.
    """
    if isinstance(given, list):
        return [value_of(one, names) for one in given]
    return eval(_compiled(given), names) if isinstance(given, str) else given


@cache
def _compiled(formula: str) -> CodeType:
    return compile(formula.strip(), "a formula", "eval")
