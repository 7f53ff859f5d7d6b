"""Networks with the weights that their authors published, as methods.

The descriptor of a network is a vector; the distance of two descriptors is the
dissimilarity of two places. No weights are shipped.
"""

import abc
from collections.abc import Mapping, Sequence
import hashlib
from pathlib import Path
from typing import ClassVar

import numpy as np
from pydantic import computed_field

from cns_drake.base.files import read_bytes
from evaluation.methods.method import Method, MethodConfig
from evaluation.methods.network_layers import Weights
from evaluation.methods.pointnetvlad_clouds import prepare_cloud
from evaluation.methods.torch_weights import MOST_BYTES, read_weights


class NetworkConfig(MethodConfig):
    """Settings of a published neural network.

    `sensor_height` has no effect.

    Attributes:
        weights: file with the weights that the authors of the network
            published.
    """

    weights: Path

    @computed_field  # type: ignore[prop-decorator]
    @property
    def digest(self) -> str:
        """Digest of the contents of the file `weights`: 16 hexadecimal digits.

        Two files with the same name can contain different weights; their
        digests differ.
        """
        content = read_bytes(self.weights, MOST_BYTES)
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
        self._weights = read_weights(self.config.weights, self.shapes)

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
