"""The registry of place-recognition methods, by their names."""

from collections.abc import Callable, Mapping
import contextlib
import importlib
from typing import Any, TypeVar

from pydantic import ValidationError

from cns_drake.base import InputError, did_you_mean
from evaluation.methods.method import Method
from evaluation.methods.own_files import users_code

_METHODS: dict[str, type[Method]] = {}
# Methods that run by default.
_SHIPPED = (
    "btc",
    "layered-overlap",
    "learned",
    "ring++",
    "scan-context++",
    "solid",
)
# Methods that run only on request. Some need another package or weights.
_OPTIONAL = {
    "bevplace": "evaluation.methods.bevplace",
    "map-closures": "evaluation.methods.map_closures",
    "probe": "evaluation.methods.probe",
    "svt-net": "evaluation.methods.svt_net",
    "dpa-net": "evaluation.methods.dpa_net",
}
_MethodClass = TypeVar("_MethodClass", bound=type[Method])


def register(name: str) -> Callable[[_MethodClass], _MethodClass]:
    """Returns a decorator that registers a Method under a name.

    Raises:
        ValueError: if another method has that name, or the name is empty or has
            unprintable characters.

    Example:
        from evaluation import Method, register

        @register("mine")
        class Mine(Method):
            ...
    """

    if not (name.isprintable() and name.strip()):
        raise ValueError(f"{name!r} is no name of a method")

    def enter(method: _MethodClass) -> _MethodClass:
        other = _METHODS.get(name, method)
        ours = method.__module__.startswith(f"{__package__}.")
        # The same class may be registered again, when its file runs again.
        if ((name in _SHIPPED or name in _OPTIONAL) and not ours) or (
            other.__module__,
            other.__qualname__,
        ) != (method.__module__, method.__qualname__):
            raise ValueError(f"there is another method {name!r}")
        method.name = name
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
    return tuple(sorted({*_METHODS, *_SHIPPED, *_OPTIONAL}))


def optional_methods() -> tuple[str, ...]:
    """Returns the names of the methods that run only on request."""
    return tuple(sorted(_OPTIONAL))


def shipped_methods() -> tuple[str, ...]:
    """Returns the names of the methods that run by default."""
    return _SHIPPED


def make_method(name: str, parameters: Mapping[str, Any]) -> Method:
    """Returns a method; parameters that are not given have their defaults.

    Raises:
        InputError: if the method or a parameter is unknown, or a value does not
            fit.

    Example:
        from evaluation import make_method

        method = make_method("solid", {"sensor_height": 1.8})
    """
    _register_shipped()
    if name in _OPTIONAL:
        importlib.import_module(_OPTIONAL[name])
    if name not in _METHODS:
        known = known_methods()
        raise InputError(
            f"name: no method {name!r} (known: {', '.join(known)})"
            f"{did_you_mean(name, known)}"
        )
    method = _METHODS[name]
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


def _register_shipped() -> None:
    """Imports the methods that run by default; each registers itself."""
    # Statements, because the fingerprints of results follow them.
    from evaluation.methods import (  # noqa: F401
        btc,
        layered_overlap,
        learned,
        ringpp,
        scan_context,
        solid,
    )
