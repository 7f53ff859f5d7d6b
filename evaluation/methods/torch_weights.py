"""Weights that PyTorch has saved, read without PyTorch.

A file of `torch.save` is an archive with a pickle and the numbers of each
tensor. An unpickler can run any code, and can fill the memory when it reads a
small pickle. This reader runs the instructions of a pickle itself: each
instruction makes at most one small object, nothing is called, and numbers are
read only for the tensors that are wanted.
"""

from collections.abc import Iterator, Mapping
import io
from pathlib import Path
import pickletools
from typing import Any, NamedTuple
import zipfile

import numpy as np

from cns_drake.base.errors import InputError, one_line
from cns_drake.base.files import read_bytes
from cns_drake.base.terminal import note

# Greatest size of a file, and of its unpacked content [bytes].
MOST_BYTES = 200_000_000
# Greatest number of instructions of a pickle; a tensor takes some thirty.
_MOST_STEPS = 200_000
# Greatest number of axes of a tensor.
_MOST_AXES = 16
# How far dictionaries are searched for tensors.
_DEEPEST = 6
_BFLOAT16 = "bfloat16"
# PyTorch's name of the type of a storage -> that of NumPy.
_TYPES = {
    **{"FloatStorage": "f4", "DoubleStorage": "f8", "HalfStorage": "f2"},
    **{"LongStorage": "i8", "IntStorage": "i4", "ShortStorage": "i2"},
    **{"CharStorage": "i1", "ByteStorage": "u1", "BoolStorage": "?"},
    "BFloat16Storage": _BFLOAT16,
}
# Files of `torch.save` before PyTorch 1.6 begin with this.
_LEGACY = b"\x80\x02\x8a\nl\xfc\x9cF\xf9 j\xa8P\x19."
_CONSTANTS = {
    "INT", "BININT", "BININT1", "BININT2", "LONG", "LONG1", "LONG4",
    "FLOAT", "BINFLOAT", "STRING", "BINSTRING", "SHORT_BINSTRING",
    "UNICODE", "BINUNICODE", "SHORT_BINUNICODE", "BINUNICODE8",
    "BINBYTES", "SHORT_BINBYTES", "BINBYTES8", "BYTEARRAY8",
}  # fmt: skip
_VALUES = {"NONE": None, "NEWTRUE": True, "NEWFALSE": False}


class _Name(NamedTuple):
    """A class or function, by its name; it is never called."""

    module: str
    name: str


class _Storage(NamedTuple):
    """The numbers of tensors: their type, and their file in the archive."""

    kind: str
    key: str


class _Tensor(NamedTuple):
    """A tensor: a view of a storage; offset and steps count numbers."""

    storage: _Storage
    offset: int
    shape: tuple[int, ...]
    steps: tuple[int, ...]


# Stands for any object that is neither a container nor a tensor.
_OPAQUE = object()


def _run(pickle: bytes) -> Any:
    """Returns the object of a pickle, in which only tensors are made.

    Raises:
        ValueError: the pickle is damaged, or has too many instructions.
    """
    machine = _Machine()
    for number, (code, argument, _) in enumerate(pickletools.genops(pickle)):
        if number == _MOST_STEPS:
            raise ValueError(f"a pickle of more than {_MOST_STEPS} steps")
        if code.name == "STOP":
            return machine.stack.pop()
        machine.step(code.name, argument)
    raise ValueError("a pickle without an end")


