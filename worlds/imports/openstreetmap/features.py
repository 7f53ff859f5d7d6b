"""The parts of an OpenStreetMap file that make up a city."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from shapely.geometry import Polygon

from worlds.imports.faults import ImportFaults

Tags = Mapping[str, str]


class OsmNode(NamedTuple):
    """A node of an OpenStreetMap file, such as a tree.

    Attributes:
        name: id of the node, such as `n123`.
        tags: tags of the node.
        place: longitude and latitude [deg].
    """

    name: str
    tags: Tags
    place: tuple[float, float]


class OsmWay(NamedTuple):
    """A way of an OpenStreetMap file, such as a street.

    Attributes:
        name: id of the way, such as `w123`.
        tags: tags of the way.
        line: (N, 2) longitude and latitude of the way's nodes [deg].
        nodes: ids of the way's nodes.
    """

    name: str
    tags: Tags
    line: np.ndarray
    nodes: tuple[int, ...]


class OsmArea(NamedTuple):
    """An area of an OpenStreetMap file, such as a building.

    Attributes:
        name: id of the area, such as `w123` or `r123`.
        tags: tags of the area.
        polygons: polygons of the area, in longitude and latitude [deg].
    """

    name: str
    tags: Tags
    polygons: list[Polygon]


@dataclass
class OsmFeatures:
    """The content of an OpenStreetMap file.

    Places are longitude and latitude [deg]. An id is a number with the prefix
    `n` for a node, `w` for a way and `r` for a relation.

    Attributes:
        areas: closed ways and multipolygons.
        ways: ways; places that are not in the file are left out.
        trees: nodes that are trees.
        crossings: number and tags of each node that is a crossing.
        nodes: all other nodes with tags.
        outers: id of a way that is the outline of a building's multipolygon ->
            id of this multipolygon.
        kinds: id -> kind, for all objects with tags.
        faults: counts of faulty parts.
    """

    areas: list[OsmArea] = field(default_factory=list)
    ways: list[OsmWay] = field(default_factory=list)
    trees: list[OsmNode] = field(default_factory=list)
    crossings: list[tuple[int, Tags]] = field(default_factory=list)
    nodes: list[OsmNode] = field(default_factory=list)
    outers: dict[str, str] = field(default_factory=dict)
    kinds: dict[str, str] = field(default_factory=dict)
    faults: ImportFaults = field(default_factory=ImportFaults)
