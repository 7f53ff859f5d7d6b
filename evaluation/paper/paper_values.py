"""What the paper prints: the values of its tables, and how it counted."""

from collections.abc import Mapping, Sequence
import csv
from dataclasses import dataclass
import functools
from importlib import resources

from evaluation.recognition import Mode

TITLE = "the paper “The City that Never Settles”"
# Drives through a real city in the paper's tables.
KAIST = ("kaist", "01", "06")
# Name of a map, and the stages of database and query.
StagePair = tuple[str, str, str]


@dataclass(frozen=True)
class Numbers:
    """Numbers of a method on a pair of drives, which the paper prints.

    Attributes:
        auc: area under the precision-recall curve.
        recall_at_1: R@1.
        f1_max: greatest F1 on the curve.
    """

    auc: float
    recall_at_1: float
    f1_max: float


@dataclass(frozen=True)
class Measured:
    """The same numbers as a study measured them.

    Attributes:
        pair: name of the map, and the stages of database and query.
        method: name of the method, with its settings if it has any.
        protocol: name of the protocol.
        by_mode: which queries count -> the numbers.
    """

    pair: StagePair
    method: str
    protocol: str
    by_mode: Mapping[Mode, Numbers]


@dataclass(frozen=True, eq=False)
class PaperValues:
    """The paper's values.

    Attributes:
        changes: (map, earlier stage, later stage) -> TCR_sym.
        recognitions: (map, database, query, method) -> numbers.
        modes: method -> which queries the paper counted. The mode is `all`, or
            `filtered` for only the queries with a match.
    """

    changes: Mapping[StagePair, float]
    recognitions: Mapping[tuple[str, str, str, str], Numbers]
    modes: Mapping[str, Mode]

    @property
    def city_names(self) -> set[str]:
        """Names of the maps with place recognition."""
        return {city for city, *_ in self.recognitions}

    def change(self, map_name: str, stages: Sequence[str]) -> float | None:
        """Returns TCR_sym of two stages, given in any order."""
        first, second = sorted(stages)
        return self.changes.get((map_name, first, second))

    def is_comparable(self, measured: Measured) -> bool:
        """Returns whether the paper measured the same, with its protocol.

        The paper must have results on the same map, and of the same method.
        """
        return (
            measured.pair[0] in self.city_names
            and measured.method in self.modes
            and measured.protocol == "paper"
        )

    def counted(self, measured: Measured) -> Numbers:
        """Returns our numbers, counted as the paper counted the method's."""
        return measured.by_mode[self.modes[measured.method]]

    def printed(self, measured: Measured) -> Numbers | None:
        """Returns the paper's numbers of the same method on the same pair."""
        return self.recognitions.get((*measured.pair, measured.method))

    def auc_over_change(self, method: str) -> list[tuple[float, float]]:
        """Returns the points (TCR_sym, AUC) of a method."""
        return [
            (change, value.auc)
            for (city, *stages, name), value in self.recognitions.items()
            if name == method
            and (change := self.change(city, stages)) is not None
        ]


@functools.cache
def paper() -> PaperValues:
    """Returns the values that the paper prints.

    Two misprints are corrected, each with a note in its row: Table I gives
    Downtown 01-04 the value of 02-04, and one R@1 of RING++ on Riverside 02->01
    contradicts the F1 beside it. The paper does not state whether a method was
    scored on all queries or only on queries with a match (the mode, see
    `PlaceRecognitionMetrics`). The mode is inferred from the relation between
    R@1, F1 and AUC in all rows of the method.
    """
    rows = _rows("place_recognition.csv")
    return PaperValues(
        changes={
            (row["map"], row["sequence_a"], row["sequence_b"]): float(
                row["tcr_sym"]
            )
            for row in _rows("tcr.csv")
        },
        recognitions={
            (row["map"], row["database"], row["query"], row["method"]): Numbers(
                float(row["auc"]),
                float(row["recall_at_1"]),
                float(row["f1_max"]),
            )
            for row in rows
        },
        modes={
            row["method"]: "filtered" if row["mode"] == "filtered" else "all"
            for row in rows
        },
    )


def _rows(name: str) -> list[dict[str, str]]:
    text = resources.files(__package__).joinpath(name).read_text("utf-8")
    return list(csv.DictReader(text.splitlines()))
