"""SVT-Net and DPA-Net, with the weights that their authors published.

SVT-Net: Fan, Song, Liu, Lu, He, Du (AAAI 2022). DPA-Net: Park, Kim, Jeon, Kwon,
Lee, Lee (RA-L 2026). Both turn a cloud into a descriptor of 256 numbers; the
distance of two descriptors is the dissimilarity of two places. Neither
estimates a pose. The architectures are reimplemented from the papers and the
authors' programs; no weights are shipped.

Clouds are prepared as in PointNetVLAD's program (Uy and Lee, CVPR 2018), which
made the networks' training data. Points near the largest plane are removed. The
other points are downsampled to 4096 points, centred, and scaled so that the
mean distance from the centre is 1/2. Points outside of [-1, 1] are replaced by
other points. As in that program, x points backwards. Deliberate differences:

- A place is one scan of a spinning LiDAR, not 20 m of a planar scanner.
- Random draws have a fixed seed.
- A cloud with fewer than 4096 points repeats some points.
"""

import abc
import bisect
from collections.abc import Mapping, Sequence
import hashlib
from pathlib import Path
from typing import ClassVar

import numpy as np
from pydantic import computed_field
from scipy.spatial import cKDTree
from scipy.special import erf, expit, softmax

from cns_drake.base.files import read_bytes
from evaluation.maps.voxel_maps import thin
from evaluation.methods.method import Method, MethodConfig, register
from evaluation.methods.sparse_convolution import coarser, convolve
from evaluation.methods.torch_weights import MOST_BYTES, read_weights

Weights = Mapping[str, np.ndarray]

NUM_POINTS = 4096
# Side of a cell of the networks, in clouds from -1 to 1.
_CELL = 0.01
# Points this near to the greatest plane count as ground [m].
_GROUND_WITHIN = 0.5
# Number of planes that are tried.
_TRIALS = 200
# Number of points that vote for a plane.
_VOTERS = 2000
# Least side of the voxels for downsampling [m].
_LEAST_VOXEL = 0.001
# Difference between the sides that are tried [m].
_VOXEL_STEP = 0.025
# Number of sides that are tried.
_NUM_VOXELS = 400
# DPA-Net's attention: number of points.
_CENTRES = 1024
# Number of heads.
_HEADS = 8
# Number of samples per head.
_SAMPLES = 8
# Least mean distance of points from their centre [m].
_LEAST_EXTENT = 1e-3
_TINY = 1e-6


def prepare(points: np.ndarray) -> np.ndarray:
    """Returns a cloud in the form that PointNetVLAD's networks expect.

    Args:
        points: (N, 3) points, x ahead, y left, z up [m].

    Returns:
        (4096, 3) float32, or (0, 3) if there are no points above the ground,
        or all of them are at one place.
    """
    rng = np.random.default_rng(0)
    points = _without_ground(points, rng)
    if len(points) == 0:
        return np.zeros((0, 3), np.float32)
    size = bisect.bisect_left(
        range(_NUM_VOXELS),
        True,
        key=lambda k: (
            len(thin(points, _LEAST_VOXEL + _VOXEL_STEP * k)) <= NUM_POINTS
        ),
    )
    chosen = thin(points, _LEAST_VOXEL + _VOXEL_STEP * size)
    chosen = np.concatenate([chosen, _draw_missing(points, chosen, rng)])
    centre = chosen.mean(axis=0)
    extent = np.linalg.norm(chosen - centre, axis=1).mean()
    if extent < _LEAST_EXTENT:
        return np.zeros((0, 3), np.float32)
    points, chosen = (0.5 / extent * (one - centre) for one in (points, chosen))
    points, chosen = (
        one[(np.abs(one) <= 1.0).all(axis=1)] for one in (points, chosen)
    )
    # Chosen points are means, of which a voxel may have no point within.
    source = points if len(points) else chosen
    chosen = np.concatenate([chosen, _draw_missing(source, chosen, rng)])
    return (chosen * [-1.0, 1.0, 1.0]).astype(np.float32)


