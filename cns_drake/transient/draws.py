"""Random numbers by name."""

from __future__ import annotations

import hashlib

import numpy as np


def draws(seed: int, cause: str, name: str) -> np.random.Generator:
    """Returns the random numbers of one structure for one cause.

    They do not depend on other structures or other causes.

    Args:
        seed: of the scenario's section.
        cause: the switch.
        name: of the structure.
    """
    digest = hashlib.sha256(f"{seed}/{cause}/{name}".encode()).digest()
    return np.random.default_rng(int.from_bytes(digest[:16], "little"))
