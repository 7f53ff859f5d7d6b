"""SVT-Net (Fan, Song, Liu, Lu, He, Du: AAAI 2022), with its authors' weights.

Sparse convolutions and two transformers turn a cloud into a descriptor of 256
numbers. The distance of two descriptors is the dissimilarity of two places. The
method estimates no pose.

The architecture is reimplemented from the paper and the authors' program; no
weights are shipped. Clouds are prepared by
`evaluation.methods.pointnetvlad_clouds`, which lists the deliberate
differences.
"""

import numpy as np
from scipy.special import softmax

from evaluation.methods.network_layers import (
    Weights,
    batch_norm,
    batch_norm_shapes,
    generalised_mean,
    linear,
    relu,
)
from evaluation.methods.pointnetvlad_clouds import occupied_cells
from evaluation.methods.published_networks import CloudNetwork
from evaluation.methods.registry import register
from evaluation.methods.sparse_convolution import coarser, convolve

SVT_NET_SHAPES = {
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
    **batch_norm_shapes(
        "backbone.bn0.bn backbone.bn.0.bn backbone.bn.1.bn", 32
    ),
    **batch_norm_shapes(
        "backbone.blocks.0.0.norm1.bn backbone.blocks.0.0.norm2.bn", 32
    ),
    **batch_norm_shapes(
        "backbone.blocks.1.0.norm1.bn backbone.blocks.1.0.norm2.bn"
        " backbone.blocks.1.0.downsample.1.bn",
        64,
    ),
    **batch_norm_shapes(
        "backbone.att_sa.after_norm.bn backbone.att_token.after_norm.bn", 256
    ),
}


def svt_net(weights: Weights, cloud: np.ndarray) -> np.ndarray:
    """Returns SVT-Net's descriptor (256,) of a prepared cloud."""
    backbone = {
        name.removeprefix("backbone."): w for name, w in weights.items()
    }
    cells, x = occupied_cells(cloud)
    x = convolve(cells, x, backbone["conv0.kernel"])
    x = relu(batch_norm(backbone, "bn0.bn", x))
    for number, step in enumerate((1, 2)):
        at = coarser(cells, 2 * step)
        x = convolve(cells, x, backbone[f"convs.{number}.kernel"], step, at)
        x = relu(batch_norm(backbone, f"bn.{number}.bn", x))
        cells = at
        x = _residual_block(backbone, f"blocks.{number}.0", cells, x, 2 * step)
    x = x @ backbone["conv1x1.0.kernel"]
    x = _token_attention(backbone, x) + _cell_attention(backbone, x)
    return generalised_mean(x, weights["pooling.p"])


def _residual_block(
    weights: Weights, name: str, cells: np.ndarray, x: np.ndarray, step: int
) -> np.ndarray:
    """Returns the features (N, channels) after two convolutions with a bypass.

    Args:
        weights: weights of the network.
        name: name of the block.
        cells: (N, 3) indices of the occupied cells.
        x: (N, channels) features of these cells.
        step: distance of neighbouring cells, as a number of cells.
    """
    y = convolve(cells, x, weights[f"{name}.conv1.kernel"], step)
    y = relu(batch_norm(weights, f"{name}.norm1.bn", y))
    y = convolve(cells, y, weights[f"{name}.conv2.kernel"], step)
    y = batch_norm(weights, f"{name}.norm2.bn", y)
    if f"{name}.downsample.0.kernel" in weights:
        x = x @ weights[f"{name}.downsample.0.kernel"]
        x = batch_norm(weights, f"{name}.downsample.1.bn", x)
    return relu(x + y)


def _cell_attention(weights: Weights, x: np.ndarray) -> np.ndarray:
    """The atom-based transformer: each cell attends to all."""
    q, k, v = (x @ weights[f"att_sa.{s}_conv.kernel"] for s in "qkv")
    y = softmax(q @ k.T, axis=1) @ v @ weights["att_sa.trans_conv.kernel"]
    return x + relu(batch_norm(weights, "att_sa.after_norm.bn", y))


def _token_attention(weights: Weights, x: np.ndarray) -> np.ndarray:
    """The cluster-based transformer: cells attend to eight tokens."""
    q, k, p = (x @ weights[f"att_token.{s}_conv.kernel"] for s in "qkp")
    tokens = softmax(k, axis=0).T @ q
    values, keys, queries = (
        linear(weights, f"att_token.{s}", tokens)
        for s in ("convvalues", "convkeys", "convquries")
    )
    mixed = softmax(keys @ queries.T, axis=1) @ values
    tokens = tokens + linear(weights, "att_token.embedding1", mixed)
    tokens = linear(weights, "att_token.T_conv", tokens)
    y = softmax(p @ tokens.T, axis=1) @ tokens
    y = y @ weights["att_token.trans_conv.kernel"]
    return x + relu(batch_norm(weights, "att_token.after_norm.bn", y))


@register("svt-net")
class SvtNet(CloudNetwork):
    """The place-recognition method SVT-Net."""

    title = "SVT-Net"
    source = "Fan, Song, Liu, Lu, He, Du: AAAI 2022"
    order = 10
    shapes = SVT_NET_SHAPES
    infer = staticmethod(svt_net)
