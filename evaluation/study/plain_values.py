"""Values as bytes without code: numbers, text, arrays, dataclasses.

Unpickling can run any code that the bytes name. Here a tree of JSON contains
the values. Arrays follow it as NumPy stores them, with all bits. Dataclasses
are made of their fields, without running their code.
"""

import dataclasses
import importlib
import io
import json
import re
import struct
import sys
import tokenize
from typing import Any

import numpy as np

_LENGTH = struct.Struct("<Q")
_OWN_MODULE = re.compile(r"evaluation(\.[a-z]\w*)+")


def encode(value: object) -> bytes:
    """Returns a value as bytes; equal values give equal bytes.

    Args:
        value: None, a number, text, bytes, an array of no objects, or a
            list, tuple, dict, named tuple or dataclass of such values.

    Raises:
        TypeError: if there is anything else in it.
    """
    encoder = _Encoder()
    tree = json.dumps(encoder.encode(value), separators=(",", ":")).encode()
    stream = io.BytesIO()
    stream.write(_LENGTH.pack(len(tree)))
    stream.write(tree)
    for array in encoder.arrays:
        np.lib.format.write_array(stream, array, allow_pickle=False)
    return stream.getvalue()


def decode(data: bytes) -> Any:
    """Returns the value of bytes by `encode`.

    Dataclasses are those of this package, or of modules that have been
    imported.

    Raises:
        ValueError: if the bytes are not from `encode`, or a type is unknown.
    """
    try:
        (length,) = _LENGTH.unpack_from(data)
        start = _LENGTH.size + length
        tree = json.loads(data[_LENGTH.size : start])
        return _decode(tree, _read_arrays(data, start))
    except (
        # Errors for a tree of another form or with other fields, and for
        # headers of arrays that NumPy cannot parse.
        AttributeError,
        ImportError,
        IndexError,
        KeyError,
        OverflowError,
        RecursionError,
        SyntaxError,
        TypeError,
        struct.error,
        tokenize.TokenError,
    ) as error:
        raise ValueError(f"{type(error).__name__}: {error}") from error


class _Encoder:
    """Makes a tree of a value; arrays that occur twice are stored once."""

    def __init__(self) -> None:
        self.arrays: list[np.ndarray] = []
        # The identity of an array -> its number.
        self._numbers: dict[int, int] = {}

    def encode(self, value: Any) -> Any:
        kind = type(value)
        if value is None or kind in (bool, int, float, str):
            return value
        if kind is list:
            return [self.encode(one) for one in value]
        if kind is tuple:
            return {"tuple": [self.encode(one) for one in value]}
        if kind is dict:
            pairs = [[self.encode(k), self.encode(v)] for k, v in value.items()]
            return {"dict": pairs}
        if kind is np.ndarray:
            return {"array": self._add(value)}
        if kind is bytes:
            return {"bytes": self._add(np.frombuffer(value, np.uint8))}
        if isinstance(value, np.generic):
            return {"scalar": self._add(np.asarray(value))}
        name = [kind.__module__, kind.__qualname__]
        if dataclasses.is_dataclass(value):
            fields = {
                field.name: self.encode(getattr(value, field.name))
                for field in dataclasses.fields(value)
            }
            return {"dataclass": name, "fields": fields}
        if isinstance(value, tuple) and hasattr(value, "_fields"):
            return {"named": name, "values": [self.encode(v) for v in value]}
        raise TypeError(
            f"{'.'.join(name)} cannot be kept: use numbers, text, arrays, or"
            " lists, tuples, dicts and dataclasses of them"
        )

    def _add(self, array: np.ndarray) -> int:
        if id(array) not in self._numbers:
            if array.dtype.hasobject:
                raise TypeError("an array of objects cannot be kept")
            self._numbers[id(array)] = len(self.arrays)
            self.arrays.append(array)
        return self._numbers[id(array)]


def _read_arrays(data: bytes, start: int) -> list[np.ndarray]:
    """Returns the arrays from a place on."""
    stream = io.BytesIO(data)
    stream.seek(start)
    arrays = []
    while stream.tell() < len(data):
        arrays.append(np.lib.format.read_array(stream, allow_pickle=False))
    return arrays


def _decode(tree: Any, arrays: list[np.ndarray]) -> Any:
    if isinstance(tree, list):
        return [_decode(one, arrays) for one in tree]
    if not isinstance(tree, dict):
        return tree
    if "tuple" in tree:
        return tuple(_decode(one, arrays) for one in tree["tuple"])
    if "dict" in tree:
        return {
            _decode(key, arrays): _decode(value, arrays)
            for key, value in tree["dict"]
        }
    if "array" in tree:
        return arrays[tree["array"]]
    if "bytes" in tree:
        return arrays[tree["bytes"]].tobytes()
    if "scalar" in tree:
        return arrays[tree["scalar"]][()]
    if "named" in tree:
        values = [_decode(one, arrays) for one in tree["values"]]
        kind = _find(*tree["named"])
        if not issubclass(kind, tuple) or len(kind._fields) != len(values):
            raise TypeError(f"{kind.__name__} is no such tuple")
        return tuple.__new__(kind, values)
    kind = _find(*tree["dataclass"])
    names = {field.name for field in dataclasses.fields(kind)}
    if names != tree["fields"].keys():
        raise TypeError(f"{kind.__name__} has other fields")
    made = object.__new__(kind)
    for name, value in tree["fields"].items():
        object.__setattr__(made, name, _decode(value, arrays))
    return made


def _find(module: str, name: str) -> Any:
    """Returns a type; imports nothing but modules of this package."""
    if module not in sys.modules and _OWN_MODULE.fullmatch(module):
        importlib.import_module(module)
    found: Any = sys.modules[module]
    for part in name.split("."):
        found = vars(found)[part]
    if not isinstance(found, type):
        raise TypeError(f"{name} is no type")
    return found
