"""Cities as sources of maps read them, and sizes of their structures."""

import numpy as np

from worlds.imports import ImportOptions, map_sources


def read_city(path, **options):
    (source,) = (one for one in map_sources() if path.suffix in one.suffixes)
    return source.read(path, ImportOptions(**options))


def import_osm(path, year_attribute=None):
    city = read_city(path, year_attribute=year_attribute)
    return city, {one.structure.name: one for one in city.objects}


def bounds(one):
    corners = one.triangles.reshape(-1, 3)
    return corners.min(axis=0), corners.max(axis=0)


def volume(triangles):
    a, b, c = np.moveaxis(triangles, 1, 0)
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
