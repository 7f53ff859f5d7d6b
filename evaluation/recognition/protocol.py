"""The protocol of place recognition: queries, places and matches."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
import math
from typing import TYPE_CHECKING, Any

from evaluation.base import InputError, no_such

if TYPE_CHECKING:
    import numpy as np

    from evaluation.drives import Drive, QuerySensor
    from evaluation.methods import Method, PlaceScan


# Fields that must be positive if they are given.
_POSITIVE = (
    "radius",
    "query_spacing",
    "place_spacing",
    "half_extent",
    "scans_per_place",
    "exclude_recent",
)
# Number of hexadecimal digits of a protocol's digest.
_DIGEST_LENGTH = 12
_QUERY_CHANGES = ("turn_queries", "tilt_queries", "hide_sector")


class ProtocolFieldError(InputError):
    """A field of a protocol is out of range.

    The message names the command-line option of the field.

    Attributes:
        field: name of the field.
        fault: the field's value, and what is wrong with it.
    """

    def __init__(self, field: str, fault: str):
        super().__init__(f"--{field.replace('_', '-')}: {fault}")
        self.field = field
        self.fault = fault

    def __reduce__(self) -> tuple[type[ProtocolFieldError], tuple[str, str]]:
        # Errors in jobs are sent to another process.
        return type(self), (self.field, self.fault)


@dataclass(frozen=True)
class RetrievalProtocol:
    """The protocol of place recognition: how two drives are compared.

    The defaults follow the paper, with queries as recorded. Only the default of
    `place` differs: which of the merged scans determines the pose of a place.

    Attributes:
        radius: greatest distance between a query and its match, in three
            dimensions [m].
        query_spacing: distance driven between two queries [m].
        place_spacing: distance driven between two places of the database [m].
        half_extent: greatest absolute x, y and z of a point in the sensor's
            frame [m]; points beyond this limit are left out.
        scans_per_place: number of consecutive scans that are merged into the
            described cloud; by default, each method uses its own number.
        place: which of the merged scans determines the pose of the place:
            `middle`; or `first`, as in the paper. A method's own parameter
            `place` overrides this value. With one scan per place there is no
            choice, and the value becomes None.
        exclude_recent: how long before a query the drive must have passed a
            place, so that the query is compared with this place [s]. None if
            two drives are compared.
        overlap: share of a query's scan, up to 1, that a place's scan must show
            so that the place is a match at any distance (see
            `evaluation.recognition.overlap_truth`). None if places within
            `radius` are matches.
        verified: whether geometric verification is used, which rejects
            top-ranked places that lie beyond the radius according to the
            method's own pose estimate.
        turn_queries: whether each query is rotated by a random yaw. Places stay
            as recorded.
        tilt_queries: largest random roll and pitch of the tilt of each query,
            from 0 to 90 [deg].
        hide_sector: angle of a random sector that is occluded in each query,
            from 0 to below 360 [deg].
        seed: seed of the random yaws, tilts and occluded sectors.

    Raises:
        InputError: a value is out of range; the message names the command-line
            option.

    Example:
        from evaluation import RetrievalProtocol

        print(RetrievalProtocol(radius=10.0).to_text())
    """

    radius: float = 7.5
    query_spacing: float = 10.0
    place_spacing: float = 5.0
    half_extent: float = 100.0
    scans_per_place: int | None = None
    place: PlaceScan | None = "middle"
    exclude_recent: float | None = None
    overlap: float | None = None
    verified: bool = False
    turn_queries: bool = False
    tilt_queries: float = 0.0
    hide_sector: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        for name in _POSITIVE:
            value = getattr(self, name)
            self._check(
                name, value is None or 0.0 < value < math.inf, "not positive"
            )
        is_part = self.overlap is None or 0.0 < self.overlap <= 1.0
        self._check("overlap", is_part, "not above 0 and up to 1")
        if self.place not in (None, "middle", "first"):
            raise ProtocolFieldError(
                "place", no_such("place", self.place, ("middle", "first"))
            )
        if self.scans_per_place == 1:
            # A single scan is the first and the middle one. Protocols that
            # differ only in this choice are equal, and have the same digest.
            object.__setattr__(self, "place", None)
        self._check(
            "tilt_queries",
            0.0 <= self.tilt_queries <= 90.0,
            "not from 0 to 90 deg",
        )
        self._check(
            "hide_sector",
            0.0 <= self.hide_sector < 360.0,
            "not from 0 to below 360 deg",
        )
        self._check("seed", self.seed >= 0, "negative")
        for name in ("verified", "turn_queries"):
            is_bool = getattr(self, name) in (True, False)
            self._check(name, is_bool, "neither True nor False")

    def _check(self, name: str, is_valid: bool, fault: str) -> None:
        """Refuses a value that is out of range.

        Args:
            is_valid: whether its value is in range.
            fault: what the value is otherwise, for the message.
        """
        if not is_valid:
            raise ProtocolFieldError(name, f"{getattr(self, name)} is {fault}")

    def scans(self, method: Method) -> int:
        """Returns how many scans are merged for one place.

        That is `scans_per_place` or, if it is None, the method's own number.
        """
        if self.scans_per_place is not None:
            return self.scans_per_place
        return method.scans_per_place

    def scans_before(self, method: Method) -> int:
        """Returns how many merged scans come before the scan of the place.

        The place's scan is the scan that gives the place its pose.
        """
        is_middle = self.of(method).place == "middle"
        return self.scans(method) // 2 if is_middle else 0

    def query_sensor(self, frame: int) -> QuerySensor | None:
        """Returns the sensor of a query; None if queries are as recorded.

        The sensor can have a random yaw, a tilt and an occluded sector.
        """
        if not self._changes_queries:
            return None
        from evaluation.drives import QuerySensor

        return QuerySensor.draw(
            self.seed,
            frame,
            self.turn_queries,
            self.tilt_queries,
            self.hide_sector,
        )

    def query_scan(self, drive: Drive, frame: int) -> np.ndarray:
        """Returns the scan (N, 3) of a query in its sensor's frame [m].

        The sensor is changed as by `query_sensor`.
        """
        from evaluation.drives import cloud_at

        sensor = self.query_sensor(frame)
        return cloud_at(drive, frame, 1, self.half_extent, sensor=sensor)

    def query_poses(self, X_WS: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """Returns the poses (Q, 4, 4) of the queries' sensors in the world.

        These poses differ from the recorded poses if the protocol gives queries
        a random yaw or a tilt.

        Args:
            X_WS: (Q, 4, 4) poses of the recorded sensor in the world.
            frames: (Q,) frame number of each query.
        """
        X_WQ = X_WS.copy()
        for row, frame in enumerate(frames.tolist()):
            sensor = self.query_sensor(frame)
            if sensor is not None and sensor.X_SQ is not None:
                X_WQ[row] = X_WS[row] @ sensor.X_SQ
        return X_WQ

    @property
    def name(self) -> str:
        """Name of the protocol: `random-yaw`, `paper`, `recorded` or `own`.

        The name is `own` if any field that changes a number, such as the radius
        or a spacing, differs from the shipped protocol. Geometric verification
        does not count, because tables have a column for it.
        """
        for name, shipped in PROTOCOLS.items():
            if shipped._counted_fields == self._counted_fields:
                return name
        return "own"

    def digest(self, **further: object) -> str:
        """Returns a hash of everything in the protocol that changes a number.

        Two results can be compared only if their protocols have the same
        digest. Geometric verification does not count, because tables have a
        column for it.

        Args:
            further: settings outside of the protocol that change a number, such
                as the height of the LiDAR.
        """
        # Imported here: it takes time, and options need only the fields.
        from evaluation.base import fingerprint

        return fingerprint({**self._counted_fields, **further})[:_DIGEST_LENGTH]

    @property
    def _counted_fields(self) -> dict[str, object]:
        """The fields that change a result: a mapping from name to value."""
        values = asdict(self)
        del values["verified"]
        if not self._changes_queries:
            values["seed"] = 0  # Nothing is random.
        # Digests in published tables were made with this name.
        values["max_range"] = values.pop("half_extent")
        return {
            name: float(value) if type(value) is int else value
            for name, value in values.items()
        }

    @property
    def _query_changes(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in _QUERY_FIELDS}

    @property
    def _changes_queries(self) -> bool:
        return any(getattr(self, name) for name in _QUERY_CHANGES)

    @property
    def verification_radius(self) -> float | None:
        """Radius of geometric verification [m]; None without it."""
        return self.radius if self.verified else None

    def of(self, method: Method) -> RetrievalProtocol:
        """Returns the protocol with a method's own choices filled in.

        A method can choose the number of scans per place, and which scan
        determines the pose of a place.
        """
        return replace(
            self,
            scans_per_place=self.scans(method),
            place=method.config.place or self.place,
        )

    def with_queries_of(self, other: RetrievalProtocol) -> RetrievalProtocol:
        """Returns the protocol with some options of another protocol.

        These are the options for random yaw, tilt and occluded sector of
        queries, their `seed`, and the choice of the scan that determines the
        pose of a place (`place`).
        """
        return replace(self, place=other.place, **other._query_changes)

    def descriptor_options(self, *, queries: bool = True) -> dict[str, object]:
        """Returns the options that affect descriptors, as name -> value.

        Args:
            queries: whether the drive has queries, and not only places.
        """
        values = asdict(self)
        unused = ["radius", "exclude_recent", "overlap", "verified"]
        if not (queries and self._changes_queries):
            unused += [*_QUERY_CHANGES, "seed"]
        for name in unused:
            del values[name]
        return values

    def to_json(self) -> dict[str, object]:
        """Returns all options of the protocol, as name -> value."""
        return asdict(self)

    def to_text(self) -> str:
        """Returns the protocol in a sentence."""
        match = f"a match within {self.radius:g} m"
        if self.overlap is not None:
            match = f"a match shows {self.overlap:.0%} of the query's scan"
        parts = [
            f"A query every {self.query_spacing:g} m, a place every"
            f" {self.place_spacing:g} m, {match},"
            f" points within {self.half_extent:g} m"
        ]
        if self.scans_per_place is not None:
            number = self.scans_per_place
            scans = "one scan" if number == 1 else f"{number} scans"
            parts.append(f"{scans} a place")
            if self.place is not None:
                parts.append(f"the {self.place} scan gives the pose")
        if self.exclude_recent is not None:
            parts.append(
                "of a drive against itself places passed at least"
                f" {self.exclude_recent:g} s before"
            )
        if self.turn_queries:
            parts.append("each query with a random yaw")
        if self.tilt_queries:
            parts.append(
                "each query tilted by a random roll and pitch of up to"
                f" {self.tilt_queries:g} deg"
            )
        if self.hide_sector:
            parts.append(
                f"a random sector of {self.hide_sector:g} deg occluded in each"
                " query"
            )
        if self._changes_queries:
            parts.append(f"seed {self.seed}")
        text = f"{', '.join(parts)}."
        if self.verified:
            text += f" {VERIFICATION_TEXT}"
        return text


# Geometric verification in words, for readers of a table.
VERIFICATION_TEXT = (
    "With geometric verification: each method's own pose says how far a place"
    " is from the query, and places beyond the radius are rejected."
)

RECORDED_PROTOCOL = RetrievalProtocol()

# The paper's protocol: queries are as recorded, and the first of the merged
# scans gives the pose. It serves only to compare with the paper's tables.
PAPER_PROTOCOL = RetrievalProtocol(place="first")

# The protocol of all studies. A random yaw of queries deprives methods of help
# from crops along the sensor's axes, voxel grids and streets at right angles.
# The random numbers must not change any more.
RANDOM_YAW_PROTOCOL = RetrievalProtocol(
    turn_queries=True, tilt_queries=1.5, seed=0
)

PROTOCOLS = {
    "random-yaw": RANDOM_YAW_PROTOCOL,
    "paper": PAPER_PROTOCOL,
    "recorded": RECORDED_PROTOCOL,
}
PROTOCOL_NAMES = (*PROTOCOLS, "own")
_QUERY_FIELDS = (*_QUERY_CHANGES, "seed")
