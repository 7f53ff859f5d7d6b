"""The order of a hash table, against that of the C++ library."""

import math

import numpy as np
import pytest

from evaluation.methods.btc_planes import (
    _NUM_BUCKETS,
    hash_table_order,
    voxel_order,
)

# The order of these 40 voxels, inserted one after the other, in a
# std::unordered_map with the public program's hash (GCC 12.2, x86-64). The
# table grows twice on the way, at 13 and at 29 elements.
VOXELS = np.array(
    [
        [(k * k * 5) % 23 - 11, (k * k * 3 + k) % 31 - 15, k % 5 - 2]
        for k in range(40)
    ]
)
# fmt: off
IN_CPP = [
    39, 34, 33, 32, 30, 29, 38, 36, 18, 8, 7, 24, 11, 27, 37, 28, 10, 15, 6,
    4, 3, 20, 31, 2, 9, 21, 1, 12, 26, 17, 22, 5, 25, 0, 13, 14, 35, 16, 19,
    23,
]
# fmt: on


def by_lists(codes):
    """The same order by the rules of the library, element by element."""
    num_buckets = 13
    entries = []
    for k, code in enumerate(codes):
        if k == num_buckets:
            num_buckets = {13: 29, 29: 59, 59: 127, 127: 257, 257: 541}[k]
            old = entries
            entries = []
            for entry in old:
                put(entries, entry, num_buckets)
        put(entries, (int(code), k), num_buckets)
    return [k for _, k in entries]


def put(entries, entry, num_buckets):
    """Inserts in front of its bucket, or in front of all."""
    buckets = [code % num_buckets for code, _ in entries]
    bucket = entry[0] % num_buckets
    entries.insert(buckets.index(bucket) if bucket in buckets else 0, entry)


def test_order_in_cpp():
    assert voxel_order(VOXELS).tolist() == IN_CPP
    negative = (VOXELS < 0).any(axis=0)
    assert negative.all()


@pytest.mark.parametrize("number", [0, 1, 12, 13, 14, 29, 30, 59, 60, 127, 300])
def test_order_by_the_rules(number):
    rng = np.random.default_rng([number, 60])
    codes = rng.integers(0, 2**64, number, dtype=np.uint64)
    codes[::3] %= np.uint64(50)
    assert hash_table_order(codes).tolist() == by_lists(codes)


def test_numbers_of_buckets_are_primes():
    for number in _NUM_BUCKETS:
        assert (number % np.arange(2, math.isqrt(number) + 1) > 0).all()


def test_a_large_table_holds_every_element_once():
    codes = np.random.default_rng(61).integers(0, 10**10, 40_000)
    order = hash_table_order(codes.astype(np.uint64))
    np.testing.assert_array_equal(np.sort(order), np.arange(40_000))
    # Elements of a bucket follow each other, the latest first.
    bucket = codes[order] % 42043
    same = bucket[1:] == bucket[:-1]
    assert same.sum() == 40_000 - len(np.unique(bucket))
