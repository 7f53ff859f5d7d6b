"""The order in which the public program of BTC goes through voxels.

Part of BTC (see `evaluation.methods.btc`). Which patches of the ground come
together to its largest plane depends on the order in which they are compared,
and on that plane all keypoints depend. The public program takes the voxels as
the hash table of its C++ library (libstdc++) holds them. That order is no
part of the method, but it is a definite one, and only with it scores agree.
"""

from __future__ import annotations

import numpy as np

from evaluation.geometry.sorting import stable_order

# The hash of a voxel's index, in the public program.
_FACTOR = 116101
_MODULUS = 10_000_000_000

# How many buckets a std::unordered_map of libstdc++ has when it grows by one
# element at a time: the primes of its table that follow each other by its
# rule (at least twice as many, once there are as many elements as buckets).
_NUM_BUCKETS = (
    13, 29, 59, 127, 257, 541, 1109, 2357, 5087, 10273, 20753, 42043, 85229,
    172933, 351061, 712697, 1447153, 2938679, 5967347, 12117689, 24607243,
    49969847, 101473717, 206062531,
)  # fmt: skip


def voxel_order(index: np.ndarray) -> np.ndarray:
    """Returns (V,) in which order the public program visits voxels.

    Args:
        index: (V, 3) int64 of distinct voxels along x, y and z, in the order
            in which they were first met.
    """
    x, y, z = np.asarray(index, dtype=np.int64).T
    # fmod: a remainder with the sign of the dividend, as in C++.
    code = np.fmod(z * _FACTOR, _MODULUS) + y
    code = np.fmod(code * _FACTOR, _MODULUS) + x
    return hash_table_order(code.astype(np.uint64))


def hash_table_order(codes: np.ndarray) -> np.ndarray:
    """Returns (N,) in which order a std::unordered_map is iterated.

    The elements are one list, on which those of a bucket follow each other.
    A new element goes to the front of its bucket, a new bucket to the front
    of the list. When the number of buckets grows, all elements are put in
    anew, in the order of the list.

    Args:
        codes: (N,) uint64 hashes of the elements, in the order in which they
            were put in, one by one.

    Raises:
        ValueError: there are too many.
    """
    if len(codes) > _NUM_BUCKETS[-1]:
        raise ValueError(f"{len(codes)} elements")
    order = np.zeros(0, dtype=np.int64)
    for num_buckets in _NUM_BUCKETS:
        added = np.arange(len(order), min(num_buckets, len(codes)))
        order = np.concatenate([order, added])
        buckets = codes[order] % np.uint64(num_buckets)
        # Where each bucket is first met: the first of equal indices is
        # assigned last.
        first = np.empty(num_buckets, dtype=np.int64)
        first[buckets[::-1]] = np.arange(len(order))[::-1]
        order = order[stable_order(first[buckets])[::-1]]
        if len(order) == len(codes):
            break
    return order
