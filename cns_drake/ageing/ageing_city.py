"""A city that ages: which events happen, year after year.

The city in a year follows from the city in the year before. Each object has its
own random numbers for each year and event, so that a simulation of more years
begins with the same events as a simulation of fewer years.
"""

from collections.abc import Mapping

from shapely.geometry.base import BaseGeometry

from cns_drake.ageing.buildings import Buildings
from cns_drake.ageing.lots import find_lots
from cns_drake.ageing.old_world import OldWorld
from cns_drake.ageing.standing_structures import StandingStructures
from cns_drake.ageing.street_renewal import StreetRenewal
from cns_drake.ageing.trees import Trees
from cns_drake.ageing.yearly_draws import YearlyDraws


class AgeingCity:
    """A city at the end of a year.

    Attributes:
        standing: the year, what stands at its end, and the events since today.
        tally: counts of these events.
    """

    def __init__(
        self,
        world: OldWorld,
        rates: Mapping[str, float],
        seed: int,
        kept_free: BaseGeometry,
    ) -> None:
        """Begins with the city of today.

        Args:
            world: the city of today.
            rates: event -> rate per year, see
                `cns_drake.ageing.rates.read_rates`.
            seed: seed of all random draws.
            kept_free: area in W [m] on which nothing is built, because drives
                lead across it.

        Raises:
            InputError: the city has no building.
        """
        # Trees grow within distances from buildings, which stand on lots.
        lots = find_lots(world, kept_free)
        self.standing = StandingStructures(world)
        draws = YearlyDraws(self.standing, rates, seed)
        self.tally = draws.tally
        self._trees = Trees(world, self.standing, draws, seed)
        self._buildings = Buildings(
            world, self.standing, draws, self._trees, lots, kept_free
        )
        self._streets = StreetRenewal(world, self.standing, draws, kept_free)

    def live(self) -> None:
        """Simulates one year: samples which structures change."""
        self.standing.year += 1
        self._buildings.live()
        self._trees.live()
        self._streets.live()
