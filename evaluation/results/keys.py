"""Keys: where, under which condition and how something was measured.

Each row of `results.csv` and `queries.csv` contains a key. Its columns are the
attributes of `Key`, and one for each factor of the experiment. A factor is
named by the path of its field in the experiment's file, such as
`query.transient.snow`. The values of factors are numbers, text or truth values;
a cell is empty where a factor does not apply.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from operator import itemgetter
from typing import Any

from evaluation.base import InputError, __version__, did_you_mean
from evaluation.methods import SETTINGS
from evaluation.recognition import Metric, RetrievalProtocol

_BEFORE_FACTORS = ("experiment", "map", "database", "query", "seed")
_AFTER_FACTORS = ("task", "method", "verified", "protocol")
# Columns of a key that every table has.
NEEDED_KEYS = (*_BEFORE_FACTORS, *_AFTER_FACTORS)
# Columns that a table may lack; their values are then unknown.
OPTIONAL_KEYS = ("protocol_digest", "version")
KEYS = (*NEEDED_KEYS, *OPTIONAL_KEYS)
# Columns of a row behind its key.
MEASURED = ("metric", "value", "low", "high", "n")
# The last column of a row, in a table whose experiment names its baselines.
BASELINE = "baseline"
# A column before it: how the drives of a row came into one world.
WORLD = "world"
# Factor: the stage of the city in which both drives are.
STAGE = "both.stage"
# Its value if each drive is in its own stage.
OWN = "own"
# Its value if both drives are in the stage of the query.
LAST = "last"
# Factor: name of the protocol, if an experiment has several.
PROTOCOL_BASE = "protocol.base"
# The factor of the frozen redraws of the shipped maps.
FROZEN_REDRAW = "both.city.redraw.frozen"
# The factors of an experiment with cases: the name of the case, and its level.
CAUSE = "cause"
LEVEL = "level"
# The cause of the condition without a change.
NO_CAUSE = "none"
# Names that no factor can have.
RESERVED = frozenset(("label", *KEYS, *MEASURED, BASELINE, WORLD))


def check_metric_names(
    metrics: Iterable[Metric], factors: Iterable[str]
) -> None:
    """Checks that no metric has the name of a column.

    Raises:
        InputError: one has.
    """
    for metric in metrics:
        if metric.name in RESERVED or metric.name in factors:
            raise InputError(
                f"{metric.file}: {metric.name!r} is the name of a column of"
                " the tables; give the metric another name"
            )


def key_columns(factors: Iterable[str]) -> tuple[str, ...]:
    """Returns all columns of a key in the order of tables."""
    return (*_BEFORE_FACTORS, *factors, *_AFTER_FACTORS, *OPTIONAL_KEYS)


def check_columns(
    names: Iterable[str], rows: Sequence[Key], factors: Iterable[str] = ()
) -> None:
    """Checks that rows can have columns with given names.

    A factor with a dot in its name can be missing, and then counts as None.

    Args:
        names: the names.
        rows: rows of a table; if there are none, it can have any column. They
            are looked at only for names that not every table has.
        factors: factors that the table is known to have.

    Raises:
        InputError: there is no such column.
    """
    known = RESERVED.union((CAUSE, LEVEL), factors)
    for name in names:
        if name in known or "." in name or not rows:
            continue
        if not any(name in row.factors for row in rows):
            raise InputError(f"no column {name!r}{did_you_mean(name, known)}")


@dataclass(frozen=True)
class Key:
    """Where, under which condition and how something was measured.

    Attributes:
        experiment: name of the experiment.
        map: name of the map.
        database: name of the drive that makes the database.
        query: name of the drive whose scans are the queries.
        seed: seed of everything that is random.
        factors: name -> value of each factor of the experiment. A factor that
            does not apply is missing or None.
        task: `place`, `pose`, `localise`, `map`, `change`, `cost` or another.
        method: method, estimator or baseline; "" for the task `change`.
        verified: whether geometric verification rejected places, by the
            method's own pose.
        protocol: name of the protocol: `random-yaw`, `paper` or `recorded` for
            the shipped protocol as it is, and `own` for any other.
        protocol_digest: hash of everything in the protocol that changes a
            number, see `RetrievalProtocol.digest`; "" if unknown.
        version: version of this program; "" if unknown.
    """

    experiment: str
    map: str
    database: str
    query: str
    seed: int
    factors: Mapping[str, object]
    task: str
    method: str
    verified: bool
    protocol: str
    protocol_digest: str = field(default="", kw_only=True)
    version: str = field(default="", kw_only=True)

    def __getitem__(self, column: str) -> object:
        """Returns the value of a column or of `label`; None if unknown."""
        if column in RESERVED:
            return getattr(self, column, None)
        return self.factors.get(column)

    @property
    def label(self) -> str:
        """Name of the method, with its settings that are factors."""
        start = f"{SETTINGS}{self.method}."
        settings = (
            f"{name.removeprefix(start)} {value}"
            for name, value in self.factors.items()
            if name.startswith(start) and value is not None
        )
        return ", ".join((self.method, *settings))

    @property
    def identity(self) -> tuple[object, ...]:
        """All values except the version: equal for equal conditions."""
        return self.without()

    def without(self, *names: str) -> tuple[object, ...]:
        """Returns the key without some columns, so that rows can be grouped.

        If two rows have the same reduced key, they were measured under
        conditions that differ only in the columns left out.

        Args:
            names: names of the columns to leave out. With `method`, settings of
                methods, such as `methods.ring++.crop`, are left out as well.
                With `protocol` or a field of the protocol, such as
                `protocol.radius`, name and digest of the protocol are left out.
                The version is never part of the key.

        Returns:
            The values of the remaining columns, in a fixed order.
        """
        if any(name.partition(".")[0] == "protocol" for name in names):
            names = (*names, "protocol", "protocol_digest")
        known = [name for name in KEYS if name not in (*names, "version")]
        without_settings = "method" in names
        applying = (
            (name, value)
            for name, value in self.factors.items()
            if value is not None
            and name not in names
            and not (without_settings and name.startswith(SETTINGS))
        )
        return (
            *(getattr(self, n) for n in known),
            *sorted(applying, key=itemgetter(0)),
        )


def made_by(
    protocol: RetrievalProtocol, settings: Mapping[str, object] | None = None
) -> dict[str, Any]:
    """Returns the columns of a `Key` that say how something was measured.

    Args:
        protocol: the protocol.
        settings: name -> value of the settings that affect results, are no part
            of the protocol, and differ from their defaults.

    Returns:
        `protocol`, `protocol_digest` and `version`. With settings, the protocol
        is `own`.
    """
    return {
        "protocol": "own" if settings else protocol.name,
        "protocol_digest": protocol.digest(**(settings or {})),
        "version": __version__,
    }
