"""Scan Context Image (Kim, Park, Kim: RA-L 2019): a classifier of places.

The network is trained when the database is built, on the places of the database
alone: consecutive places are a class, and the middle one stands for it. It is
smaller than the authors' network: an eighth of the channels, and heights
instead of their colours. It needs the extra `train`.
"""

import hashlib
from pathlib import Path
import tempfile

import jax
import jax.numpy as jnp
import numpy as np

from evaluation.methods import Method, MethodConfig, register

RINGS = 40
SECTORS = 120
REACH = 80.0  # Range of the outermost ring [m].
HIGHEST = 15.0  # The authors colour heights from 0 to 15 m.
CHANNELS = 1, 8, 16, 32  # The authors have 3, 64, 128 and 256.
HIDDEN = 64
DROPPED = 0.5  # The authors drop 0.7.
BATCH = 32  # The authors have 64.
RATE = 1e-3


class ScanContextImageConfig(MethodConfig):
    """Settings of the classifier.

    Attributes:
        places_per_class: number of consecutive places in a class; with a place
            each metre, ten are the authors' cells of 10 m.
        epochs: passes over all images; the authors have 200, with more images.
        upside_down: whether the LiDAR hangs with its z axis down.
        seed: seed of the network's first weights and of the training.
    """

    places_per_class: int = 10
    epochs: int = 40
    upside_down: bool = False
    seed: int = 0


