"""Weights of neural networks, by their names: what each network checks."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from evaluation.base import InputError

# Name of a parameter, such as `layer.weight` -> its values.
Weights = Mapping[str, np.ndarray]


def checked_weights(
    found: Weights, shapes: Mapping[str, tuple[int, ...]], path: Path
) -> dict[str, np.ndarray]:
    """Returns the weights of a network as float32.

    Args:
        found: name -> array in the file; other names are left out.
        shapes: name -> shape of each array of the network.
        path: the file, for error messages.

    Raises:
        InputError: an array is missing, has another shape, or not only finite
            floating-point numbers.
    """
    weights = {}
    for name, shape in shapes.items():
        if name not in found:
            raise InputError(f"{path}: {name} is missing")
        values = found[name]
        if values.shape != shape:
            raise InputError(
                f"{path}: {name}: size {values.shape} instead of {shape}"
            )
        if values.dtype.kind == "f":
            # Numbers of double precision may be too large for single.
            with np.errstate(over="ignore"):
                weights[name] = values.astype(np.float32)
        if name not in weights or not np.isfinite(weights[name]).all():
            raise InputError(f"{path}: {name}: not all are finite numbers")
    return weights
