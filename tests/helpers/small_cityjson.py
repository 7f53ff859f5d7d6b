"""Small CityJSON files, written here from the specification alone."""

import json


class CityWriter:
    """Collects objects and their shared vertices, in millimetres."""

    def __init__(self, version="2.0", origin=(85000.0, 446000.0, 3.0)):
        self.origin = origin
        self.objects = {}
        self.vertices = []
        self.metadata = {
            "referenceSystem": "https://www.opengis.net/def/crs/EPSG/0/7415"
        }
        self.version = version
        self.templates = None

    def vertex(self, x, y, z):
        """Returns the index of a place, given from the origin [m]."""
        self.vertices.append([round(1000 * v) for v in (x, y, z)])
        return len(self.vertices) - 1

    def ring(self, points):
        return [self.vertex(*point) for point in points]

    def box_faces(self, x, y, z, size):
        """Returns the six faces of an upright box, seen from outside."""
        a, b, c = size
        low = self.ring(
            [(x, y, z), (x + a, y, z), (x + a, y + b, z), (x, y + b, z)]
        )
        top = self.ring(
            [
                (x, y, z + c),
                (x + a, y, z + c),
                (x + a, y + b, z + c),
                (x, y + b, z + c),
            ]
        )
        walls = [
            [[low[k], low[(k + 1) % 4], top[(k + 1) % 4], top[k]]]
            for k in range(4)
        ]
        return [[low[::-1]], *walls, [top]]

    def add(self, name, kind, *geometries, **values):
        self.objects[name] = {
            "type": kind,
            "geometry": list(geometries),
            **values,
        }

    def box(self, name, x, y, size, z=0.0, kind="Building", **values):
        """Adds a box as a solid of level 2."""
        solid = {
            "type": "Solid",
            "lod": "2",
            "boundaries": [self.box_faces(x, y, z, size)],
            "semantics": {
                "surfaces": [
                    {"type": "GroundSurface"},
                    {"type": "WallSurface"},
                    {"type": "RoofSurface"},
                ],
                "values": [[0, 1, 1, 1, 1, 2]],
            },
        }
        self.add(name, kind, solid, **values)

    def document(self):
        document = {
            "type": "CityJSON",
            "version": self.version,
            "transform": {
                "scale": [0.001] * 3,
                "translate": list(self.origin),
            },
            "metadata": self.metadata,
            "CityObjects": self.objects,
            "vertices": self.vertices,
        }
        if self.templates is not None:
            document["geometry-templates"] = self.templates
        return document

    def write(self, path):
        path.write_text(json.dumps(self.document()))
        return path


def write_blocks(path, years=True):
    """Writes a town of three by three blocks of four houses, streets of 12 m.

    The houses of each block are 10 years younger than those of the last.
    """
    city = CityWriter()
    for block in range(9):
        for house in range(4):
            x = 52.0 * (block % 3) + 20.0 * (house % 2)
            y = 52.0 * (block // 3) + 20.0 * (house // 2)
            values = {}
            if years and block < 8:
                values["attributes"] = {
                    "oorspronkelijkbouwjaar": 1900 + 10 * block
                }
            city.box(
                f"house.{block}.{house}",
                x,
                y,
                (20.0, 20.0, 6.0 + house),
                **values,
            )
    return city.write(path)


def house(attributes):
    """Returns a CityJSON file of one house, as a dictionary."""
    corners = [[x, y, z] for z in (0, 5) for y in (0, 8) for x in (0, 10)]
    faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3],
             [0, 4, 6, 2], [1, 3, 7, 5]]  # fmt: skip
    geometry = {
        "type": "Solid",
        "lod": "2",
        "boundaries": [[[face] for face in faces]],
    }
    return {
        "type": "CityJSON",
        "version": "2.0",
        "transform": {"scale": [1, 1, 1], "translate": [0, 0, 0]},
        "CityObjects": {
            "a": {
                "type": "Building",
                "attributes": attributes,
                "geometry": [geometry],
            }
        },
        "vertices": corners,
    }
