"""Any network of PyTorch as a method of place recognition.

`torch.jit.script(network).save("mine.pt")` writes the network to a file; its
input is a batch of clouds (1, 4096, 3), its output a descriptor (1, D).

    cns-eval pr DATABASE QUERY --method network.py --set model=mine.pt

For other files or inputs change `load`, which alone knows PyTorch.
"""

from pathlib import Path

import numpy as np

from evaluation.methods import Method, MethodConfig, register

POINTS = 4096
REACH = 50.0  # Greatest distance of a point that the network sees [m].


def load(path):
    """Returns a function: cloud (4096, 3) float32 -> descriptor (D,)."""
    import torch

    network = torch.jit.load(path, map_location="cpu").eval()

    def describe(cloud):
        with torch.inference_mode():
            return network(torch.from_numpy(cloud)[None])[0].numpy()

    return describe


class NetworkConfig(MethodConfig):
    model: Path


@register("network")
class Network(Method):
    """The nearer the descriptors, the more alike the places."""

    Config = NetworkConfig

    def __init__(self, config=None, network=None):
        super().__init__(config)
        self.network = network or load(self.config.model)

    def describe(self, points):
        near = points[np.linalg.norm(points, axis=1) < REACH]
        near = near if len(near) else np.zeros((1, 3))
        rng = np.random.default_rng(0)
        chosen = rng.choice(len(near), POINTS, replace=len(near) < POINTS)
        return self.network((near[chosen] / REACH).astype(np.float32))

    def build_database(self, places):
        return np.stack(places)

    def score(self, query, database, *, exhaustive=False):
        return -np.linalg.norm(database - query, axis=1)
