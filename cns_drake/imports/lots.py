"""Random draws that depend on names only, not on the rest of a city."""

from __future__ import annotations

import hashlib

import numpy as np


def lot(seed: int, purpose: str, name: str) -> float:
    """Returns a number from 0 to 1 that depends on the arguments only."""
    return _number(seed, purpose, name) / 2.0**64


def lot_generator(seed: int, purpose: str, name: str) -> np.random.Generator:
    """Returns a generator whose draws depend on the arguments only."""
    return np.random.default_rng(_number(seed, purpose, name))


def _number(seed: int, purpose: str, name: str) -> int:
    text = f"{seed}/{purpose}/{name}".encode()
    digest = hashlib.blake2b(text, digest_size=8).digest()
    return int.from_bytes(digest, "big")
