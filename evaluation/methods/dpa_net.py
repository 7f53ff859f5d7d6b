"""DPA-Net (Park, Kim, Jeon, Kwon, Lee, Lee: RA-L 2026), with its weights.

Sparse convolutions and an attention with learned offsets turn a cloud into a
descriptor of 256 numbers. The distance of two descriptors is the dissimilarity
of two places. The method estimates no pose.

The architecture is reimplemented from the paper and the authors' program; no
weights are shipped. Clouds are prepared by
`evaluation.methods.pointnetvlad_clouds`, which lists the deliberate
differences.
"""

import numpy as np
from scipy.special import expit, softmax

from evaluation.methods.network_layers import (
    Weights,
    batch_norm,
    batch_norm_shapes,
    gelu,
    generalised_mean,
    interpolated,
    layer_norm,
    linear,
    nearest_three,
    relu,
)
from evaluation.methods.pointnetvlad_clouds import CELL, occupied_cells
from evaluation.methods.published_networks import CloudNetwork
from evaluation.methods.registry import register
from evaluation.methods.sparse_convolution import convolve

# DPA-Net's attention: number of points.
_CENTRES = 1024
# Number of heads.
_HEADS = 8
# Number of samples per head.
_SAMPLES = 8
DPA_NET_SHAPES = {
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
    **batch_norm_shapes("spconv0.bn.bn spconv1.bn.bn", 32),
    **batch_norm_shapes(
        "FP_modules.0.mlp.layer0.bn.bn FP_modules.0.mlp.layer1.bn.bn", 256
    ),
}


def dpa_net(weights: Weights, cloud: np.ndarray) -> np.ndarray:
    """Returns DPA-Net's descriptor (256,) of a cloud from `prepare`."""
    cells, x = occupied_cells(cloud)
    for name in ("spconv0", "spconv1"):
        x = convolve(cells, x, weights[f"{name}.conv.kernel"])
        x = relu(batch_norm(weights, f"{name}.bn.bn", x, 1e-6))
    name = "sample_inter0.get_interpolate"
    x = x @ weights[f"{name}.conv1x1.kernel"]
    centres = cloud[farthest_points(cloud, _CENTRES)]
    # The authors' program uses the lower corner of a cell as its position.
    x = interpolated(cells * CELL, centres, x)
    x = gelu(layer_norm(weights, f"{name}.ln", x, 1e-6))
    x = _deformable_attention(weights, x, centres)
    x = np.concatenate([interpolated(centres, cloud, x), cloud], axis=1)
    for number in range(2):
        name = f"FP_modules.0.mlp.layer{number}"
        x = linear(weights, f"{name}.conv", x)
        x = relu(batch_norm(weights, f"{name}.bn.bn", x))
    x = x * expit(linear(weights, "Gem.weight.0", x))
    return generalised_mean(x, weights["Gem.p"])


def farthest_points(points: np.ndarray, number: int) -> np.ndarray:
    """Returns indices of points that are far apart from each other.

    This is farthest point sampling. The first point has index 0. Each further
    point is the point with the greatest distance from the nearest point chosen
    so far.

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
    y = linear(weights, "dpa0.offset_net.0", y)
    y = gelu(layer_norm(weights, "dpa0.offset_net.1", y))
    y = gelu(linear(weights, "dpa0.offset_net.4", y))
    y = np.tanh(linear(weights, "dpa0.offset_net.6", y))
    offsets = y.reshape(len(x), _HEADS, _SAMPLES, 3)
    offsets = offsets * np.abs(weights["dpa0.offset_scale"])
    q, k, v = (
        linear(weights, f"dpa0.{s}_proj", x).reshape(len(x), _HEADS, -1)
        for s in "qkv"
    )
    samples = xyz[:, None, None] + offsets
    found, shares = nearest_three(xyz, samples.reshape(-1, 3))
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
    y = linear(weights, "dpa0.rel_pos_enc.0", -offsets)
    y = gelu(layer_norm(weights, "dpa0.rel_pos_enc.1", y))
    logits = logits + linear(weights, "dpa0.rel_pos_enc.3", y)[..., 0]
    y = np.einsum("nhs,nhsd->nhd", softmax(logits, axis=2), v)
    y = linear(weights, "dpa0.proj", y.reshape(len(x), -1))
    x = layer_norm(weights, "dpa0.norm1", x + y)
    y = linear(weights, "dpa0.ffn.3", gelu(linear(weights, "dpa0.ffn.0", x)))
    return layer_norm(weights, "dpa0.norm2", x + y)


@register("dpa-net")
class DpaNet(CloudNetwork):
    """The place-recognition method DPA-Net."""

    title = "DPA-Net"
    source = "Park, Kim, Jeon, Kwon, Lee, Lee: RA-L 2026"
    order = 10
    shapes = DPA_NET_SHAPES
    infer = staticmethod(dpa_net)