class _Machine:
    """The stack and the memory of a pickle."""

    def __init__(self) -> None:
        self.stack: list[Any] = []
        self._marks: list[list[Any]] = []
        self._memory: dict[int, Any] = {}

    def step(self, code: str, argument: Any) -> None:
        """Executes an instruction."""
        stack = self.stack
        if code in _CONSTANTS:
            stack.append(argument)
        elif code in _VALUES:
            stack.append(_VALUES[code])
        elif code == "MARK":
            self._marks.append(stack)
            self.stack = []
        elif code in ("EMPTY_DICT", "EMPTY_LIST", "EMPTY_TUPLE"):
            stack.append({"D": dict, "L": list, "T": tuple}[code[6]]())
        elif code in ("TUPLE1", "TUPLE2", "TUPLE3"):
            stack.append(self._pop(int(code[-1])))
        elif code in ("TUPLE", "LIST"):
            items = self._since_mark()
            self.stack.append(tuple(items) if code == "TUPLE" else items)
        elif code in ("DICT", "SETITEMS"):
            items = self._since_mark()
            if code == "DICT":
                self.stack.append({})
            self._set(items)
        elif code == "SETITEM":
            self._set(self._pop(2))
        elif code in ("APPEND", "APPENDS", "ADDITEMS"):
            more = self._pop(1) if code == "APPEND" else self._since_mark()
            if isinstance(self.stack[-1], list):
                self.stack[-1].extend(more)
        elif code in ("PUT", "BINPUT", "LONG_BINPUT", "MEMOIZE"):
            place = len(self._memory) if code == "MEMOIZE" else int(argument)
            self._memory[place] = stack[-1]
        elif code in ("GET", "BINGET", "LONG_BINGET"):
            stack.append(self._memory[int(argument)])
        elif code == "GLOBAL":
            stack.append(_Name(*argument.split(" ", 1)))
        elif code == "STACK_GLOBAL":
            module, name = self._pop(2)
            stack.append(_Name(str(module), str(name)))
        elif code == "BINPERSID":
            (place,) = self._pop(1)
            stack.append(_storage(place))
        elif code == "REDUCE":
            function, arguments = self._pop(2)
            stack.append(_made(function, arguments))
        elif code in ("NEWOBJ", "NEWOBJ_EX"):
            self._pop(2 if code == "NEWOBJ" else 3)
            stack.append(_OPAQUE)
        elif code in ("BUILD", "POP"):
            self._pop(1)
        elif code in ("POP_MARK", "OBJ", "INST", "FROZENSET"):
            self._since_mark()
            if code != "POP_MARK":
                self.stack.append(_OPAQUE)
        elif code == "DUP":
            stack.append(stack[-1])
        elif code == "EMPTY_SET":
            stack.append(_OPAQUE)
        elif code not in ("PROTO", "FRAME"):
            raise ValueError(f"an instruction {code}")

    def _pop(self, number: int) -> tuple:
        if len(self.stack) < number:
            raise ValueError("an empty stack")
        popped = tuple(self.stack[-number:])
        del self.stack[-number:]
        return popped

    def _since_mark(self) -> list:
        items = self.stack
        self.stack = self._marks.pop()
        return items

    def _set(self, items: list | tuple) -> None:
        if isinstance(self.stack[-1], dict):
            for key, value in zip(items[::2], items[1::2], strict=True):
                # Names of tensors are texts; other keys may not be hashable.
                if isinstance(key, str):
                    self.stack[-1][key] = value


def _storage(place: Any) -> Any:
    """Returns the storage of a persistent id, as `torch.save` writes it."""
    match place:
        case ("storage", _Name("torch", kind), str(key), *_):
            return _Storage(kind, key)
    return _OPAQUE


def _made(function: Any, arguments: Any) -> Any:
    """Returns what a call in a pickle makes, if it is a dict or a tensor."""
    match function, arguments:
        case _Name("collections", "OrderedDict"), ():
            return {}
        case _Name("torch._utils", name), (_Storage(), int(), *_) if name in (
            "_rebuild_tensor_v2",
            "_rebuild_tensor",
        ):
            storage, offset, shape, steps = arguments[:4]
            if _are_sizes(shape) and _are_sizes(steps):
                return _Tensor(storage, offset, shape, steps)
        case _Name("torch._utils", name), (_Tensor() as tensor, *_) if (
            name.startswith("_rebuild_parameter")
        ):
            return tensor
    return _OPAQUE


def _are_sizes(value: Any) -> bool:
    return (
        isinstance(value, tuple)
        and len(value) <= _MOST_AXES
        and all(type(one) is int for one in value)
    )


