"""Structures made from CityJSON files, and their measures."""

import numpy as np

from cns_drake.imports.cityjson.city import import_objects
from cns_drake.imports.cityjson.reading import read_cityjson

ORIGIN = np.array([85000.0, 446000.0, 3.0])


def structures(path, **options):
    city = read_cityjson(path)
    values = {"lod": None, "year_attribute": None} | options
    return city, {
        one.structure.name: one
        for one in import_objects(city, ORIGIN, **values)
    }


def area(one):
    a, b, c = np.moveaxis(one.triangles, 1, 0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


def volume(one):
    a, b, c = np.moveaxis(one.triangles, 1, 0)
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