def _without_ground(points: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Returns the points that are not near the greatest plane (RANSAC)."""
    if len(points) < 3:
        return points[:0]
    a, b, c = points[rng.integers(len(points), size=(3, _TRIALS))]
    normals = np.cross(b - a, c - a)
    # Three points on a line, such as one drawn twice, are in no one plane.
    is_plane = np.linalg.norm(normals, axis=1) > _TINY
    normals, a = normals[is_plane], a[is_plane]
    if len(normals) == 0:
        return points
    normals /= np.linalg.norm(normals, axis=1, keepdims=True) + _TINY
    offsets = (normals * a).sum(axis=1)
    voters = points[rng.integers(len(points), size=_VOTERS)]
    votes = np.abs(voters @ normals.T - offsets) < _GROUND_WITHIN
    best = votes.sum(axis=0).argmax()
    return points[
        np.abs(points @ normals[best] - offsets[best]) >= _GROUND_WITHIN
    ]


def _draw_missing(
    points: np.ndarray, chosen: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """Returns random points, as many as `chosen` lacks to be complete."""
    lacking = NUM_POINTS - len(chosen)
    repeats = lacking > len(points)
    return points[rng.choice(len(points), lacking, replace=repeats)]


def _occupied(cloud: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the cells (N, 3) of a cloud, and their features (N, 1), all 1."""
    cells = np.floor(cloud / np.float32(_CELL)).astype(np.int64)
    cells = coarser(cells, 1)
    return cells, np.ones((len(cells), 1), np.float32)


def _relu(x: np.ndarray) -> np.ndarray:
    return np.maximum(x, 0.0)


def _gelu(x: np.ndarray) -> np.ndarray:
    return 0.5 * x * (1.0 + erf(x / np.sqrt(x.dtype.type(2.0))))


def _batch_norm(
    weights: Weights, name: str, x: np.ndarray, epsilon: float = 1e-5
) -> np.ndarray:
    mean, variance = (weights[f"{name}.running_{s}"] for s in ("mean", "var"))
    scale = weights[f"{name}.weight"] / np.sqrt(variance + epsilon)
    return (x - mean) * scale + weights[f"{name}.bias"]


def _layer_norm(
    weights: Weights, name: str, x: np.ndarray, epsilon: float = 1e-5
) -> np.ndarray:
    x = x - x.mean(axis=-1, keepdims=True)
    x = x / np.sqrt((x * x).mean(axis=-1, keepdims=True) + epsilon)
    return x * weights[f"{name}.weight"] + weights[f"{name}.bias"]


def _linear(weights: Weights, name: str, x: np.ndarray) -> np.ndarray:
    """A linear layer, or a convolution of kernel 1, with or without a bias."""
    kernel = weights[f"{name}.weight"]
    bias = weights.get(f"{name}.bias", 0.0)
    return x @ kernel.reshape(kernel.shape[:2]).T + bias


def _generalised_mean(x: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Returns the generalised mean (channels,) of rows (GeM, 2018)."""
    return (np.maximum(x, _TINY) ** p).mean(axis=0) ** (1.0 / p)


def _nearest_three(
    known: np.ndarray, wanted: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Returns indices and weights (M, 3) of the three nearest neighbours."""
    distances, found = cKDTree(known).query(wanted, min(3, len(known)))
    distances, found = (
        one.reshape(len(wanted), -1) for one in (distances, found)
    )
    inverse = (1.0 / (distances + 1e-8)).astype(np.float32)
    return found, inverse / inverse.sum(axis=1, keepdims=True)


def _interpolated(
    known: np.ndarray, wanted: np.ndarray, features: np.ndarray
) -> np.ndarray:
    found, shares = _nearest_three(known, wanted)
    return np.einsum("mk,mkc->mc", shares, features[found])


def _norm_shapes(names: str, channels: int) -> dict[str, tuple[int, ...]]:
    """Returns name -> shape of the weights of batch normalisations.

    `names` are the names of the layers, separated by spaces.
    """
    return {
        f"{name}.{part}": (channels,)
        for name in names.split()
        for part in ("weight", "bias", "running_mean", "running_var")
    }


_SVT_NET = {
    "backbone.conv0.kernel": (125, 1, 32),
    "backbone.convs.0.kernel": (8, 32, 32),
    "backbone.convs.1.kernel": (8, 32, 32),
    "backbone.blocks.0.0.conv1.kernel": (27, 32, 32),
    "backbone.blocks.0.0.conv2.kernel": (27, 32, 32),
    "backbone.blocks.1.0.conv1.kernel": (27, 32, 64),
    "backbone.blocks.1.0.conv2.kernel": (27, 64, 64),
    "backbone.blocks.1.0.downsample.0.kernel": (32, 64),
    "backbone.conv1x1.0.kernel": (64, 256),
    "backbone.att_sa.q_conv.kernel": (256, 32),
    "backbone.att_sa.k_conv.kernel": (256, 32),
    "backbone.att_sa.v_conv.kernel": (256, 256),
    "backbone.att_sa.trans_conv.kernel": (256, 256),
    "backbone.att_token.q_conv.kernel": (256, 256),
    "backbone.att_token.k_conv.kernel": (256, 8),
    "backbone.att_token.p_conv.kernel": (256, 256),
    "backbone.att_token.trans_conv.kernel": (256, 256),
    "backbone.att_token.convvalues.weight": (256, 256, 1),
    "backbone.att_token.convkeys.weight": (256, 256, 1),
    "backbone.att_token.convquries.weight": (256, 256, 1),
    "backbone.att_token.embedding1.weight": (256, 256, 1),
    "backbone.att_token.T_conv.weight": (256, 256, 1),
    "pooling.p": (1,),
    **_norm_shapes("backbone.bn0.bn backbone.bn.0.bn backbone.bn.1.bn", 32),
    **_norm_shapes(
        "backbone.blocks.0.0.norm1.bn backbone.blocks.0.0.norm2.bn", 32
    ),
    **_norm_shapes(
        "backbone.blocks.1.0.norm1.bn backbone.blocks.1.0.norm2.bn"
        " backbone.blocks.1.0.downsample.1.bn",
        64,
    ),
    **_norm_shapes(
        "backbone.att_sa.after_norm.bn backbone.att_token.after_norm.bn", 256
    ),
}


def svt_net(weights: Weights, cloud: np.ndarray) -> np.ndarray:
    """Returns SVT-Net's descriptor (256,) of a prepared cloud."""
    backbone = {
        name.removeprefix("backbone."): w for name, w in weights.items()
    }
    cells, x = _occupied(cloud)
    x = convolve(cells, x, backbone["conv0.kernel"])
    x = _relu(_batch_norm(backbone, "bn0.bn", x))
    for number, step in enumerate((1, 2)):
        at = coarser(cells, 2 * step)
        x = convolve(cells, x, backbone[f"convs.{number}.kernel"], step, at)
        x = _relu(_batch_norm(backbone, f"bn.{number}.bn", x))
        cells = at
        x = _residual_block(backbone, f"blocks.{number}.0", cells, x, 2 * step)
    x = x @ backbone["conv1x1.0.kernel"]
    x = _token_attention(backbone, x) + _cell_attention(backbone, x)
    return _generalised_mean(x, weights["pooling.p"])


def _residual_block(
    weights: Weights, name: str, cells: np.ndarray, x: np.ndarray, step: int
) -> np.ndarray:
    y = convolve(cells, x, weights[f"{name}.conv1.kernel"], step)
    y = _relu(_batch_norm(weights, f"{name}.norm1.bn", y))
    y = convolve(cells, y, weights[f"{name}.conv2.kernel"], step)
    y = _batch_norm(weights, f"{name}.norm2.bn", y)
    if f"{name}.downsample.0.kernel" in weights:
        x = x @ weights[f"{name}.downsample.0.kernel"]
        x = _batch_norm(weights, f"{name}.downsample.1.bn", x)
    return _relu(x + y)


def _cell_attention(weights: Weights, x: np.ndarray) -> np.ndarray:
    """The atom-based transformer: each cell attends to all."""
    q, k, v = (x @ weights[f"att_sa.{s}_conv.kernel"] for s in "qkv")
    y = softmax(q @ k.T, axis=1) @ v @ weights["att_sa.trans_conv.kernel"]
    return x + _relu(_batch_norm(weights, "att_sa.after_norm.bn", y))


def _token_attention(weights: Weights, x: np.ndarray) -> np.ndarray:
    """The cluster-based transformer: cells attend to eight tokens."""
    q, k, p = (x @ weights[f"att_token.{s}_conv.kernel"] for s in "qkp")
    tokens = softmax(k, axis=0).T @ q
    values, keys, queries = (
        _linear(weights, f"att_token.{s}", tokens)
        for s in ("convvalues", "convkeys", "convquries")
    )
    mixed = softmax(keys @ queries.T, axis=1) @ values
    tokens = tokens + _linear(weights, "att_token.embedding1", mixed)
    tokens = _linear(weights, "att_token.T_conv", tokens)
    y = softmax(p @ tokens.T, axis=1) @ tokens
    y = y @ weights["att_token.trans_conv.kernel"]
    return x + _relu(_batch_norm(weights, "att_token.after_norm.bn", y))


_DPA_NET = {
    "spconv0.conv.kernel": (125, 1, 32),
    "spconv1.conv.kernel": (125, 32, 32),
    "sample_inter0.get_interpolate.conv1x1.kernel": (32, 32),
    "sample_inter0.get_interpolate.ln.weight": (32,),
    "sample_inter0.get_interpolate.ln.bias": (32,),
    "dpa0.offset_scale": (),
    "dpa0.offset_net.0.weight": (32, 35),
    "dpa0.offset_net.0.bias": (32,),
    "dpa0.offset_net.1.weight": (32,),
    "dpa0.offset_net.1.bias": (32,),
    "dpa0.offset_net.4.weight": (16, 32),
    "dpa0.offset_net.4.bias": (16,),
    "dpa0.offset_net.6.weight": (3 * _HEADS * _SAMPLES, 16),
    "dpa0.offset_net.6.bias": (3 * _HEADS * _SAMPLES,),
    "dpa0.q_proj.weight": (32, 32),
    "dpa0.k_proj.weight": (32, 32),
    "dpa0.v_proj.weight": (32, 32),
    "dpa0.rel_pos_enc.0.weight": (8, 3),
    "dpa0.rel_pos_enc.0.bias": (8,),
    "dpa0.rel_pos_enc.1.weight": (8,),
    "dpa0.rel_pos_enc.1.bias": (8,),
    "dpa0.rel_pos_enc.3.weight": (1, 8),
    "dpa0.rel_pos_enc.3.bias": (1,),
    "dpa0.proj.weight": (32, 32),
    "dpa0.ffn.0.weight": (128, 32),
    "dpa0.ffn.0.bias": (128,),
    "dpa0.ffn.3.weight": (32, 128),
    "dpa0.ffn.3.bias": (32,),
    "dpa0.norm1.weight": (32,),
    "dpa0.norm1.bias": (32,),
    "dpa0.norm2.weight": (32,),
    "dpa0.norm2.bias": (32,),
    "FP_modules.0.mlp.layer0.conv.weight": (256, 35, 1, 1),
    "FP_modules.0.mlp.layer1.conv.weight": (256, 256, 1, 1),
    "Gem.weight.0.weight": (256, 256, 1),
    "Gem.weight.0.bias": (256,),
    "Gem.p": (1,),
    **_norm_shapes("spconv0.bn.bn spconv1.bn.bn", 32),
    **_norm_shapes(
        "FP_modules.0.mlp.layer0.bn.bn FP_modules.0.mlp.layer1.bn.bn", 256
    ),
}


def dpa_net(weights: Weights, cloud: np.ndarray) -> np.ndarray:
    """Returns DPA-Net's descriptor (256,) of a cloud from `prepare`."""
    cells, x = _occupied(cloud)
    for name in ("spconv0", "spconv1"):
        x = convolve(cells, x, weights[f"{name}.conv.kernel"])
        x = _relu(_batch_norm(weights, f"{name}.bn.bn", x, 1e-6))
    name = "sample_inter0.get_interpolate"
    x = x @ weights[f"{name}.conv1x1.kernel"]
    centres = cloud[farthest_points(cloud, _CENTRES)]
    # The authors' program uses the lower corner of a cell as its position.
    x = _interpolated(cells * _CELL, centres, x)
    x = _gelu(_layer_norm(weights, f"{name}.ln", x, 1e-6))
    x = _deformable_attention(weights, x, centres)
    x = np.concatenate([_interpolated(centres, cloud, x), cloud], axis=1)
    for number in range(2):
        name = f"FP_modules.0.mlp.layer{number}"
        x = _linear(weights, f"{name}.conv", x)
        x = _relu(_batch_norm(weights, f"{name}.bn.bn", x))
    x = x * expit(_linear(weights, "Gem.weight.0", x))
    return _generalised_mean(x, weights["Gem.p"])


def farthest_points(points: np.ndarray, number: int) -> np.ndarray:
    """Returns indices of points that are far apart from each other.

    This is farthest point sampling. The first index is 0. Each further index is
    that of the point that is farthest from all points chosen so far.

    Args:
        points: (N, 3) points [m].
        number: number of indices.
    """
    points = points.astype(np.float64)
    norms = (points * points).sum(axis=1)
    chosen = np.zeros(number, np.int64)
    squares = np.full(len(points), np.inf)
    for k in range(1, number):
        last = chosen[k - 1]
        found = norms + norms[last] - 2.0 * (points @ points[last])
        np.minimum(squares, found, out=squares)
        chosen[k] = squares.argmax()
    return chosen


def _deformable_attention(
    weights: Weights, x: np.ndarray, xyz: np.ndarray
) -> np.ndarray:
    """Attention of each point to samples at learned offsets from it."""
    y = np.concatenate([x, xyz], axis=1)
    y = _linear(weights, "dpa0.offset_net.0", y)
    y = _gelu(_layer_norm(weights, "dpa0.offset_net.1", y))
    y = _gelu(_linear(weights, "dpa0.offset_net.4", y))
    y = np.tanh(_linear(weights, "dpa0.offset_net.6", y))
    offsets = y.reshape(len(x), _HEADS, _SAMPLES, 3)
    offsets = offsets * np.abs(weights["dpa0.offset_scale"])
    q, k, v = (
        _linear(weights, f"dpa0.{s}_proj", x).reshape(len(x), _HEADS, -1)
        for s in "qkv"
    )
    samples = xyz[:, None, None] + offsets
    found, shares = _nearest_three(xyz, samples.reshape(-1, 3))
    found, shares = (
        one.reshape(*samples.shape[:3], -1) for one in (found, shares)
    )
    heads = np.arange(_HEADS)[:, None, None]
    k, v = (
        np.einsum("nhst,nhstd->nhsd", shares, one[found, heads])
        for one in (k, v)
    )
    logits = np.einsum("nhd,nhsd->nhs", q, k) / np.sqrt(
        q.dtype.type(q.shape[2])
    )
    y = _linear(weights, "dpa0.rel_pos_enc.0", -offsets)
    y = _gelu(_layer_norm(weights, "dpa0.rel_pos_enc.1", y))
    logits = logits + _linear(weights, "dpa0.rel_pos_enc.3", y)[..., 0]
    y = np.einsum("nhs,nhsd->nhd", softmax(logits, axis=2), v)
    y = _linear(weights, "dpa0.proj", y.reshape(len(x), -1))
    x = _layer_norm(weights, "dpa0.norm1", x + y)
    y = _linear(weights, "dpa0.ffn.3", _gelu(_linear(weights, "dpa0.ffn.0", x)))
    return _layer_norm(weights, "dpa0.norm2", x + y)


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


class _CloudNetwork(Network):
    """A network on the points of a cloud.

    The descriptor (256,) of a cloud without points is NaN.
    """

    def describe(self, points: np.ndarray) -> np.ndarray:
        cloud = prepare(points)
        if len(cloud) == 0:
            return np.full(256, np.nan)
        return self.infer(self._weights, cloud).astype(np.float64)

    @staticmethod
    @abc.abstractmethod
    def infer(weights: Weights, cloud: np.ndarray) -> np.ndarray:
        """Returns the descriptor (256,) of a cloud that `prepare` returned."""


@register("svt-net")
class SvtNet(_CloudNetwork):
    """The place-recognition method SVT-Net."""

    shapes = _SVT_NET
    infer = staticmethod(svt_net)


@register("dpa-net")
class DpaNet(_CloudNetwork):
    """The place-recognition method DPA-Net."""

    shapes = _DPA_NET
    infer = staticmethod(dpa_net)
