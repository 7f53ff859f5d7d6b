"""The report of an import: what was imported, and its faults."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from worlds.imports.faults import FaultCount, Share

# File in the map's folder that lists all counts of an import.
REPORT_NAME = "import.txt"


@dataclass(frozen=True)
class ImportReport:
    """The result of an import.

    Attributes:
        kinds: type of object -> number of structures.
        triangles: number of triangles.
        stages: name of a stage -> number of its structures.
        undated: number of buildings without a year.
        dated: number of buildings with a year.
        drives: lengths of the proposed drives [m].
        faults: counts of the repaired and omitted parts of the file, most
            frequent first.
        parts: lines on the parts of elements that are read, or that change no
            shape.
        num_elements: number of elements of the file.
        num_built: number of those of which something is in the city.
        shares: kind of fault -> share of the world that it concerns.
    """

    kinds: dict[str, int]
    triangles: int
    stages: dict[str, int]
    undated: int
    dated: int
    drives: tuple[float, ...]
    faults: list[FaultCount]
    parts: list[str]
    num_elements: int
    num_built: int
    shares: Mapping[str, Share] = field(default_factory=dict)

    def told_built(self) -> str:
        """Returns how much of the file is in the city, in words."""
        share = Share(
            self.num_built / max(self.num_elements, 1),
            "the elements of the file",
        )
        return (
            f"in the city: {self.num_built} of {self.num_elements} elements of"
            f" the file ({share.percent})"
        )

    def told(self, fault: FaultCount) -> str:
        """Returns the number of a fault in words, with its share."""
        return f"{fault.number}, {self.shares[fault.kind]}"
