"""The methods that a study runs: those of the package, and the user's own."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from cns_drake.base.errors import InputError
from cns_drake.base.jobs.fingerprint import script_digest
from evaluation.methods import (
    Method,
    known_methods,
    make_method,
    shipped_methods,
)
from evaluation.methods.own_file import load_method


@dataclass(frozen=True)
class MethodChoice:
    """A method that any process can make.

    Attributes:
        name: under which it is registered.
        file: the Python file that registers it; None for a method of this
            package.
    """

    name: str
    file: Path | None = None

    def make(self) -> Method:
        """Returns the method with its default parameters.

        Raises:
            InputError: if its file cannot be used.
        """
        # Run once: a second run would make a second, different type of its
        # descriptions.
        if self.file is not None and self.name not in known_methods():
            load_method(self.file)
        return make_method(self.name, {})

    def inputs(self) -> dict:
        """Returns what its results depend on, ready for JSON.

        Raises:
            InputError: if its file cannot be used.
        """
        values = {
            "name": self.name,
            "parameters": self.make().config.model_dump(mode="json"),
        }
        if self.file is not None:
            values["file"] = script_digest(self.file)
        return values


def choose_methods(files: Iterable[Path] = ()) -> tuple[MethodChoice, ...]:
    """Returns the methods of this package, and those of some files.

    Raises:
        InputError: if a file registers no method, or one that is there
            already.
    """
    chosen = [MethodChoice(name) for name in shipped_methods()]
    stems = set()
    for file in files:
        path = Path(file).absolute()
        # Modules of one name would replace each other.
        if path.stem in stems:
            raise InputError(f"--method: {path.name} is there twice")
        stems.add(path.stem)
        choice = MethodChoice(load_method(path).name, path)
        if choice.name in {one.name for one in chosen}:
            raise InputError(f"{path}: another method is named {choice.name!r}")
        chosen.append(choice)
    return tuple(chosen)
