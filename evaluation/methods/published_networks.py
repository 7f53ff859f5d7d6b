"""Networks with the weights that their authors published, as methods.

The descriptor of a network is a vector; the distance of two descriptors is the
dissimilarity of two places. No weights are shipped.

The page `docs/notes/published_networks.md` shows how to convert the authors'
weights to an .npz file. PyTorch's own files are not read, because they contain
pickles, which can run code.
"""

import abc
from collections.abc import Mapping, Sequence
import hashlib
from pathlib import Path
from typing import ClassVar

import numpy as np
from pydantic import computed_field

from cns_drake.base import InputError, read_bytes, read_npz
from evaluation.methods.method import Method, MethodConfig
from evaluation.methods.network_layers import Weights, checked_weights
from evaluation.methods.pointnetvlad_clouds import prepare_cloud

# Greatest size of a file of weights, and of its arrays together [bytes].
_MOST_BYTES = 200_000_000
_ADVICE = (
    "no .npz file of this network's weights; the page"
    " docs/notes/published_networks.md shows how to make one"
)


class NetworkConfig(MethodConfig):
    """Settings of a published neural network.

    `sensor_height` has no effect.

    Attributes:
        weights: .npz file with the weights that the authors of the network
            published: the arrays of the state dict, by their names.
    """

    weights: Path

    @computed_field  # type: ignore[prop-decorator]
    @property
    def digest(self) -> str:
        """Digest of the contents of the file `weights`: 16 hexadecimal digits.

        Two files with the same name can contain different weights; their
        digests differ.
        """
        content = read_bytes(self.weights, _MOST_BYTES)
        return hashlib.sha256(content).hexdigest()[:16]


class Network(Method[np.ndarray, np.ndarray]):
    """A published network as a place-recognition method.

    Scores are negative distances between descriptors.

    Attributes:
        shapes: name -> shape of each array of the file of weights.
    """

    Config = NetworkConfig
    skips_places = True
    config: NetworkConfig
    shapes: ClassVar[Mapping[str, tuple[int, ...]]]

    def __init__(self, config: NetworkConfig | None = None):
        super().__init__(config)
        self._weights = _read_weights(self.config.weights, self.shapes)

    def build_database(self, places: Sequence[np.ndarray]) -> np.ndarray:
        return np.stack(places)

    def score(
        self,
        query: np.ndarray,
        database: np.ndarray,
        *,
        exhaustive: bool = False,
    ) -> np.ndarray:
        del exhaustive  # Always true here.
        distances = np.linalg.norm(database - query, axis=1)
        return -distances.astype(np.float64)


class CloudNetwork(Network):
    """A network on the points of a cloud, trained on PointNetVLAD's data.

    The descriptor (256,) of a cloud without points is NaN.
    """

    def describe(self, points: np.ndarray) -> np.ndarray:
        cloud = prepare_cloud(points)
        if len(cloud) == 0:
            return np.full(256, np.nan)
        return self.infer(self._weights, cloud).astype(np.float64)

    @staticmethod
    @abc.abstractmethod
    def infer(weights: Weights, cloud: np.ndarray) -> np.ndarray:
        """Returns the descriptor (256,) of a cloud from `prepare_cloud`."""


def _read_weights(
    path: Path, shapes: Mapping[str, tuple[int, ...]]
) -> dict[str, np.ndarray]:
    """Returns the weights (float32) of a network, by name.

    Args:
        path: the .npz file.
        shapes: name -> shape of each array.

    Raises:
        InputError: the file cannot be read, or an array is missing, of another
            shape or not finite.
    """
    try:
        found = read_npz(path, shapes, _MOST_BYTES)
    except ValueError as error:
        raise InputError(f"{path}: {_ADVICE} ({error})") from error
    if not found:
        raise InputError(
            f"{path}: {_ADVICE} (no array {next(iter(shapes))}, with just this"
            " name and no prefix, such as module.)"
        )
    return checked_weights(found, shapes, path)
