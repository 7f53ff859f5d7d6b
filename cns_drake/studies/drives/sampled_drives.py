"""Routes, and fleets of drives, that an experiment samples at random."""

from typing import Annotated, Any

import numpy as np
from pydantic import Field

from evaluation.base import Section
from worlds.ageing import LAST_YEAR

_RouteLength = Annotated[float, Field(gt=0.0, le=100_000.0)]


# Where the LiDARs of a car can pass: to the left [m], and turned [deg].
_OFFSETS = {
    "near": {"left": 0.5},
    "lane": {"left": 5.0},
    "reversed": {"left": 5.0, "yaw_deg": 180.0},
}


class DrawnRoute(Section):
    """A route that is sampled at random.

    Attributes:
        length: smallest length of the route [m].
        seed: seed of the random route.
    """

    length: _RouteLength
    seed: int = Field(default=0, ge=0)


class Fleet(Section):
    """Cars that drive through a city year by year, and make a database.

    Each drive has a route that is sampled at random, its LiDARs near the
    query's, in the next lane, or there and facing backwards; and trees with or
    without leaves. A larger fleet contains the drives of a smaller one.

    Attributes:
        cars: number of drives per year.
        years: number of years. The first drives take place this number of years
            before the query, whose city has aged by at least as many
            (`query.city.years`), and the last ones one year before it.
        length: smallest length of a route [m].
        seed: seed of the random choices.
    """

    cars: int = Field(ge=1, le=1000, strict=True)
    years: int = Field(ge=1, le=LAST_YEAR, strict=True)
    length: _RouteLength
    seed: int = Field(ge=0)

    def sessions(self, query_years: int) -> list[dict[str, Any]]:
        """Returns the fields of each drive, from older to newer.

        Args:
            query_years: number of years by which the query's city has aged.
        """
        found = []
        for years in range(self.years, 0, -1):
            for car in range(self.cars):
                rng = np.random.default_rng([self.seed, years, car])
                number = int(rng.integers(2**31))
                found.append(
                    {
                        "city": {"years": query_years - years},
                        "route": {"length": self.length, "seed": number},
                        "offset": _OFFSETS[str(rng.choice(list(_OFFSETS)))],
                        "transient": {
                            "leaves": float(rng.integers(2)),
                            "seed": number,
                        },
                    }
                )
        return found
