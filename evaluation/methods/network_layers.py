"""Layers of neural networks, for inference, with weights by their names."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import erf

from cns_drake.base import InputError

# Name of a parameter, such as `layer.weight` -> its values.
Weights = Mapping[str, np.ndarray]
# Least value before a power, as in the published programs.
_TINY = 1e-6
# Added to distances before a division, as in the published programs.
_LEAST_DISTANCE = 1e-8


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


def relu(x: np.ndarray) -> np.ndarray:
    """Returns the rectified values (ReLU)."""
    return np.maximum(x, 0.0)


def gelu(x: np.ndarray) -> np.ndarray:
    """Returns values weighted by the normal distribution (GELU)."""
    return 0.5 * x * (1.0 + erf(x / np.sqrt(x.dtype.type(2.0))))


def batch_norm(
    weights: Weights, name: str, x: np.ndarray, epsilon: float = 1e-5
) -> np.ndarray:
    """Returns features normalised by the statistics of the training.

    Args:
        weights: weights of the network.
        name: name of the layer.
        x: (..., channels) features.
        epsilon: number that is added to variances.
    """
    mean, variance = (weights[f"{name}.running_{s}"] for s in ("mean", "var"))
    scale = weights[f"{name}.weight"] / np.sqrt(variance + epsilon)
    return (x - mean) * scale + weights[f"{name}.bias"]


def layer_norm(
    weights: Weights, name: str, x: np.ndarray, epsilon: float = 1e-5
) -> np.ndarray:
    """Returns features normalised over the channels of each item.

    Args:
        weights: weights of the network.
        name: name of the layer.
        x: (..., channels) features.
        epsilon: number that is added to variances.
    """
    x = x - x.mean(axis=-1, keepdims=True)
    x = x / np.sqrt((x * x).mean(axis=-1, keepdims=True) + epsilon)
    return x * weights[f"{name}.weight"] + weights[f"{name}.bias"]


def linear(weights: Weights, name: str, x: np.ndarray) -> np.ndarray:
    """Returns the result of a linear layer, or a convolution of kernel 1.

    Args:
        weights: weights of the network; the layer may have no bias.
        name: name of the layer.
        x: (..., channels) features.
    """
    kernel = weights[f"{name}.weight"]
    bias = weights.get(f"{name}.bias", 0.0)
    return x @ kernel.reshape(kernel.shape[:2]).T + bias


def generalised_mean(x: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Returns the generalised mean (channels,) of rows (GeM, 2018)."""
    return (np.maximum(x, _TINY) ** p).mean(axis=0) ** (1.0 / p)


def nearest_three(
    known: np.ndarray, wanted: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Returns indices and weights (M, 3) of the three nearest neighbours.

    With fewer known points, there are fewer columns.

    Args:
        known: (N, 3) points among which neighbours are sought.
        wanted: (M, 3) points whose neighbours are sought.
    """
    distances, found = cKDTree(known).query(wanted, min(3, len(known)))
    distances, found = (
        one.reshape(len(wanted), -1) for one in (distances, found)
    )
    inverse = (1.0 / (distances + _LEAST_DISTANCE)).astype(np.float32)
    return found, inverse / inverse.sum(axis=1, keepdims=True)


def interpolated(
    known: np.ndarray, wanted: np.ndarray, features: np.ndarray
) -> np.ndarray:
    """Returns features interpolated from the three nearest points, (M, C).

    Args:
        known: (N, 3) points with known features.
        wanted: (M, 3) points whose features are sought.
        features: (N, C) the known features.
    """
    found, shares = nearest_three(known, wanted)
    return np.einsum("mk,mkc->mc", shares, features[found])


def batch_norm_shapes(names: str, channels: int) -> dict[str, tuple[int, ...]]:
    """Returns the shapes of the weights of batch normalisations, by name.

    `names` are the names of the layers, separated by spaces.
    """
    return {
        f"{name}.{part}": (channels,)
        for name in names.split()
        for part in ("weight", "bias", "running_mean", "running_var")
    }
