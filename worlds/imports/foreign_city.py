"""An imported city, independent of its file format."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from worlds.imports.faults import ImportFaults
from worlds.imports.imported_objects import ImportedObject
from worlds.imports.streets import Street


@dataclass(frozen=True)
class SmallObject:
    """A small object from a city's file, such as a bench.

    Attributes:
        source: id of the object in the file.
        element: type of the object in the file.
        kind: a key of `worlds.shapes.OBJECTS`.
        xy: position in W [m].
        yaw: heading in W [rad]; None if unknown.
        height: height of a tree [m]; None if unknown, or for other objects.
    """

    source: str
    element: str
    kind: str
    xy: tuple[float, float]
    yaw: float | None
    height: float | None = None


@dataclass(frozen=True)
class ForeignCity:
    """The content of a city's file.

    Attributes:
        objects: the objects of the city, each with its structure.
        origin: origin of the map in the file's coordinates: metres east, north
            and up, or latitude and longitude [deg].
        reference_system: name of the reference system of the file's
            coordinates.
        faults: counts of parts that were repaired or left out. Small objects
            count as left out, until a dressed city places them.
        streets: streets with known lanes, in which drives are searched.
        keeps_left: whether traffic keeps left.
        axes: description of the coordinates, if they are not metres east, north
            and up.
        small_objects: small objects, which are placed in a dressed city only.
        num_elements: number of elements of the file.
        sources: name of a structure -> id of its element in the file, where
            this is another name.
        level: height of the ground in W, if the format says that it is level
            [m]; None if objects say how high the ground is.
    """

    objects: list[ImportedObject]
    origin: tuple[float, ...]
    reference_system: str
    faults: ImportFaults
    num_elements: int
    streets: Sequence[Street] = ()
    keeps_left: bool = False
    axes: tuple[str, ...] = ()
    small_objects: Sequence[SmallObject] = ()
    level: float | None = None
    sources: Mapping[str, str] = field(default_factory=dict)

    def source_of(self, imported: ImportedObject) -> str:
        """Returns the id of an object, or of its original, in the file."""
        return self.sources.get(imported.draw_name, imported.draw_name)