def read_weights(
    path: Path, shapes: Mapping[str, tuple[int, ...]]
) -> dict[str, np.ndarray]:
    """Returns name -> tensor (float32) of a network's weights.

    Numbers of other types are converted. The dictionary of tensors may lie
    inside other dictionaries, and all names in it may begin with the same
    words, such as `module.`, which `DataParallel` adds. If several dictionaries
    have the wanted names, the first dictionary is read, and a note on stderr
    names it.

    Args:
        path: file that `torch.save` wrote (PyTorch 1.6 or later), with a state
            dict, or with a dict that contains a state dict.
        shapes: name -> shape of the wanted tensors.

    Raises:
        InputError: the file cannot be read, or a tensor is missing, of another
            shape or not finite.
    """
    content = read_bytes(path, MOST_BYTES)
    if content.startswith(_LEGACY):
        raise InputError(
            f"{path}: written by PyTorch before 1.6; load it there, and save"
            " it with a newer one"
        )
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            if sum(one.file_size for one in archive.infolist()) > MOST_BYTES:
                raise ValueError(f"unpacks to more than {MOST_BYTES} bytes")
            names = archive.namelist()
            (name,) = (one for one in names if one.endswith("/data.pkl"))
            if any("/code/" in one for one in names):
                raise ValueError("a program of TorchScript; save its state")
            state = _find_state(path, _run(archive.read(name)), shapes)
            return {
                name: _read(path, name, state.get(name), shape, archive)
                for name, shape in shapes.items()
            }
    except InputError:
        raise
    # A damaged archive or pickle can raise any error.
    except Exception as error:
        fault = one_line(f"{type(error).__name__}: {error}")
        raise InputError(f"{path}: no weights of PyTorch ({fault})") from error


def _find_state(
    path: Path, found: Any, shapes: Mapping[str, tuple[int, ...]]
) -> dict[str, Any]:
    """Returns wanted name -> object, of the best dictionary of tensors."""
    best: list[tuple[str, dict[str, Any]]] = [("", {})]
    for place, inner in _dictionaries(found, "", _DEEPEST, set()):
        # All wanted names may follow the same words.
        prefixes = {
            key.removesuffix(name)
            for key in inner
            for name in shapes
            if key == name or key.endswith(f".{name}")
        }
        for prefix in sorted(prefixes):
            state = {
                name: inner[prefix + name]
                for name in shapes
                if prefix + name in inner
            }
            if len(state) > len(best[0][1]):
                best = []
            if not best or len(state) == len(best[0][1]):
                best.append((place or prefix or "the file", state))
    if len(best) > 1:
        others = ", ".join(place for place, _ in best[1:])
        note(f"{path}: the weights in {best[0][0]} are read, not in {others}")
    return best[0][1]


def _dictionaries(
    value: Any, place: str, levels: int, seen: set[int]
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yields a dictionary and those in it, each once, with their places."""
    if not isinstance(value, dict | list | tuple) or hasattr(value, "_fields"):
        return
    if levels and id(value) not in seen:
        seen.add(id(value))
        items: Any = enumerate(value)
        if isinstance(value, dict):
            yield place, value
            items = value.items()
        for key, inner in items:
            below = one_line(f"{place}.{key}" if place else key)
            yield from _dictionaries(inner, below, levels - 1, seen)


def _read(
    path: Path,
    name: str,
    tensor: Any,
    shape: tuple[int, ...],
    archive: zipfile.ZipFile,
) -> np.ndarray:
    """Returns a tensor as float32.

    Raises:
        InputError: there is no such tensor, or it has another shape or type, or
            is not finite.
    """
    if not isinstance(tensor, _Tensor):
        raise InputError(f"{path}: {name}: no such tensor")
    if tensor.shape != shape:
        raise InputError(
            f"{path}: {name}: shape {tensor.shape} instead of {shape}"
        )
    kind = _TYPES.get(tensor.storage.kind)
    if kind is None:
        raise InputError(
            f"{path}: {name}: numbers of the type {tensor.storage.kind}"
        )
    (root,) = (
        one.removesuffix("data.pkl")
        for one in archive.namelist()
        if one.endswith("/data.pkl")
    )
    order = "<"
    if f"{root}byteorder" in archive.namelist():
        order = {b"big": ">"}.get(archive.read(f"{root}byteorder"), "<")
    content = archive.read(f"{root}data/{tensor.storage.key}")
    dtype = np.dtype(order + ("u2" if kind is _BFLOAT16 else kind))
    # NumPy refuses a view that would reach outside of the storage.
    values = np.ndarray(
        shape,
        dtype,
        content,
        dtype.itemsize * tensor.offset,
        [dtype.itemsize * step for step in tensor.steps],
    )
    if kind is _BFLOAT16:
        # These are the upper halves of float32.
        values = (values.astype(np.uint32) << 16).view(np.float32)
    with np.errstate(over="ignore"):
        numbers = values.astype(np.float32)
    if not np.isfinite(numbers).all():
        raise InputError(f"{path}: {name}: not all are finite numbers")
    return numbers
