"""The network of the method `learned` in JAX, for training."""

from typing import Any

import numpy as np

from evaluation.base import InputError
from evaluation.methods import FEATURES, FREQUENCIES, HEADINGS, LAYERS, TURNS

# Name -> weights of the network.
Parameters = dict[str, Any]


def import_jax() -> None:
    """Imports JAX, an optional dependency.

    Raises:
        InputError: it is not installed.
    """
    try:
        import jax  # noqa: F401
    except ImportError as error:
        raise InputError(
            "train: it needs JAX: pip install 'cns-drake[train]'"
        ) from error


def start_parameters(seed: int) -> Parameters:
    """Returns random weights of the network, with which training starts.

    Their variance follows He et al., ICCV 2015.
    """
    rng = np.random.default_rng([seed, 0xC0DE])
    found: Parameters = {}
    for number, (before, after, _, _) in enumerate(LAYERS):
        scale = (2.0 / (9 * before)) ** 0.5
        kernel = scale * rng.standard_normal((9 * before, after))
        found[f"kernel_{number}"] = kernel.astype(np.float32)
        found[f"bias_{number}"] = np.zeros(after, np.float32)
    return found


def features(parameters: Parameters, images: Any) -> Any:
    """Returns the network's feature maps of images, as a JAX array.

    Args:
        parameters: weights of the network.
        images: (N, RINGS, SECTORS, CHANNELS) polar images.

    Returns:
        (N, TURNS, FEATURES), of unit length for each image.
    """
    import jax
    from jax import lax
    import jax.numpy as jnp

    cells = images.astype(jnp.float32) / 255.0
    for number, (before, after, down, along) in enumerate(LAYERS):
        cells = jnp.concatenate(
            [cells[:, :, -1:], cells, cells[:, :, :1]], axis=2
        )
        cells = jnp.pad(cells, ((0, 0), (1, 1), (0, 0), (0, 0)))
        cells = lax.conv_general_dilated(
            cells,
            parameters[f"kernel_{number}"].reshape(3, 3, before, after),
            (down, along),
            "VALID",
            dimension_numbers=("NHWC", "HWIO", "NHWC"),
        )
        cells += parameters[f"bias_{number}"]
        if number < len(LAYERS) - 1:
            cells = jax.nn.relu(cells)
    maps = cells.transpose(0, 2, 1, 3).reshape(len(images), TURNS, FEATURES)
    length = jnp.sqrt((maps**2).sum(axis=(1, 2), keepdims=True) + 1e-12)
    return maps / length


def scores(queries: Any, places: Any) -> Any:
    """Returns the similarity of Q queries and P places, (Q, P), as a JAX array.

    The similarity is the correlation of two feature maps at the best heading.

    Args:
        queries: (Q, TURNS, FEATURES) feature maps, see `features`.
        places: (P, TURNS, FEATURES) feature maps.
    """
    import jax.numpy as jnp

    own, others = (
        jnp.fft.rfft(maps, axis=1)[:, :FREQUENCIES]
        for maps in (queries, places)
    )
    products = jnp.einsum("qfc,pfc->qpf", jnp.conj(own), others)
    turned = jnp.fft.irfft(products * (HEADINGS / TURNS), n=HEADINGS, axis=2)
    return turned.max(axis=2)
