"""Random numbers that depend only on a seed, a purpose and a name."""

import hashlib
import math

import numpy as np

# Size of a hashed number [bytes].
_HASH_SIZE = 8


def random_share(seed: int, purpose: str, name: str) -> float:
    """Returns a random number from 0 to 1 that depends only on the arguments.

    `purpose` says what the number is used for, and `name` for which object.
    """
    return math.ldexp(_hashed_number(seed, purpose, name), -8 * _HASH_SIZE)


def random_generator(seed: int, purpose: str, name: str) -> np.random.Generator:
    """Returns a random generator whose seed depends only on the arguments.

    `purpose` says what the generator is used for, and `name` for which object.
    """
    return np.random.default_rng(_hashed_number(seed, purpose, name))


def _hashed_number(seed: int, purpose: str, name: str) -> int:
    """Returns a whole number of 64 bits that depends only on the arguments."""
    text = f"{seed}/{purpose}/{name}".encode()
    digest = hashlib.blake2b(text, digest_size=_HASH_SIZE).digest()
    return int.from_bytes(digest, "big")
