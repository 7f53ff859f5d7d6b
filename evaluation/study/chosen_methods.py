"""Chooses the methods that a study runs: shipped ones and your own."""

from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace
import os
from pathlib import Path

from cns_drake.base.errors import InputError, did_you_mean
from cns_drake.base.jobs.file_digests import file_digests
from cns_drake.base.jobs.fingerprint import script_digest
from evaluation.methods import (
    Method,
    known_methods,
    make_method,
    optional_methods,
    shipped_methods,
)
from evaluation.methods.method import load_method

# The value of a parameter, as text.
Setting = str | tuple[str, ...]

_FORM = "METHOD.NAME=VALUE"


@dataclass(frozen=True)
class MethodChoice:
    """A method with its settings, from which any process can make it.

    Attributes:
        name: name of the method.
        file: Python file that registers it; None for a method of this package.
        settings: name and value of each parameter that differs from its
            default.
    """

    name: str
    file: Path | None = None
    settings: tuple[tuple[str, Setting], ...] = ()

    @property
    def key(self) -> str:
        """Unique name: the method's name with its settings."""
        settings = (f"{name}={value}" for name, value in self.settings)
        return " ".join([self.name, *settings])

    def make(self) -> Method:
        """Returns the chosen method, with its settings.

        Raises:
            InputError: if the method's file cannot be used, or a setting is
                unknown or does not fit.
        """
        # The file runs once: a second run would make another type of its
        # descriptions.
        if self.file is not None and self.name not in known_methods():
            load_method(self.file)
        return make_method(self.name, dict(self.settings))

    def identity(self) -> dict:
        """Returns everything on which the method's results depend, for JSON.

        Raises:
            InputError: if its file cannot be used.
        """
        config = self.make().config
        values: dict = {
            "name": self.name,
            "parameters": config.model_dump(mode="json"),
            "files": dict(_digests(config.model_dump())),
        }
        if self.file is not None:
            values["file"] = script_digest(self.file)
        return values


def _digests(value: object) -> Iterator[tuple[str, list[str]]]:
    """Yields the files and folders that settings name, with their digests.

    Settings can be lists, or settings of their own. A text counts as a path
    only if there is such a file.
    """
    if isinstance(value, Mapping):
        value = list(value.values())
    if isinstance(value, Sequence | Set) and not isinstance(value, str | bytes):
        for one in value:
            yield from _digests(one)
    elif isinstance(value, str | Path):
        path = Path(value)
        files = [path]
        if isinstance(value, Path) and path.is_dir():
            files = sorted(one for one in path.rglob("*") if one.is_file())
        elif not os.path.isfile(value):
            return
        yield str(value), file_digests(files)


def parse_setting(text: str, form: str = "NAME=VALUE") -> tuple[str, Setting]:
    """Returns the name and the value of a setting.

    Args:
        text: the setting, `NAME=VALUE`. Commas separate the values of a list.
        form: how a setting must look, for the error message.

    Raises:
        InputError: if it has no name or no equals sign.
    """
    name, equals, value = text.partition("=")
    if not (name and equals):
        raise InputError(f"--set: {text!r} is not {form}")
    return name, tuple(value.split(",")) if "," in value else value


def choose_methods(
    files: Iterable[Path] = (),
    settings: Iterable[str] = (),
) -> tuple[MethodChoice, ...]:
    """Returns the shipped methods, and further ones on request.

    Args:
        files: Python files that register a method each, or names of optional
            methods of this package.
        settings: `METHOD.NAME=VALUE` for parameters that differ from their
            defaults.

    Raises:
        InputError: `files` contains an unknown name, a shipped method, the same
            file twice, or a file that registers no method or one whose name is
            taken; an optional method is not installed; or a setting is unknown
            or its value is not valid.
    """
    chosen = [MethodChoice(name) for name in shipped_methods()]
    stems = set()
    for file in files:
        if str(file) in optional_methods():
            chosen.append(MethodChoice(str(file)))
            continue
        path = Path(file).absolute()
        if str(file) in shipped_methods():
            raise InputError(f"--method: {file} runs anyway; leave it out")
        if not path.suffix and not path.is_file():
            known = optional_methods()
            raise InputError(
                f"--method: {file}: neither a Python file nor one of"
                f" {', '.join(known)}{did_you_mean(str(file), known)}"
            )
        # Two modules with one name would replace each other.
        if path.stem in stems:
            raise InputError(f"--method: {path.name} is there twice")
        stems.add(path.stem)
        choice = MethodChoice(load_method(path).name, path)
        if choice.name in {one.name for one in chosen}:
            raise InputError(f"{path}: another method is named {choice.name!r}")
        chosen.append(choice)
    named: dict[str, dict[str, Setting]] = {one.name: {} for one in chosen}
    for text in settings:
        key, value = parse_setting(text, _FORM)
        method, dot, name = key.rpartition(".")
        if not dot:
            raise InputError(f"--set: {text!r} is not {_FORM}")
        if method not in named:
            raise InputError(
                f"--set: no method {method!r} (known: {', '.join(named)})"
                f"{did_you_mean(method, named)}"
            )
        named[method][name] = value
    chosen = [
        replace(one, settings=tuple(named[one.name].items())) for one in chosen
    ]
    for one in chosen:
        # A wrong value, or a missing package, is found before anything slow.
        if one.settings or one.name in optional_methods():
            one.make()
    return tuple(chosen)
