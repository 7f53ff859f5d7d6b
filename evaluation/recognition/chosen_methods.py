"""Chooses the methods that are measured: shipped methods and your own."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace
import os
from pathlib import Path

from evaluation.base import (
    InputError,
    did_you_mean,
    file_digests,
    no_such,
    repeated,
)
from evaluation.methods import (
    SETTINGS,
    Method,
    MethodConfig,
    known_methods,
    load_method,
    make_method,
    optional_methods,
    shipped_methods,
)

# The value of a parameter, as text.
Setting = str | tuple[str, ...]

# The name that stands for all standard methods.
STANDARD = "standard"
_FORM = "METHOD.NAME=VALUE"


@dataclass(frozen=True)
class MethodChoice:
    """A method by name and settings, from which any process can make it.

    Attributes:
        name: name of the method.
        file: Python file that registers the method; None for a method of this
            package.
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

    @property
    def columns(self) -> dict[str, Setting]:
        """Value of each setting, by its column in the tables."""
        return {
            f"{SETTINGS}{self.name}.{name}": value
            for name, value in self.settings
        }

    def at_height(self, height: float) -> MethodChoice:
        """Returns the method for a LiDAR at a height above the ground [m].

        If the user has set a height for the method, that height is kept.
        """
        is_set = "sensor_height" in dict(self.settings)
        if is_set or height == MethodConfig().sensor_height:
            return self
        height_set = ("sensor_height", str(height))
        return replace(self, settings=(height_set, *self.settings))

    def make(self) -> Method:
        """Returns the chosen method, with its settings.

        Raises:
            InputError: if the method's file cannot be used, or a setting is
                unknown or does not fit.
        """
        # The file runs once: a second run would make another type of its
        # descriptors.
        if self.file is not None and self.name not in known_methods():
            load_method(self.file)
        return make_method(self.name, dict(self.settings))

    def identity(self) -> dict:
        """Returns everything on which the method's results depend, for JSON.

        The code of a method is known by its version. A user's own file counts
        by its content, too.

        Raises:
            InputError: if the method's file cannot be used.
        """
        method = self.make()
        config = method.config
        return {
            "name": self.name,
            "parameters": config.model_dump(mode="json"),
            "files": dict(_digests(config.model_dump())),
            "version": method.version,
            "file": file_digests([self.file] if self.file else []),
        }


def _digests(value: object) -> Iterator[tuple[str, list[str]]]:
    """Yields the files and folders that settings name, with their digests.

    A setting can be a list, or a mapping of further settings. A text counts as
    a path only if there is such a file.
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
        InputError: if the text has no name or no equals sign.
    """
    name, equals, value = text.partition("=")
    if not (name and equals):
        raise InputError(f"--set: {text!r} is not {form}")
    return name, tuple(value.split(",")) if "," in value else value


def expanded_names(names: Iterable[str]) -> list[str]:
    """Returns names with `standard` expanded; refuses a method named twice.

    The names of all standard methods replace `standard`.

    Raises:
        InputError: a method is named twice.
    """
    found: list[str] = []
    for name in names:
        found += shipped_methods() if name == STANDARD else [name]
    for name in repeated(found):
        raise InputError(f"--method: {name} is there twice")
    return found


def method_settings(
    texts: Iterable[str], names: Sequence[str]
) -> dict[str, dict[str, Setting]]:
    """Returns the settings of each method, by the method's name.

    Args:
        texts: `METHOD.NAME=VALUE` each, or `methods.METHOD.NAME=VALUE`, as in
            the columns of tables. If there is only one method, its name may be
            left out.
        names: names of the methods that run.

    Raises:
        InputError: a text has another form, or names another method.
    """
    found: dict[str, dict[str, Setting]] = {name: {} for name in names}
    is_alone = len(names) == 1
    for text in texts:
        form = "NAME=VALUE" if is_alone else _FORM
        key, value = parse_setting(text.removeprefix(SETTINGS), form)
        method, dot, name = key.rpartition(".")
        if not dot:
            if not is_alone:
                raise InputError(f"--set: {text!r} is not {_FORM}")
            method = names[0]
        if method not in found:
            raise InputError(f"--set: {no_such('method', method, found)}")
        found[method][name] = value
    return found


def choose_method(name: Path | str, texts: Iterable[str] = ()) -> MethodChoice:
    """Returns a method with its settings.

    Args:
        name: name of the method, or a Python file that registers it.
        texts: its settings, see `method_settings`.

    Raises:
        InputError: the file cannot be used, or a text has another form or names
            another method.
    """
    name, file = str(name), None
    if name.endswith(".py"):
        # Errors name the file as the user does.
        file = Path(name).absolute()
        name = load_method(Path(name)).name
    settings = method_settings(texts, [name])[name]
    return MethodChoice(name, file, tuple(settings.items()))


def choose_methods(
    names: Iterable[Path | str] = (),
    settings: Iterable[str] = (),
) -> tuple[MethodChoice, ...]:
    """Returns methods with their settings; by default the standard methods.

    Args:
        names: names of methods of this package, `standard` for all standard
            methods, or Python files that each register a method.
        settings: `METHOD.NAME=VALUE` for parameters that differ from their
            defaults, see `method_settings`.

    Raises:
        InputError: `names` contains an unknown name, a method or a file twice,
            a file that registers no method, or a method whose name is taken; an
            optional method is not installed; or a setting is unknown or has an
            invalid value.
    """
    chosen: list[MethodChoice] = []
    for name in expanded_names(map(str, names)) or shipped_methods():
        if name in (*shipped_methods(), *optional_methods()):
            chosen.append(MethodChoice(name))
            continue
        path = Path(name).absolute()
        if not path.suffix and not path.is_file():
            known = (STANDARD, *shipped_methods(), *optional_methods())
            raise InputError(
                f"--method: {name}: neither a Python file nor one of"
                f" {', '.join(known)}{did_you_mean(name, known)}"
            )
        if path in {one.file for one in chosen}:
            raise InputError(f"--method: {path.name} is there twice")
        choice = MethodChoice(load_method(path).name, path)
        if choice.name in {one.name for one in chosen}:
            raise InputError(f"{path}: another method is named {choice.name!r}")
        chosen.append(choice)
    given = method_settings(settings, [one.name for one in chosen])
    chosen = [
        replace(one, settings=tuple(given[one.name].items())) for one in chosen
    ]
    for one in chosen:
        # A wrong value, or a missing package, is found before anything slow.
        if one.settings or one.name in optional_methods():
            one.make()
    return tuple(chosen)
