"""The registry of place-recognition methods, by their names.

A shipped method is a module of this package that has a class with the decorator
`register`.
"""

from collections.abc import Callable, Mapping
import contextlib
import functools
from typing import Any, TypeVar

from pydantic import ValidationError

from evaluation.base import (
    Family,
    InputError,
    describe_validation_error,
    errors_at,
    import_modules,
    no_such,
)
from evaluation.methods.method import Method, check_class
from evaluation.methods.own_files import users_code

METHODS: Family[type[Method]] = Family(
    "method", functools.partial(import_modules, str(__package__))
)
_MethodClass = TypeVar("_MethodClass", bound=type[Method])


def register(name: str) -> Callable[[_MethodClass], _MethodClass]:
    """Returns a decorator that registers a Method under a name.

    Raises:
        ValueError: if another method has that name, or the name is empty, has
            unprintable characters, or begins or ends with a space.
        InputError: if the class is no complete method.

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
        with errors_at(getattr(method, "__name__", repr(method))):
            check_class(method)
        module = method.__module__
        method.name = name
        method.title = method.title or name
        if not module.startswith(f"{__package__}."):
            METHODS.load_own()
        METHODS.add(name, method, (module, method.__qualname__))
        return method

    return enter


def known_methods() -> tuple[str, ...]:
    """Returns the names of all methods.

    These are the shipped methods, the optional methods, those of plug-ins, and
    methods of your own whose files have been loaded.

    Example:
        from evaluation import known_methods

        print(known_methods())
    """
    return tuple(sorted(METHODS))


def optional_methods() -> tuple[str, ...]:
    """Returns the names of the methods that run only on request.

    Methods of files are left out.
    """
    return _installed_methods(standard=False)


def shipped_methods() -> tuple[str, ...]:
    """Returns the names of the methods that run by default."""
    return _installed_methods(standard=True)


def _installed_methods(*, standard: bool) -> tuple[str, ...]:
    return tuple(
        name
        for name in known_methods()
        if METHODS[name].standard == standard and METHODS[name]._file is None
    )


def find_method(name: str) -> type[Method]:
    """Returns the class of a method.

    Raises:
        InputError: there is no such method.
    """
    if name in METHODS:
        return METHODS[name]
    raise InputError(f"name: {no_such('method', name, known_methods())}")


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
            fault = no_such("parameter", key, method.Config.model_fields)
            raise InputError(f"{name}: {fault}")
    naming = (
        users_code(method._file) if method._file else contextlib.nullcontext()
    )
    with naming:
        try:
            return method(method.Config(**parameters))
        except ValidationError as error:
            fault = describe_validation_error(name, error, method.Config)
            raise InputError(fault) from error
