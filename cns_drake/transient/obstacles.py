"""Areas, seen from above, in which new objects must not stand."""

from collections.abc import Collection, Iterable

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry


class Obstacles:
    """Areas, seen from above, where new objects must not stand."""

    def __init__(self, areas: Iterable[tuple[str, BaseGeometry]]):
        """Collects obstacles.

        Args:
            areas: name and area of each obstacle, seen from above [m].
        """
        pairs = [(n, area) for n, area in areas if not area.is_empty]
        self._names = np.array([name for name, _ in pairs], object)
        self._areas = [area for _, area in pairs]
        self._tree = shapely.STRtree(self._areas)

    def is_free(
        self, area: BaseGeometry, ignored: Collection[str] = ()
    ) -> bool:
        """Returns whether an area touches no obstacle.

        Args:
            area: the area, seen from above [m].
            ignored: names of obstacles that do not count.
        """
        return not self._touching(area, ignored)

    def distance(
        self, area: BaseGeometry, within: BaseGeometry, ignored: Collection[str]
    ) -> float:
        """Returns the distance from an area to the nearest obstacle [m].

        The distance is inf if there is no obstacle.

        Args:
            area: the area, seen from above [m].
            within: area of search. Parts of obstacles outside of this area do
                not count.
            ignored: names of obstacles that do not count.
        """
        return min(
            (
                float(area.distance(shapely.intersection(other, within)))
                for other in self._touching(within, ignored)
            ),
            default=np.inf,
        )

    def _touching(
        self, area: BaseGeometry, ignored: Collection[str]
    ) -> list[BaseGeometry]:
        found = self._tree.query(area, predicate="intersects")
        return [
            self._areas[k]
            for k in sorted(found)
            if self._names[k] not in ignored
        ]
