"""Values of plain data as bytes, which can be read without running code.

A pickle can run any code when it is read. The bytes of this module contain only
a tree of JSON, followed by the arrays as NumPy stores them.
"""

from dataclasses import fields, is_dataclass
import importlib
import io
import json
import math
import re
import struct
import sys
import tokenize
from types import NoneType, UnionType
from typing import Any, BinaryIO, Union, get_args, get_origin, get_type_hints

import numpy as np

_LENGTH = struct.Struct("<Q")
# Types in these modules belong to methods and are not checked.
_METHODS = "evaluation.methods"
_OWN_MODULE = re.compile(r"evaluation(\.[a-z]\w*)+")
# Errors for a tree of another form or with other fields, and for headers of
# arrays that NumPy cannot parse.
DECODING_ERRORS = (
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
)
# The form of a tree -> the type of its value; see `_Encoder`.
_FORMS: dict[str, type] = {
    "tuple": tuple,
    "dict": dict,
    "array": np.ndarray,
    "bytes": bytes,
}


def encode(value: object) -> bytes:
    """Returns a value as bytes; equal values give equal bytes.

    A value is None, a number, text, bytes, an array without Python objects, or
    a list, tuple, dict, named tuple or dataclass of such values.

    Raises:
        TypeError: if the value contains anything else.
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
    """Returns the value that `encode` turned into bytes.

    Dataclasses must belong to this package, or to modules that have been
    imported.

    Raises:
        ValueError: if the bytes are not from `encode`, or a type is unknown.
    """
    try:
        (length,) = _LENGTH.unpack_from(data)
        start = _LENGTH.size + length
        tree = json.loads(data[_LENGTH.size : start])
        return _decode_tree(tree, _read_arrays(data, start))
    except DECODING_ERRORS as error:
        raise ValueError(f"{type(error).__name__}: {error}") from error


class _Encoder:
    """Turns a value into a tree; arrays that occur twice are stored once."""

    def __init__(self) -> None:
        self.arrays: list[np.ndarray] = []
        # The identity of an array -> its number.
        self._numbers: dict[int, int] = {}

    def encode(self, value: Any) -> Any:
        """Returns the tree of a value, and adds its arrays to `arrays`."""
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
            return {"array": self._number_of(value)}
        if kind is bytes:
            return {"bytes": self._number_of(np.frombuffer(value, np.uint8))}
        if isinstance(value, np.generic):
            return {"scalar": self._number_of(np.asarray(value))}
        name = [kind.__module__, kind.__qualname__]
        if is_dataclass(value):
            values = {
                field.name: self.encode(getattr(value, field.name))
                for field in fields(value)
            }
            return {"dataclass": name, "fields": values}
        if isinstance(value, tuple) and hasattr(value, "_fields"):
            return {"named": name, "values": [self.encode(v) for v in value]}
        raise TypeError(
            f"{'.'.join(name)} cannot be kept: use numbers, text, arrays, or"
            " lists, tuples, dicts and dataclasses of them"
        )

    def _number_of(self, array: np.ndarray) -> int:
        """Returns the number of an array, which is stored if it is new."""
        if id(array) not in self._numbers:
            if array.dtype.hasobject:
                raise TypeError("an array of objects cannot be kept")
            self._numbers[id(array)] = len(self.arrays)
            self.arrays.append(array)
        return self._numbers[id(array)]


def _read_arrays(data: bytes, start: int) -> list[np.ndarray]:
    """Returns the arrays that are stored from an offset onwards."""
    stream = io.BytesIO(data)
    stream.seek(start)
    arrays = []
    while (place := stream.tell()) < len(data):
        # NumPy would first reserve all that a header names.
        is_first = np.lib.format.read_magic(stream) == (1, 0)
        form = "1_0" if is_first else "2_0"
        read = getattr(np.lib.format, f"read_array_header_{form}")
        shape, _, dtype = read(stream)
        if math.prod(shape) * dtype.itemsize > len(data) - stream.tell():
            raise ValueError("an array is cut off")
        stream.seek(place)
        arrays.append(np.lib.format.read_array(stream, allow_pickle=False))
    return arrays


def _decode_tree(tree: Any, arrays: list[np.ndarray]) -> Any:
    """Returns the value of a tree; see `_Encoder`."""
    if isinstance(tree, list):
        return [_decode_tree(one, arrays) for one in tree]
    if not isinstance(tree, dict):
        return tree
    if "tuple" in tree:
        return tuple(_decode_tree(one, arrays) for one in tree["tuple"])
    if "dict" in tree:
        return {
            _decode_tree(key, arrays): _decode_tree(value, arrays)
            for key, value in tree["dict"]
        }
    if "array" in tree:
        return arrays[tree["array"]]
    if "bytes" in tree:
        return arrays[tree["bytes"]].tobytes()
    if "scalar" in tree:
        return arrays[tree["scalar"]][()]
    if "named" in tree:
        values = [_decode_tree(one, arrays) for one in tree["values"]]
        kind = _find_type(*tree["named"])
        if not issubclass(kind, tuple) or len(kind._fields) != len(values):
            raise TypeError(f"{kind.__name__} is no such tuple")
        return tuple.__new__(kind, values)
    kind = _find_type(*tree["dataclass"])
    names = {field.name for field in fields(kind)}
    if names != tree["fields"].keys():
        raise TypeError(f"{kind.__name__} has other fields")
    made = object.__new__(kind)
    for name, value in tree["fields"].items():
        object.__setattr__(made, name, _decode_tree(value, arrays))
    return made


def _find_type(module: str, name: str) -> Any:
    """Returns a type by its name; imports only modules of this package."""
    if module not in sys.modules and _OWN_MODULE.fullmatch(module):
        importlib.import_module(module)
    found: Any = sys.modules[module]
    for part in name.split("."):
        found = vars(found)[part]
    if not isinstance(found, type):
        raise TypeError(f"{name} is no type")
    return found


def read_tree(stream: BinaryIO, most: int) -> Any:
    """Returns the tree of an encoded value, without its arrays.

    Args:
        stream: the encoded value, from its beginning.
        most: greatest number of bytes of the tree that are read.
    """
    (length,) = _LENGTH.unpack(stream.read(_LENGTH.size))
    return json.loads(stream.read(min(length, most)))


def fits_type(tree: Any, hint: Any) -> bool:
    """Returns whether an encoded value may be of a type.

    Arrays may hold anything.

    Args:
        tree: the tree of the value, from `read_tree`.
        hint: the type, as in an annotation.
    """
    kind = get_origin(hint) or hint
    inner = get_args(hint)
    if kind in (Union, UnionType):
        return any(fits_type(tree, one) for one in inner)
    kind = NoneType if kind is None else kind
    is_open = kind is Any or not isinstance(kind, type)
    if is_open or (isinstance(tree, dict) and "scalar" in tree):
        return True
    found = type(tree)
    if isinstance(tree, dict):
        name = tree.get("dataclass") or tree.get("named")
        forms = [one for form, one in _FORMS.items() if form in tree]
        found = _find_type(*name) if name else forms[0]
    if not issubclass(found, (kind, int) if kind is float else kind):
        return False
    if is_dataclass(found) and not found.__module__.startswith(_METHODS):
        hints = annotations(found)
        return all(
            fits_type(tree["fields"][one.name], hints.get(one.name, Any))
            for one in fields(found)
        )
    if found not in (list, tuple, dict) or not inner:
        return True
    items = tree if found is list else tree[found.__name__]
    if found is dict:
        items = [one for _, one in items]
    elif kind is tuple and inner[1:] != (...,):
        return len(items) == len(inner) and all(map(fits_type, items, inner))
    return all(fits_type(one, inner[found is dict]) for one in items)


def annotations(kind: Any) -> dict[str, Any]:
    """Returns the annotations of a class or function, if they can be found."""
    try:
        return get_type_hints(kind)
    except NameError:  # A type is imported for type checkers alone.
        return {}
