"""Random numbers of an ageing city, for each object, year and event."""

from collections.abc import Mapping

import numpy as np

from worlds.ageing.rates import Tally
from worlds.ageing.standing_structures import StandingStructures
from worlds.imports import random_generator, random_share


class YearlyDraws:
    """Random numbers that depend only on seed, year, object and purpose.

    Attributes:
        rates: event -> rate per year, see `worlds.ageing.rates.read_rates`.
        tally: counts of the events that were sampled.
    """

    def __init__(
        self,
        standing: StandingStructures,
        rates: Mapping[str, float],
        seed: int,
    ) -> None:
        """Begins without an event.

        Args:
            standing: the city, which knows the year.
            rates: event -> rate per year.
            seed: seed of all random numbers.
        """
        self.rates = rates
        self.tally = Tally(rates)
        self._standing = standing
        self._seed = seed

    def generator(self, purpose: str, name: str) -> np.random.Generator:
        """Returns the random generator of an object for a purpose this year."""
        return random_generator(
            self._seed, f"{purpose}/{self._standing.year}", name
        )

    def share(self, purpose: str, name: str) -> float:
        """Returns a random number from 0 to 1, as by `generator`."""
        return random_share(
            self._seed, f"{purpose}/{self._standing.year}", name
        )

    def happens(self, event: str, name: str) -> bool:
        """Samples, and counts, whether an event happens to an object."""
        rate = self.rates[event]
        hit = self.share(event, name) < rate
        self.tally.count(event, rate, hit, 1)
        return hit
