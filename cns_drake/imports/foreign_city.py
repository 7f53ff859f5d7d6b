"""An imported city, independent of its file format."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field
import hashlib
from itertools import pairwise
import re

import numpy as np

from cns_drake.city.geometry import (
    Finish,
    Mesh,
    MeshShape,
    Model,
    Part,
    Structure,
    hull_of,
)
from cns_drake.imports.options import ImportFaults

Rgb = tuple[float, float, float]
# Sharpest turn from one street into another that drives take.
SHARPEST_TURN_DEG = 125.0
# A roof of clay tiles.
RED_ROOF = Finish((0.55, 0.30, 0.24), "brick")
# Lane marks and zebra crossings.
WHITE_PAINT = Finish((0.86, 0.86, 0.84), "markings")
_GROUND_CLASSES = ("road", "parking", "other-ground", "terrain")
WATER: Rgb = (0.16, 0.34, 0.45)
LAWN: Rgb = (0.42, 0.55, 0.30)


def random_share(seed: int, purpose: str, name: str) -> float:
    """Returns a random number from 0 to 1 that depends only on the arguments.

    `purpose` says what the number is used for, and `name` for which object.
    """
    return _number(seed, purpose, name) / 2.0**64


def random_generator(seed: int, purpose: str, name: str) -> np.random.Generator:
    """Returns a random generator whose seed depends only on the arguments.

    `purpose` and `name` say for what it is used, and for which object.
    """
    return np.random.default_rng(_number(seed, purpose, name))


def _number(seed: int, purpose: str, name: str) -> int:
    text = f"{seed}/{purpose}/{name}".encode()
    digest = hashlib.blake2b(text, digest_size=8).digest()
    return int.from_bytes(digest, "big")


# Compared by identity, because there are thousands and comparing meshes takes
# long.
@dataclass(frozen=True, eq=False)
class Imported:
    """A structure of an imported city, made from an object of its file.

    Attributes:
        structure: the structure.
        kind: type of the object in its file, such as Building.
        year: year in which the structure was built; None if unknown.
        triangles: (M, 3, 3) all surfaces that a car could hit or drive over, in
            W [m].
        until: year in which the structure was demolished; None if unknown.
        tags: tags of the object in its file.
        lod: level of detail; 0 if unknown.
        original: name of the structure of which this structure is a variant; ""
            if this structure is not a variant.
        is_gone: whether the structure was demolished at an unknown date.
    """

    structure: Structure
    kind: str
    year: int | None
    triangles: np.ndarray
    until: int | None = None
    tags: Mapping[str, str] = field(default_factory=dict)
    lod: float = 0.0
    original: str = ""
    is_gone: bool = False

    @property
    def draw_name(self) -> str:
        """Name on which the random numbers for the structure depend.

        A variant of a structure has the draw name of the original.
        """
        return self.original or self.structure.name

    @property
    def is_ground(self) -> bool:
        """Whether the class of the structure is ground for cars, such as road.

        The structure may still be too steep to drive on.
        """
        return self.structure.semantic_class in _GROUND_CLASSES


@dataclass(frozen=True)
class Thing:
    """A small object from a city's file, such as a bench.

    Attributes:
        source: id of the object in the file.
        element: type of the object in the file.
        kind: a key of `cns_drake.city.placement.objects.OBJECTS`.
        xy: position in W [m].
        yaw: heading in W [rad]; None if unknown.
    """

    source: str
    element: str
    kind: str
    xy: tuple[float, float]
    yaw: float | None


@dataclass(frozen=True)
class Street:
    """A street, on which cars drive forwards, backwards or both.

    Attributes:
        line: (N, 2) middle of the street, from start to end [m].
        nodes: a node for each point of `line`; streets meet at common nodes.
        forward: whether cars drive in the direction of `line`.
        backward: whether cars drive against this direction.
        aside: lateral offset of the outermost lane from the middle [m].
        width: width of the carriageway [m]; 0 if unknown.
        name: name of the street in the file.
        tags: tags of the street in the file.
    """

    line: np.ndarray
    nodes: tuple[int, ...]
    forward: bool
    backward: bool
    aside: float
    width: float = 0.0
    name: str = ""
    tags: Mapping[str, str] = field(default_factory=dict)


def ends_at_nodes(streets: Iterable[Street]) -> Counter[int]:
    """Returns node -> number of street ends at the node.

    A street that passes through a node counts as two ends.
    """
    ends: Counter[int] = Counter()
    for street in streets:
        last = len(street.nodes) - 1
        for k, node in enumerate(street.nodes):
            ends[node] += 1 if k in (0, last) else 2
    return ends


def cut_at_nodes(
    streets: Sequence[Street], also: AbstractSet[int] = frozenset()
) -> Iterator[tuple[Street, np.ndarray, tuple[int, int]]]:
    """Cuts streets where they meet, and at the nodes in `also`.

    Yields:
        For each piece: its street, its middle line (N, 2) [m], and its first
        and its last node.
    """
    uses = Counter(node for street in streets for node in street.nodes)
    for street in streets:
        last = len(street.nodes) - 1
        cuts = [
            k
            for k, node in enumerate(street.nodes)
            if k in (0, last) or uses[node] > 1 or node in also
        ]
        for first, after in pairwise(cuts):
            ends = street.nodes[first], street.nodes[after]
            yield street, street.line[first : after + 1], ends


@dataclass(frozen=True)
class StreetPlaces:
    """Crossings, traffic signals and footpaths of a city.

    Attributes:
        crossed: nodes of streets at which people cross.
        signals: (N, 2) places of traffic signals [m].
        paths: middle lines of footpaths, (M, 2) each [m].
    """

    crossed: AbstractSet[int] = frozenset()
    signals: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    paths: Sequence[np.ndarray] = ()


@dataclass(frozen=True)
class ForeignCity:
    """The content of a city's file.

    Attributes:
        structures: the structures of the city.
        origin: origin of the map in the file's coordinates: metres east, north
            and up, or latitude and longitude [deg].
        reference_system: name of the reference system of the file's
            coordinates.
        faults: counts of parts that were repaired or left out. Small objects
            count as left out, until a dressed city places them.
        streets: streets with known lanes, in which drives are searched.
        street_places: crossings, traffic signals and footpaths.
        keeps_left: whether traffic keeps left.
        axes: description of the coordinates, if they are not metres east, north
            and up.
        things: small objects, which are placed in a dressed city only.
    """

    structures: list[Imported]
    origin: tuple[float, ...]
    reference_system: str
    faults: ImportFaults
    streets: Sequence[Street] = ()
    street_places: StreetPlaces = StreetPlaces()
    keeps_left: bool = False
    axes: tuple[str, ...] = ()
    things: Sequence[Thing] = ()


def make_imported(
    name: str,
    semantic_class: str,
    kind: str,
    surfaces: Mapping[str, np.ndarray],
    finishes: Mapping[str, Finish | None],
    year: int | None = None,
    until: int | None = None,
    tags: Mapping[str, str] | None = None,
    lod: float = 0.0,
    narrower: str = "",
) -> Imported:
    """Returns a structure made of triangles in the world.

    Args:
        name: name of the structure, unique in the city.
        semantic_class: a key of `cns_drake.scene.semantics.CLASS_IDS`.
        kind: type of the object in its file.
        surfaces: part of the surface -> triangles (M, 3, 3) [m]. Empty parts
            are left out; at least one part must not be empty.
        finishes: part of the surface -> its colour and material. Parts without
            an entry have the colour and material of the class.
        year: year in which the structure was built; None if unknown.
        until: year in which the structure was demolished; None if unknown.
        tags: tags of the object in its file.
        lod: level of detail of the object; 0 if unknown.
        narrower: kind of the structure, if the file is more specific than the
            type, such as `church` for a Building.
    """
    filled = {part: some for part, some in surfaces.items() if len(some)}
    triangles = np.concatenate(list(filled.values()))
    parts = []
    for part in filled:
        rgb, material = finishes.get(part) or (None, None)
        shape = MeshShape(f"{name}_{part}")
        parts.append(Part(part, shape, rgb=rgb, material=material))
    model = Model(
        tuple(parts),
        {f"{name}_{part}": to_mesh(some) for part, some in filled.items()},
        hull_of(triangles.reshape(-1, 3)[:, :2]),
    )
    structure = Structure(
        name,
        semantic_class,
        model,
        (0.0, 0.0, 0.0),
        kind=kind_word(narrower or kind),
    )
    return Imported(structure, kind, year, triangles, until, tags or {}, lod)


def kind_word(text: str) -> str:
    """Returns a type in a file as a kind, such as `water_body` for WaterBody.

    The kind consists of lower-case letters, digits and underscores.
    """
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", text).lower()
    return re.sub(r"[^a-z0-9]+", "_", words).strip("_")


def boxes_of(structures: Sequence[Imported]) -> np.ndarray:
    """Returns the bounding boxes (N, 2, 3) of structures [m].

    Each box is given by its least and its greatest coordinates.
    """
    return np.array(
        [
            (one.triangles.min(axis=(0, 1)), one.triangles.max(axis=(0, 1)))
            for one in structures
        ]
    )


def to_mesh(triangles: np.ndarray) -> Mesh:
    """Converts triangles (M, 3, 3) [m] to a mesh."""
    corners = np.arange(3 * len(triangles)).reshape(-1, 3)
    return Mesh(triangles.reshape(-1, 3), tuple(map(tuple, corners.tolist())))
