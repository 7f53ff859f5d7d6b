"""The order in which the public program of BTC visits voxels.

The public program takes the voxels in the order of the hash table of its C++
library (libstdc++). This order is not part of the method, but is reproduced
here, because with any other order, scores differ from the program's scores (see
`evaluation.methods.btc_planes`).
"""

import numpy as np

# The hash of a voxel's index, in the public program.
_FACTOR = 116101
_MODULUS = 10_000_000_000
# Numbers of buckets of a std::unordered_map of libstdc++ that grows by one
# element at a time. When there are as many elements as buckets, it takes the
# next prime of its table that is at least twice as large.
_NUM_BUCKETS = (
    13, 29, 59, 127, 257, 541, 1109, 2357, 5087, 10273, 20753, 42043, 85229,
    172933, 351061, 712697, 1447153, 2938679, 5967347, 12117689, 24607243,
    49969847, 101473717, 206062531,
)  # fmt: skip


def voxel_order(index: np.ndarray) -> np.ndarray:
    """Returns the order in which the authors' program of BTC visits voxels.

    Args:
        index: (V, 3) int64 indices of distinct voxels along x, y and z, in the
            order in which the voxels first occur in the cloud.

    Returns:
        (V,) row numbers of `index`, in the order of the program.
    """
    x, y, z = np.asarray(index, dtype=np.int64).T
    # fmod: a remainder with the sign of the dividend, as in C++.
    code = np.fmod(z * _FACTOR, _MODULUS) + y
    code = np.fmod(code * _FACTOR, _MODULUS) + x
    return hash_table_order(code.astype(np.uint64))


def hash_table_order(codes: np.ndarray) -> np.ndarray:
    """Returns the order (N,) in which a std::unordered_map is iterated.

    All elements form one list, in which the elements of a bucket follow each
    other. A new element goes to the front of its bucket, and a new bucket to
    the front of the list. When the number of buckets grows, all elements are
    inserted again, in the order of the list.

    Args:
        codes: (N,) uint64 hashes of the elements, in the order in which they
            were put in, one by one.

    Raises:
        ValueError: there are too many elements.
    """
    if len(codes) > _NUM_BUCKETS[-1]:
        raise ValueError(f"{len(codes)} elements")
    order = np.zeros(0, dtype=np.int64)
    for num_buckets in _NUM_BUCKETS:
        added = np.arange(len(order), min(num_buckets, len(codes)))
        order = np.concatenate([order, added])
        buckets = codes[order] % np.uint64(num_buckets)
        # Index of each bucket's first element: among equal indices, the first
        # is assigned last.
        first = np.empty(num_buckets, dtype=np.int64)
        first[buckets[::-1]] = np.arange(len(order))[::-1]
        # The newest bucket comes first, and in each bucket the newest element.
        ranks = first[buckets] * len(order) + np.arange(len(order))
        order = order[np.argsort(ranks)[::-1]]
        if len(order) == len(codes):
            break
    return order
