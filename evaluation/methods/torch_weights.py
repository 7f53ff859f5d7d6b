"""Weights that PyTorch has saved, read without PyTorch.

A file of `torch.save` is an archive with a pickle and the numbers of each
tensor. Unpickling can run any code; this reader recognises tensors only, and
replaces everything else with inert objects.
"""

from collections import OrderedDict
from collections.abc import Mapping
import io
from pathlib import Path
import pickle
from typing import Any
import zipfile

import numpy as np

from cns_drake.base.errors import InputError
from cns_drake.base.files import read_bytes

# Greatest size of a file, and of its unpacked content [bytes].
MOST_BYTES = 200_000_000
_TYPES = {"FloatStorage": np.float32, "LongStorage": np.int64}


class _Unknown:
    """Stands for any object in a file that is no tensor."""

    def __init__(self, *arguments: Any, **options: Any):
        del arguments, options


class _Unpickler(pickle.Unpickler):
    def __init__(self, archive: zipfile.ZipFile):
        (name,) = (n for n in archive.namelist() if n.endswith("/data.pkl"))
        super().__init__(io.BytesIO(archive.read(name)))
        self._archive, self._folder = archive, name.removesuffix("data.pkl")

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) == ("collections", "OrderedDict"):
            return OrderedDict
        if (module, name) == ("torch._utils", "_rebuild_tensor_v2"):
            return _tensor
        return _TYPES.get(name, _Unknown) if module == "torch" else _Unknown

    def persistent_load(self, pid: Any) -> np.ndarray:
        content = self._archive.read(f"{self._folder}data/{pid[2]}")
        return np.frombuffer(content, pid[1])


def _tensor(
    storage: np.ndarray, offset: int, shape: tuple, steps: tuple, *_: Any
) -> np.ndarray:
    # NumPy refuses a view that would reach outside of the storage.
    size = storage.itemsize
    strides = [size * step for step in steps]
    return np.ndarray(shape, storage.dtype, storage, size * offset, strides)


def read_weights(
    path: Path, shapes: Mapping[str, tuple[int, ...]]
) -> dict[str, np.ndarray]:
    """Returns name -> tensor (float32) of a network's weights.

    Args:
        path: file that `torch.save` wrote (PyTorch 1.6 or later), with a state
            dict or a dict that contains one.
        shapes: name -> shape of the wanted tensors.

    Raises:
        InputError: the file cannot be read, or a tensor is missing, of another
            shape or not finite.
    """
    content = read_bytes(path, MOST_BYTES)
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            if sum(one.file_size for one in archive.infolist()) > MOST_BYTES:
                raise ValueError(f"unpacks to more than {MOST_BYTES} bytes")
            found = _Unpickler(archive).load()
    # A damaged pickle can raise any error.
    except Exception as error:
        raise InputError(
            f"{path}: no weights of PyTorch ({type(error).__name__}: {error})"
        ) from error
    nested = [found, *(found.values() if isinstance(found, dict) else ())]
    state: dict[str, Any] = max(
        (one for one in nested if isinstance(one, dict)),
        key=lambda one: len(shapes.keys() & one),
        default={},
    )
    for name, shape in shapes.items():
        tensor = state.get(name)
        if not isinstance(tensor, np.ndarray):
            raise InputError(f"{path}: {name}: no such tensor")
        if tensor.shape != shape:
            raise InputError(
                f"{path}: {name}: shape {tensor.shape} instead of {shape}"
            )
        if tensor.dtype != np.float32 or not np.isfinite(tensor).all():
            raise InputError(f"{path}: {name}: not all are finite numbers")
    return {name: np.array(state[name]) for name in shapes}