@register("scan-context-image")
class ScanContextImage(Method):
    """A softmax over the places of one drive; the score is a probability."""

    Config = ScanContextImageConfig
    skips_places = True

    def describe(self, points):
        x, y, z = points.T
        if self.config.upside_down:
            y, z = -y, -z
        ring = (np.hypot(x, y) * (RINGS / REACH)).astype(int)
        sector = np.arctan2(y, x) * (SECTORS / (2.0 * np.pi))
        sector = np.floor(sector).astype(int) % SECTORS
        height = np.clip((z + self.config.sensor_height) / HIGHEST, 0.0, 1.0)
        near = ring < RINGS
        image = np.zeros((RINGS, SECTORS), np.float32)
        np.maximum.at(image, (ring[near], sector[near]), height[near])
        return image

    def build_database(self, places):
        images = np.stack(places)
        step = self.config.places_per_class
        labels = np.arange(len(images)) // step
        middles = np.arange(step // 2, len(images), step)
        # Only whole classes have a middle.
        kept = labels < len(middles)
        network = trained(images[kept], labels[kept], self.config)
        return network, middles, len(images)

    def score(self, query, database, *, exhaustive=False):
        network, middles, number = database
        found = jax.nn.softmax(answers(network, query[None, ..., None])[0])
        scores = np.full(number, np.nan)
        scores[middles] = found
        return scores


def first_weights(classes, rng):
    """Returns a network with random weights, after He et al. (2015)."""
    network = {}
    for k in range(3):
        shape = 5, 5, CHANNELS[k], CHANNELS[k + 1]
        deviation = np.sqrt(2.0 / (25 * CHANNELS[k]))
        network[f"filters_{k}"] = rng.normal(0.0, deviation, shape)
        network[f"bias_{k}"] = np.zeros(CHANNELS[k + 1])
        # Batch normalisation follows the first and the second pooling.
        network[f"scale_{k}"] = np.ones(CHANNELS[k + 1])
        network[f"shift_{k}"] = np.zeros(CHANNELS[k + 1])
        network[f"mean_{k}"] = np.zeros(CHANNELS[k + 1])
        network[f"variance_{k}"] = np.ones(CHANNELS[k + 1])
    size = RINGS // 8 * (SECTORS // 8) * CHANNELS[3]
    for name, shape in (("a", (size, HIDDEN)), ("b", (HIDDEN, classes))):
        network[f"matrix_{name}"] = rng.normal(0.0, shape[0] ** -0.5, shape)
        network[f"offset_{name}"] = np.zeros(shape[1])
    return {k: jnp.asarray(v, jnp.float32) for k, v in network.items()}


def answers(network, images, key=None):
    """Returns logits (N, C); with a key, as in training, with batch moments.

    In training the result is a pair: logits, and moments by name.
    """
    moments = {}
    x = images
    for k in range(3):
        x = jax.lax.conv_general_dilated(
            x,
            network[f"filters_{k}"],
            (1, 1),
            "SAME",
            dimension_numbers=("NHWC", "HWIO", "NHWC"),
        )
        x = jax.nn.relu(x + network[f"bias_{k}"])
        n, rows, columns, channels = x.shape
        x = x.reshape(n, rows // 2, 2, columns // 2, 2, channels)
        x = x.max(axis=(2, 4))
        if k < 2:
            mean, variance = network[f"mean_{k}"], network[f"variance_{k}"]
            if key is not None:
                mean, variance = x.mean((0, 1, 2)), x.var((0, 1, 2))
                moments[f"mean_{k}"] = mean
                moments[f"variance_{k}"] = variance
            x = (x - mean) / jnp.sqrt(variance + 1e-3)
            x = x * network[f"scale_{k}"] + network[f"shift_{k}"]
    x = x.reshape(len(x), -1)
    for number, name in enumerate("ab"):
        if key is not None:
            own = jax.random.fold_in(key, number)
            is_kept = jax.random.bernoulli(own, 1.0 - DROPPED, x.shape)
            x = jnp.where(is_kept, x / (1.0 - DROPPED), 0.0)
        x = x @ network[f"matrix_{name}"] + network[f"offset_{name}"]
    return x if key is None else (x, moments)


@jax.jit
def _step(network, first, second, count, images, labels, key):
    """Returns network and moments of Adam after a batch."""

    def loss(network):
        logits, moments = answers(network, images, key)
        chosen = jax.nn.log_softmax(logits)[jnp.arange(len(labels)), labels]
        return -chosen.mean(), moments

    slopes, moments = jax.grad(loss, has_aux=True)(network)
    first = {k: 0.9 * first[k] + 0.1 * v for k, v in slopes.items()}
    second = {k: 0.999 * second[k] + 0.001 * v**2 for k, v in slopes.items()}
    network = {
        k: v
        - RATE
        * (first[k] / (1.0 - 0.9**count))
        / (jnp.sqrt(second[k] / (1.0 - 0.999**count)) + 1e-7)
        for k, v in network.items()
    }
    for name, value in moments.items():
        network[name] = 0.9 * network[name] + 0.1 * value
    return network, first, second


def trained(images, labels, config):
    """Returns a network for the labels (N,) of images (N, RINGS, SECTORS).

    Each image is also learned as seen in the opposite direction, as by the
    authors. A study builds the same database for each condition, so the network
    is kept among the temporary files, under a digest of all that made it.
    """
    settings = repr(
        (config.epochs, config.seed, labels.tolist(), jax.__version__)
    )
    digest = hashlib.sha256(settings.encode() + images.tobytes()).hexdigest()
    kept = Path(tempfile.gettempdir()) / f"scan_context_image_{digest}.npz"
    if kept.is_file():
        with np.load(kept) as file:
            return {name: jnp.asarray(file[name]) for name in file.files}
    images = np.concatenate([images, np.roll(images, SECTORS // 2, axis=2)])
    labels = np.concatenate([labels, labels])
    rng = np.random.default_rng(config.seed)
    network = first_weights(int(labels.max()) + 1, rng)
    first = {k: jnp.zeros_like(v) for k, v in network.items()}
    second = first
    key = jax.random.key(config.seed)
    size = min(BATCH, len(labels))
    count = 0
    for _ in range(config.epochs):
        order = rng.permutation(len(labels))
        for start in range(0, len(order) - size + 1, size):
            rows = order[start : start + size]
            count += 1
            network, first, second = _step(
                network,
                first,
                second,
                float(count),
                images[rows][..., None],
                labels[rows],
                jax.random.fold_in(key, count),
            )
    part = kept.with_suffix(f".{config.seed}.part.npz")
    np.savez(part, **{k: np.asarray(v) for k, v in network.items()})
    part.replace(kept)
    return network
