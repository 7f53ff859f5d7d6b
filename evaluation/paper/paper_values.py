"""What the paper prints: the values of its tables, and how it counted."""

from collections.abc import Mapping, Sequence
import csv
from dataclasses import dataclass
import functools
from importlib import resources

from evaluation.recognition import Mode

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


@dataclass(frozen=True, eq=False)
class PaperValues:
    """The paper's values, and those of the shipped cities.

    Attributes:
        changes: (map, earlier stage, later stage) -> TCR_sym.
        recognitions: (map, database, query, method) -> numbers.
        simulated_changes, simulated_aucs: the same of the shipped cities.
        modes: method -> which queries the paper counted. The mode is `all`, or
            `filtered` for only the queries with a match.
    """

    changes: Mapping[StagePair, float]
    recognitions: Mapping[tuple[str, str, str, str], Numbers]
    simulated_changes: Mapping[StagePair, float]
    simulated_aucs: Mapping[tuple[str, str, str, str], float]
    modes: Mapping[str, Mode]

    @property
    def city_names(self) -> set[str]:
        """Names of the maps with place recognition."""
        return {city for city, *_ in self.recognitions}

    def change(
        self, map_name: str, stages: Sequence[str]
    ) -> tuple[float | None, float | None]:
        """Returns TCR_sym of two stages, given in any order.

        The first one is the paper's, the second one that of the shipped city.
        """
        first, second = sorted(stages)
        pair = map_name, first, second
        return self.changes.get(pair), self.simulated_changes.get(pair)


@functools.cache
def paper() -> PaperValues:
    """Returns the values that the paper prints.

    Two misprints are corrected, each with a note in its row: Table I gives
    Downtown 01-04 the value of 02-04, and one R@1 of RING++ on Riverside 02->01
    contradicts the F1 beside it. The paper does not state whether a method was
    scored on all queries or only on queries with a match (the mode, see
    `evaluation.recognition.Mode`). The mode is inferred from the relation
    between R@1, F1 and AUC in all rows of the method.
    """
    rows = _rows("place_recognition.csv")
    changes = {
        (row["map"], row["sequence_a"], row["sequence_b"]): row
        for row in _rows("tcr.csv")
    }
    return PaperValues(
        changes={pair: float(row["tcr_sym"]) for pair, row in changes.items()},
        recognitions={
            (row["map"], row["database"], row["query"], row["method"]): Numbers(
                float(row["auc"]),
                float(row["recall_at_1"]),
                float(row["f1_max"]),
            )
            for row in rows
        },
        simulated_changes={
            pair: float(row["simulated"])
            for pair, row in changes.items()
            if row["simulated"]
        },
        simulated_aucs={
            (row["map"], row["database"], row["query"], row["method"]): float(
                row["simulated_auc"]
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
