"""Trains the network by gradient descent; can continue a training."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from cns_drake.training.batches import BatchSampler, TrainingScans
from cns_drake.training.network import (
    Parameters,
    features,
    import_jax,
    scores,
    start_parameters,
)
from evaluation.base import InputError, Part, track
from evaluation.methods import WEIGHTS_VERSION

# Divides the similarities before the softmax of the loss.
_TEMPERATURE = 0.05
# Rate of learning after the warm-up.
_RATE = 2e-3
# Rate of learning in the end.
_LEAST_RATE = 2e-5
# Number of steps of the warm-up.
_WARM_UP = 30
# Decay of the running means of gradients, and of squared gradients.
_DECAYS = (0.9, 0.99)
# Longer gradients are shortened to this length.
_LONGEST_GRADIENT = 1.0
# Number of steps after which the state of the training is saved.
_KEPT_EVERY = 50


def train(
    scans: TrainingScans,
    steps: int,
    seed: int,
    state: Path,
    digest: str = "",
    on_step: Callable[[int, Parameters], None] = lambda step, values: None,
) -> tuple[Parameters, np.ndarray]:
    """Trains the network of the method `learned`; can continue a training.

    Args:
        scans: images of the scans, and which scans show the same place.
        steps: number of batches.
        seed: seed of all random numbers.
        state: file with the state of the training. If the file exists, the
            training continues from this state.
        digest: digest of the scans.
        on_step: is called with the number of each step and the weights.

    Returns:
        The weights; and (steps, 2), for each step the loss and the share of
        queries whose top-ranked place is right.

    Raises:
        InputError: no city has two drives that meet, the state is damaged or
            belongs to a training with other arguments, or JAX is not installed.
    """
    import_jax()
    update = _compiled_update(steps)
    sampler = BatchSampler(scans, seed)
    made_of = {
        "training": [WEIGHTS_VERSION, digest, len(scans.xy), steps, seed]
    }
    kept = Part(state)
    start = start_parameters(seed)
    zero = {name: np.zeros_like(one) for name, one in start.items()}
    moments = (start, zero, zero)
    curve = []
    if state.exists():
        if not kept.is_current(made_of):
            raise InputError(
                f"{state}: damaged, or the state of another training; delete it"
            )
        moments, curve = kept.read()
    begin = len(curve)
    for step in track(range(begin, steps), "training", steps - begin, "steps"):
        batch = sampler.batch(step)
        *new, value, right = update(
            *moments,
            np.float32(step),
            batch.images,
            batch.weights,
            batch.counts,
        )
        moments = tuple(new)
        curve.append((float(value), float(right)))
        if (step + 1) % _KEPT_EVERY == 0 or step + 1 == steps:
            known = [{k: np.asarray(v) for k, v in one.items()} for one in new]
            kept.write(made_of, (tuple(known), curve))
            on_step(step + 1, moments[0])
    values = {name: np.asarray(one) for name, one in moments[0].items()}
    return values, np.array(curve)


def _compiled_update(steps: int) -> Callable[..., Any]:
    """Returns the function that takes one step of a training.

    Args:
        steps: number of steps of the training, after which the rate of learning
            is least.
    """
    import jax
    import jax.numpy as jnp

    def loss(values: Parameters, images: Any, weights: Any, counts: Any) -> Any:
        maps = features(values, images)
        found = scores(maps[: len(weights)], maps[len(weights) :])
        logits = jnp.where(counts, found / _TEMPERATURE, -1e9)
        cross = -(weights * jax.nn.log_softmax(logits, axis=1)).sum(axis=1)
        best = jnp.take_along_axis(
            weights, logits.argmax(axis=1)[:, None], axis=1
        )
        return cross.mean(), (best > 0.0).mean()

    @jax.jit
    def update(
        values: Parameters,
        first: Parameters,
        second: Parameters,
        step: Any,
        images: Any,
        weights: Any,
        counts: Any,
    ) -> Any:
        """Takes one step of Adam; compiled by JAX.

        Args:
            values: weights of the network.
            first: running means of the gradients.
            second: running means of the squared gradients.
            step: number of the step, from 0.
            images, weights, counts: fields of a `Batch`: its polar images, the
                weights of the right places, and which places take part in the
                softmax.

        Returns:
            The new `values`, `first` and `second`; the loss of the batch before
            the step; and the share of its queries whose top-ranked place was
            right.
        """
        (value, right), slope = jax.value_and_grad(loss, has_aux=True)(
            values, images, weights, counts
        )
        length = jnp.sqrt(sum((one**2).sum() for one in slope.values()))
        slope = {
            name: one * jnp.minimum(1.0, _LONGEST_GRADIENT / (length + 1e-9))
            for name, one in slope.items()
        }
        # Adam (Kingma and Ba, ICLR 2015); the rate falls like a cosine.
        progress = (step + 1.0) / steps
        rate = _LEAST_RATE + 0.5 * (_RATE - _LEAST_RATE) * (
            1.0 + jnp.cos(jnp.pi * progress)
        )
        rate *= jnp.minimum(1.0, (step + 1.0) / _WARM_UP)
        one, two = _DECAYS
        first = {k: one * first[k] + (1 - one) * v for k, v in slope.items()}
        second = {
            k: two * second[k] + (1 - two) * v**2 for k, v in slope.items()
        }
        values = {
            k: v
            - rate
            * (first[k] / (1 - one ** (step + 1.0)))
            / (jnp.sqrt(second[k] / (1 - two ** (step + 1.0))) + 1e-8)
            for k, v in values.items()
        }
        return values, first, second, value, right

    return update
