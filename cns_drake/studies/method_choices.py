"""The methods that a study runs, each with one combination of settings."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from cns_drake.base.errors import InputError, did_you_mean
from cns_drake.studies.method_variants import method_variants
from evaluation.methods import optional_methods
from evaluation.study.chosen_methods import (
    STANDARD,
    MethodChoice,
    choose_methods,
)


def choose_variants(
    wanted: Mapping[str, Mapping[str, Any]] | None,
) -> Mapping[str, tuple[MethodChoice, Mapping[str, Any]]]:
    """Returns the chosen methods by key, each with columns of its settings.

    Args:
        wanted: maps a method's name or Python file to the method's settings;
            None for all standard methods.

    Raises:
        InputError: a method is unknown, or a setting is wrong.
    """
    files = [Path(one) for one in wanted or () if one.endswith(".py")]
    known = {one.name: one for one in choose_methods([STANDARD, *files])}
    if wanted is None:
        wanted = {name: {} for name in known}
    known |= {name: MethodChoice(name) for name in optional_methods()}
    found = {}
    for name, settings, given in method_variants(wanted):
        place = f"methods.{name}."
        if name.endswith(".py"):
            path = Path(name).absolute()
            name = next(n for n, one in known.items() if one.file == path)
        if name not in known:
            raise InputError(
                f"no method {name!r} (known: {', '.join(known)})"
                f"{did_you_mean(name, known)}"
            )
        choice = replace(known[name], settings=settings)
        choice.make()  # A wrong setting is found before anything slow.
        columns = {
            f"methods.{name}.{column.removeprefix(place)}": one
            for column, one in given.items()
        }
        found[choice.key] = choice, columns
    return found
