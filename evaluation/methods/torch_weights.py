"""Weights that PyTorch has saved, read without PyTorch.

A file of `torch.save` is an archive with a pickle and the numbers of each
tensor. The pickle is read by `evaluation.methods.torch_pickles`; numbers are
read only for the tensors that are wanted.
"""

from collections.abc import Iterator, Mapping
import io
from pathlib import Path
from typing import Any
import zipfile

import numpy as np

from cns_drake.base.errors import InputError, one_line
from cns_drake.base.files import read_bytes
from cns_drake.base.terminal import note
from evaluation.methods.torch_pickles import StoredTensor, unpickle_tensors

# Greatest size of a file, and of its unpacked content [bytes].
MOST_BYTES = 200_000_000
# How far dictionaries are searched for tensors.
_DEEPEST = 6
_BFLOAT16 = "bfloat16"
# PyTorch's name of the type of a storage -> NumPy's name.
_TYPES = {
    **{"FloatStorage": "f4", "DoubleStorage": "f8", "HalfStorage": "f2"},
    **{"LongStorage": "i8", "IntStorage": "i4", "ShortStorage": "i2"},
    **{"CharStorage": "i1", "ByteStorage": "u1", "BoolStorage": "?"},
    "BFloat16Storage": _BFLOAT16,
}
# Files of `torch.save` before PyTorch 1.6 begin with this.
_LEGACY = b"\x80\x02\x8a\nl\xfc\x9cF\xf9 j\xa8P\x19."


def read_weights(
    path: Path, shapes: Mapping[str, tuple[int, ...]]
) -> dict[str, np.ndarray]:
    """Returns the tensors (float32) of a network's weights, by name.

    Numbers of other types are converted. The dictionary of tensors may lie
    inside other dictionaries, and all names in it may have the same prefix,
    such as `module.`, which `DataParallel` adds. If several dictionaries have
    the wanted names, the first dictionary is read, and a note on stderr names
    it.

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
            if (
                sum(entry.file_size for entry in archive.infolist())
                > MOST_BYTES
            ):
                raise ValueError(f"unpacks to more than {MOST_BYTES} bytes")
            names = archive.namelist()
            (name,) = (entry for entry in names if entry.endswith("/data.pkl"))
            if any("/code/" in entry for entry in names):
                raise ValueError("a program of TorchScript; save its state")
            state = _find_state(
                path, unpickle_tensors(archive.read(name)), shapes
            )
            return {
                name: _read_tensor(path, name, state.get(name), shape, archive)
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
    """Returns the wanted objects of the best dictionary of tensors, by name.

    Args:
        path: the file, for error messages.
        found: the object in the file.
        shapes: name of a wanted tensor -> its shape.
    """
    best: list[tuple[str, dict[str, Any]]] = [("", {})]
    for place, inner in _dictionaries(found, "", _DEEPEST, set()):
        # All wanted names may have the same prefix.
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
    """Yields a dictionary and each dictionary inside it once, with its keys.

    The keys that lead to a dictionary are appended to `place`, separated by
    dots.

    Args:
        value: any object of the file.
        place: the keys that lead to it.
        levels: number of levels below it that are searched.
        seen: ids of the objects that were searched, added to in place.
    """
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


def _read_tensor(
    path: Path,
    name: str,
    tensor: Any,
    shape: tuple[int, ...],
    archive: zipfile.ZipFile,
) -> np.ndarray:
    """Returns a tensor as float32.

    Args:
        path: the file, for error messages.
        name: name of the tensor.
        tensor: what the file has under this name.
        shape: the shape that the tensor must have.
        archive: the opened file, with the tensor's numbers.

    Raises:
        InputError: there is no such tensor, or it has another shape or type, or
            is not finite.
    """
    if not isinstance(tensor, StoredTensor):
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
        entry.removesuffix("data.pkl")
        for entry in archive.namelist()
        if entry.endswith("/data.pkl")
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
