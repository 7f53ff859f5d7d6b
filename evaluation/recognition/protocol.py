"""The protocol of place recognition: queries, places and matches."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields, replace
import math
from typing import TYPE_CHECKING

from cns_drake.base.errors import InputError

if TYPE_CHECKING:
    from evaluation.methods.method import Method


@dataclass(frozen=True)
class RetrievalProtocol:
    """The protocol of a comparison of two drives; by default the paper's.

    Attributes:
        radius: greatest distance of a match from its query [m].
        query_spacing: between two queries, along the path [m].
        place_spacing: likewise between two places of the database [m].
        max_range: points with a greater x, y or z in the sensor's frame are
            left out [m].
        scans_per_place: number of consecutive scans that are merged into the
            described cloud; None for each method's own number.
        exclude_recent: for a drive against itself: only places count that it
            passed at least this long before [s]. None for two drives.
        overlap: a place is a match at any distance if its scan shows at least
            this part of the query's scan (see `overlap_truth`), up to 1; None
            for matches by the radius.
        gate: whether to reject those of a query's best places that the method's
            own pose puts farther away than the radius, see `gate`.

    Raises:
        InputError: if a value is not positive, with the option that it has
            on the command line.

    Example:
        from evaluation import RetrievalProtocol

        print(RetrievalProtocol(radius=10.0).to_text())
    """

    radius: float = 7.5
    query_spacing: float = 10.0
    place_spacing: float = 5.0
    max_range: float = 100.0
    scans_per_place: int | None = None
    exclude_recent: float | None = None
    overlap: float | None = None
    gate: bool = False

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if name == "gate" or value is None:
                continue
            if not 0.0 < value < math.inf:
                option = name.replace("_", "-")
                raise InputError(f"--{option}: {value} is not positive")

    def scans(self, method: Method) -> int:
        """Returns the number of scans of a method's place."""
        if self.scans_per_place is not None:
            return self.scans_per_place
        return method.scans_per_place

    def scans_before(self, method: Method) -> int:
        """Returns how many scans of a method's place come before its own."""
        return self.scans(method) // 2 if method.is_centred else 0

    @property
    def gate_radius(self) -> float | None:
        """The radius that the gate compares with [m]; None without a gate."""
        return self.radius if self.gate else None

    def of(self, method: Method) -> RetrievalProtocol:
        """Returns the protocol of a method's run, without open choices."""
        return replace(self, scans_per_place=self.scans(method))

    def described(self) -> dict[str, float | int | None]:
        """Returns the options that the descriptions of a drive depend on."""
        values = asdict(self)
        for name in ("radius", "exclude_recent", "overlap", "gate"):
            del values[name]
        return values

    def to_json(self) -> dict[str, float | int | None]:
        """Returns all numbers of the protocol, by their names."""
        return asdict(self)

    def to_text(self) -> str:
        """Returns a sentence."""
        match = f"a match within {self.radius:g} m"
        if self.overlap is not None:
            match = f"a match shows {self.overlap:.0%} of the query's scan"
        parts = [
            f"A query every {self.query_spacing:g} m, a place every"
            f" {self.place_spacing:g} m, {match},"
            f" points within {self.max_range:g} m"
        ]
        if self.scans_per_place is not None:
            number = self.scans_per_place
            scans = "one scan" if number == 1 else f"{number} scans"
            parts.append(f"{scans} a place")
        if self.exclude_recent is not None:
            parts.append(
                "of a drive against itself places passed at least"
                f" {self.exclude_recent:g} s before"
            )
        text = f"{', '.join(parts)}."
        if self.gate:
            text += f" {GATE_TEXT}"
        return text


# The gate in words, for readers of a table.
GATE_TEXT = (
    "With the gate: each method's own pose says how far a place is from the"
    " query, and places beyond the radius are rejected."
)

# The defaults, which are the paper's.
PAPER_PROTOCOL = RetrievalProtocol()

# Columns of a table of results: the options of the protocol. Tables are made
# without matches by overlap.
PROTOCOL_COLUMNS = tuple(
    one.name for one in fields(RetrievalProtocol) if one.name != "overlap"
)
