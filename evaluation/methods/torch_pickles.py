"""Pickles of PyTorch, read without running any code.

An unpickler can run any code, and can fill the memory when it reads a small
pickle. This reader executes the instructions of a pickle itself: each
instruction makes at most one small object, and nothing is called.
"""

import pickletools
from typing import Any, NamedTuple

# Greatest number of instructions of a pickle; a tensor takes some thirty.
_MOST_STEPS = 200_000
# Greatest number of axes of a tensor.
_MOST_AXES = 16
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


class _TensorStorage(NamedTuple):
    """Stored values of tensors: their type, and their file in the archive."""

    kind: str
    key: str


class StoredTensor(NamedTuple):
    """A tensor: a view of stored values; offset and steps count values."""

    storage: _TensorStorage
    offset: int
    shape: tuple[int, ...]
    steps: tuple[int, ...]


# Stands for any object that is neither a container nor a tensor.
_OPAQUE = object()


def unpickle_tensors(pickle: bytes) -> Any:
    """Returns the object that a pickle contains.

    Each tensor is a `StoredTensor`; no object of another class is made.

    Raises:
        ValueError: the pickle is damaged, or has too many instructions.
    """
    machine = _PickleMachine()
    for number, (code, argument, _) in enumerate(pickletools.genops(pickle)):
        if number == _MOST_STEPS:
            raise ValueError(f"a pickle of more than {_MOST_STEPS} steps")
        if code.name == "STOP":
            return machine.stack.pop()
        machine.execute(code.name, argument)
    raise ValueError("a pickle without an end")


class _PickleMachine:
    """The stack and the memory of a pickle."""

    def __init__(self) -> None:
        self.stack: list[Any] = []
        self._marks: list[list[Any]] = []
        self._memory: dict[int, Any] = {}

    def execute(self, code: str, argument: Any) -> None:
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
            self._set_items(items)
        elif code == "SETITEM":
            self._set_items(self._pop(2))
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
            stack.append(_storage_of(place))
        elif code == "REDUCE":
            function, arguments = self._pop(2)
            stack.append(_call_result(function, arguments))
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

    def _set_items(self, items: list | tuple) -> None:
        if isinstance(self.stack[-1], dict):
            for key, value in zip(items[::2], items[1::2], strict=True):
                # Names of tensors are texts; other keys may not be hashable.
                if isinstance(key, str):
                    self.stack[-1][key] = value


def _storage_of(place: Any) -> Any:
    """Returns the storage of a persistent id, as `torch.save` writes it."""
    match place:
        case ("storage", _Name("torch", kind), str(key), *_):
            return _TensorStorage(kind, key)
    return _OPAQUE


def _call_result(function: Any, arguments: Any) -> Any:
    """Returns what a call in a pickle makes, if it is a dict or a tensor."""
    match function, arguments:
        case _Name("collections", "OrderedDict"), ():
            return {}
        case _Name("torch._utils", name), (_TensorStorage(), int(), *_) if (
            name
            in (
                "_rebuild_tensor_v2",
                "_rebuild_tensor",
            )
        ):
            storage, offset, shape, steps = arguments[:4]
            if _are_sizes(shape) and _are_sizes(steps):
                return StoredTensor(storage, offset, shape, steps)
        case _Name("torch._utils", name), (StoredTensor() as tensor, *_) if (
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
