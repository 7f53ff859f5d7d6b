"""Small OpenStreetMap files, written here from the specification alone."""

import cmath
import math

# Origin of the maps [deg].
LAT = 52.0
LON = 13.0
# The lengths of a degree east and north there, by the series for WGS 84.
_PHI = math.radians(LAT)
METRES_PER_DEGREE = (
    111412.84 * math.cos(_PHI)
    - 93.5 * math.cos(3 * _PHI)
    + 0.118 * math.cos(5 * _PHI),
    111132.954 - 559.822 * math.cos(2 * _PHI) + 1.175 * math.cos(4 * _PHI),
)


class OsmWriter:
    """Writes nodes and ways, given in metres about 52 N, 13 E.

    Args:
        move: by what everything is moved [m].
        turn_deg: by how much everything is turned first [deg].
    """

    def __init__(self, move=(0, 0), turn_deg=0.0):
        self.rows = []
        self._next = 1
        self._move = complex(*move)
        self._turn = cmath.rect(1.0, math.radians(turn_deg))

    def node(self, x, y, **tags):
        place = complex(x, y) * self._turn + self._move
        east, north = METRES_PER_DEGREE
        lat, lon = LAT + place.imag / north, LON + place.real / east
        number = self._number()
        self.rows.append(
            f'<node id="{number}" version="1" lat="{lat:.9f}"'
            f' lon="{lon:.9f}">{_tags(tags)}</node>'
        )
        return number

    def way(self, points, closed=False, **tags):
        nodes = [self.node(*point) for point in points]
        if closed:
            nodes.append(nodes[0])
        return self.way_of(nodes, **tags)

    def way_of(self, nodes, **tags):
        number = self._number()
        refs = "".join(f'<nd ref="{node}"/>' for node in nodes)
        self.rows.append(
            f'<way id="{number}" version="1">{refs}{_tags(tags)}</way>'
        )
        return number

    def box(self, x, y, a, b, **tags):
        corners = [(x, y), (x + a, y), (x + a, y + b), (x, y + b)]
        return self.way(corners, closed=True, **tags)

    def relation(self, members, **tags):
        number = self._number()
        rows = "".join(
            f'<member type="way" ref="{ref}" role="{role}"/>'
            for role, refs in members.items()
            for ref in refs
        )
        self.rows.append(
            f'<relation id="{number}" version="1">{rows}{_tags(tags)}'
            "</relation>"
        )
        return number

    def write(self, path):
        kinds = ("<node", "<way", "<relation")
        rows = sorted(
            self.rows, key=lambda row: kinds.index(row.split(maxsplit=1)[0])
        )
        text = "\n".join(rows)
        path.write_text(f'<osm version="0.6">\n{text}\n</osm>\n')
        return path

    def _number(self):
        self._next += 1
        return self._next


def _tags(tags):
    return "".join(
        f'<tag k="{key.replace("__", ":")}" v="{value}"/>'
        for key, value in tags.items()
    )


def write_corner(path):
    """Writes some of each: streets that cross, houses, land, trees."""
    osm = OsmWriter()
    osm.way([(-60, 0), (0, 0), (60, 0)], highway="residential", oneway="yes")
    osm.way([(0, -50), (0, 50)], highway="tertiary", sidewalk="both")
    osm.node(0, 0, highway="crossing")
    osm.box(10, 10, 20, 12, building="yes", height="9", start_date="1931")
    whole = osm.box(-30, 10, 20, 20, building="yes", roof__shape="hipped")
    osm.box(-30, 10, 10, 20, building__part="yes", building__levels="4")
    osm.box(10, -40, 30, 25, natural="water")
    osm.way([(-20, -20), (-5, -20), (-5, -40)], barrier="hedge")
    for k in range(3):
        osm.node(-40 + 10 * k, -10, natural="tree", height="7")
    hole = osm.box(-45, 15, 4, 4)
    outer = osm.box(-50, 10, 15, 15)
    osm.relation(
        {"outer": [outer], "inner": [hole]},
        type="multipolygon",
        building="yes",
    )
    osm.relation({"": [whole]}, type="site")
    osm.write(path)
