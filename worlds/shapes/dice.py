"""Random numbers and choices for buildings and objects."""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

T = TypeVar("T")
Rgb = tuple[float, float, float]


class Dice:
    """Samples numbers and choices with a random generator.

    Attributes:
        rng: the random generator.
    """

    rng: np.random.Generator

    def __init__(self, rng: np.random.Generator) -> None:
        """Draws from the generator `rng`."""
        self.rng = rng

    def uniform(
        self, low: float, high: float, digits: int | None = None
    ) -> float:
        """Returns a random number, uniform from `low` to below `high`.

        If `digits` is given, the number is rounded to that many decimals.
        """
        value = float(self.rng.uniform(low, high))
        return value if digits is None else round(value, digits)

    def whole(self, low: int, high: int) -> int:
        """Returns a random integer from `low` to below `high`."""
        return int(self.rng.integers(low, high))

    def chance(self, share: float) -> bool:
        """Returns True with the probability `share`, and otherwise False."""
        return bool(self.rng.random() < share)

    def pick(self, choices: Sequence[T]) -> T:
        """Returns one of the choices at random, all equally likely."""
        return choices[int(self.rng.integers(len(choices)))]

    def tinted(self, rgb: Rgb, low: float, high: float) -> Rgb:
        """Returns a colour whose channels are multiplied by random numbers.

        The three numbers are uniform from `low` to below `high`. Channels are
        rounded to three decimals.
        """
        tint = self.rng.uniform(low, high, 3)
        red, green, blue = np.round(np.multiply(rgb, tint), 3).tolist()
        return red, green, blue
