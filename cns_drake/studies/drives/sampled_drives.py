"""Routes, and fleets of drives, that an experiment samples at random."""

from typing import Annotated, Any

import numpy as np
from pydantic import Field

from cns_drake.studies.drives.viewpoints import VIEWPOINTS
from evaluation.base import Section
from worlds.ageing import LAST_YEAR

_RouteLength = Annotated[float, Field(gt=0.0, le=100_000.0)]


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

    Each drive has a route that is sampled at random, one of the viewpoints
    `near`, `lane` and `reversed`, and trees with or without leaves. The random
    choices for a car in a year do not depend on the numbers of cars and of
    years, so a larger fleet contains the drives of a smaller fleet.

    Attributes:
        cars: number of drives per year.
        years: number of years. The first drives take place this number of years
            before the query, and the last drives one year before the query.
        length: smallest length of a route [m].
        seed: seed of the random choices.
    """

    cars: int = Field(ge=1, le=1000, strict=True)
    years: int = Field(ge=1, le=LAST_YEAR, strict=True)
    length: _RouteLength
    seed: int = Field(ge=0)

    def sessions(self) -> list[dict[str, Any]]:
        """Returns the fields of each drive, from older to newer."""
        found = []
        for years in range(self.years, 0, -1):
            for car in range(self.cars):
                rng = np.random.default_rng([self.seed, years, car])
                number = int(rng.integers(2**31))
                found.append(
                    {
                        "years": years,
                        "route": {"length": self.length, "seed": number},
                        "viewpoint": str(rng.choice(list(VIEWPOINTS))),
                        "transient": {
                            "leaves": float(rng.integers(2)),
                            "seed": number,
                        },
                    }
                )
        return found
