"""Areas, seen from above, in which new objects must not stand."""

from collections.abc import Collection, Iterable

import numpy as np
import shapely

from worlds.shapes.polygons import Area


class Obstacles:
    """Areas, seen from above, where new objects must not stand."""

    def __init__(self, areas: Iterable[tuple[str, Area]]):
        """Collects obstacles.

        Args:
            areas: name and area of each obstacle, seen from above [m].
        """
        pairs = [(n, area) for n, area in areas if not area.is_empty]
        self._names = [name for name, _ in pairs]
        self._areas = [area for _, area in pairs]
        self._tree = shapely.STRtree(self._areas)

    def add(self, name: str, area: Area) -> None:
        """Adds one more obstacle, such as an object that was put up.

        Every later question is compared with all that were added.

        Args:
            name: name of the obstacle.
            area: its area, seen from above [m].
        """
        shapely.prepare(area)
        self._names.append(name)
        self._areas.append(area)

    def is_free(self, area: Area, ignored: Collection[str] = ()) -> bool:
        """Returns whether an area touches no obstacle.

        Args:
            area: the area, seen from above [m].
            ignored: names of obstacles that do not count.
        """
        return not self._touching(area, ignored)

    def touched_by(self, area: Area) -> set[str]:
        """Returns the names of the obstacles that an area touches.

        The area is seen from above [m].
        """
        return {self._names[k] for k in self._touching(area)}

    def distance(
        self, area: Area, within: Area, ignored: Collection[str]
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
                for other in map(
                    self._areas.__getitem__, self._touching(within, ignored)
                )
            ),
            default=np.inf,
        )

    def _touching(self, area: Area, ignored: Collection[str] = ()) -> list[int]:
        """Returns the numbers of the obstacles that an area touches."""
        found = sorted(self._tree.query(area, predicate="intersects").tolist())
        first = len(self._tree)
        added = np.array(self._areas[first:], object)
        hit = np.flatnonzero(shapely.intersects(added, area))
        found += (first + hit).tolist()
        return [k for k in found if self._names[k] not in ignored]
