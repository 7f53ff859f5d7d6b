"""The registry of place-recognition methods, by their names.

A shipped method is found by its file: a module of this package that has a class
with the decorator `register`. Its name and its facts are read from the source,
because importing all methods takes seconds.
"""

import ast
from collections.abc import Callable, Iterator, Mapping
import contextlib
from dataclasses import dataclass, fields
import functools
import importlib
import importlib.util
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from cns_drake.base import InputError, did_you_mean, family_members
from evaluation.methods.method import Method
from evaluation.methods.own_files import users_code

# Methods of the user, by name.
_METHODS: dict[str, type[Method]] = {}
_MethodClass = TypeVar("_MethodClass", bound=type[Method])


@dataclass(frozen=True)
class MethodFacts:
    """What tables and charts show of a method, see `Method`.

    Attributes:
        title: its name, as its authors write it.
        style: its colour, line style and marker; None if it has none.
        source: its publication; empty for a method of this project.
        standard: whether it runs by default.
        order: its place in tables.
    """

    title: str
    style: tuple[str, str, str] | None = Method.style
    source: str = Method.source
    standard: bool = Method.standard
    order: int = Method.order


@dataclass(frozen=True)
class _Shipped:
    """A shipped method: the full name of its module, and its facts."""

    module: str
    facts: MethodFacts


@functools.cache
def _shipped() -> Mapping[str, _Shipped]:
    """Returns name -> the shipped method, sorted by name."""
    found = {}
    package = str(__package__)
    for module in family_members(package, "@register(").values():
        spec = importlib.util.find_spec(module)
        assert spec is not None
        assert spec.origin is not None
        for node in ast.parse(Path(spec.origin).read_bytes()).body:
            for name, values in _registered(node):
                facts = MethodFacts(**{"title": name, **values})
                found[name] = _Shipped(module, facts)
    return dict(sorted(found.items()))


def _registered(node: ast.stmt) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yields the name and the facts of a class with the decorator `register`.

    A fact is a literal in the body of the class.
    """
    if not isinstance(node, ast.ClassDef):
        return
    names = {one.name for one in fields(MethodFacts)}
    for call in node.decorator_list:
        if isinstance(call, ast.Call) and ast.unparse(call.func) == "register":
            yield (
                ast.literal_eval(call.args[0]),
                {
                    line.targets[0].id: ast.literal_eval(line.value)
                    for line in node.body
                    if isinstance(line, ast.Assign)
                    and isinstance(line.targets[0], ast.Name)
                    and line.targets[0].id in names
                },
            )


def register(name: str) -> Callable[[_MethodClass], _MethodClass]:
    """Returns a decorator that registers a Method under a name.

    Raises:
        ValueError: if another method has that name, or the name is empty, has
            unprintable characters, or begins or ends with a space.

    Example:
        from evaluation import Method, register

        @register("mine")
        class Mine(Method):
            ...
    """

    # Cells of tables are read without the spaces around them.
    if not (name.isprintable() and name and name == name.strip()):
        raise ValueError(f"{name!r} is no name of a method")

    def enter(method: _MethodClass) -> _MethodClass:
        method.name = name
        if method.__module__.startswith(f"{__package__}."):
            return method  # It is found by its file.
        other = _METHODS.get(name, method)
        # The same class may be registered again, when its file runs again.
        if name in _shipped() or (
            other.__module__,
            other.__qualname__,
        ) != (method.__module__, method.__qualname__):
            raise ValueError(f"there is another method {name!r}")
        _METHODS[name] = method
        return method

    return enter


def known_methods() -> tuple[str, ...]:
    """Returns the names of all methods.

    These are the shipped methods, the optional methods, and methods of your own
    whose files have been loaded.

    Example:
        from evaluation import known_methods

        print(known_methods())
    """
    return tuple(sorted({*_METHODS, *_shipped()}))


def optional_methods() -> tuple[str, ...]:
    """Returns the names of the methods that run only on request."""
    return tuple(n for n, one in _shipped().items() if not one.facts.standard)


def shipped_methods() -> tuple[str, ...]:
    """Returns the names of the methods that run by default."""
    return tuple(n for n, one in _shipped().items() if one.facts.standard)


def method_facts(name: str) -> MethodFacts | None:
    """Returns what tables and charts show of a method; None if it is unknown.

    Args:
        name: name of a shipped method, or of a method of your own whose file
            has been loaded.
    """
    if name in _shipped():
        return _shipped()[name].facts
    own = _METHODS.get(name)
    if own is None:
        return None
    values = {one.name: getattr(own, one.name) for one in fields(MethodFacts)}
    return MethodFacts(**{**values, "title": own.title or name})


def find_method(name: str) -> type[Method]:
    """Returns the class of a method.

    Raises:
        InputError: there is no such method.
    """
    if name in _METHODS:
        return _METHODS[name]
    if name in _shipped():
        module = importlib.import_module(_shipped()[name].module)
        for value in vars(module).values():
            if isinstance(value, type) and vars(value).get("name") == name:
                return value
    known = known_methods()
    raise InputError(
        f"name: no method {name!r} (known: {', '.join(known)})"
        f"{did_you_mean(name, known)}"
    )


def make_method(name: str, parameters: Mapping[str, Any]) -> Method:
    """Returns a method; parameters that are not given have their defaults.

    Raises:
        InputError: if the method or a parameter is unknown, or a value does not
            fit.

    Example:
        from evaluation import make_method

        method = make_method("solid", {"sensor_height": 1.8})
    """
    method = find_method(name)
    for key in parameters:
        if key not in method.Config.model_fields:
            fields = list(method.Config.model_fields)
            raise InputError(
                f"{name}: no parameter {key!r} (known: {', '.join(fields)})"
                f"{did_you_mean(key, fields)}"
            )
    naming = (
        users_code(method._file) if method._file else contextlib.nullcontext()
    )
    with naming:
        try:
            return method(method.Config(**parameters))
        except ValidationError as error:
            fault = error.errors()[0]
            field = ".".join(str(part) for part in fault["loc"])
            raise InputError(f"{name}: {field}: {fault['msg']}") from error
