"""Lots that depend on a name alone, whatever else a city holds."""

from __future__ import annotations

import hashlib

import numpy as np


def lot(seed: int, purpose: str, name: str) -> float:
    """Returns a number from 0 to 1 that depends on these alone."""
    return _number(seed, purpose, name) / 2.0**64


def lot_generator(seed: int, purpose: str, name: str) -> np.random.Generator:
    """Returns a generator whose draws depend on these alone."""
    return np.random.default_rng(_number(seed, purpose, name))


def _number(seed: int, purpose: str, name: str) -> int:
    text = f"{seed}/{purpose}/{name}".encode()
    digest = hashlib.blake2b(text, digest_size=8).digest()
    return int.from_bytes(digest, "big")
