"""The reference of a report: published numbers and claims to check."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from evaluation.change.drive_change import ChangeResult
from evaluation.recognition.metrics import Mode
from evaluation.recognition.place_recognition import PlaceRecognition
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.results.table import Results, Row


@dataclass(frozen=True)
class Published:
    """Published numbers of a method on a pair of drives."""

    auc: float
    recall_at_1: float
    f1_max: float


@dataclass(frozen=True)
class Finding:
    """A claim, its verdict by our numbers, and the table that has them."""

    claim: str
    verdict: str
    evidence: str
    table: str = ""


@dataclass(frozen=True)
class Judgement:
    """Findings under a heading that says whose claims they test."""

    heading: str
    findings: Sequence[Finding]


@dataclass(frozen=True, eq=False)
class Reference:
    """Published numbers and claims; without arguments it has none.

    Attributes:
        title: the source's name in the report.
        counting: the modes in which the source counted its methods, in words;
            used only if something is published.
        changes: (map, earlier stage, later stage) -> TCR_sym.
        further: changes elsewhere to compare with: label, stages and TCR_sym.
        recognitions: (map, database, query, method, mode) -> numbers; each
            method has one mode.
        protocols: method -> how the source ran it, its number of scans
            included.
        judge: function that returns verdicts on all claims that our numbers
            allow to check. It takes the results of a report, the results that
            the report repeated by the source's protocol, and the changes.
    """

    title: str = ""
    counting: str = ""
    changes: Mapping[tuple[str, str, str], float] = field(default_factory=dict)
    further: Sequence[tuple[str, str, float]] = ()
    recognitions: Mapping[tuple[str, str, str, str, Mode], Published] = field(
        default_factory=dict
    )
    protocols: Mapping[str, RetrievalProtocol] = field(default_factory=dict)
    judge: Callable[
        [Sequence[PlaceRecognition], Sequence[ChangeResult]], list[Judgement]
    ] = lambda results, changes: []

    @property
    def city_names(self) -> set[str]:
        """Names of the maps with published place recognition."""
        return {key[0] for key in self.recognitions}

    def compares_back(self, map_name: str, earlier: str, last: str) -> bool:
        """Returns whether the reference also queries the last stage's map.

        The earlier stage is then the query.
        """
        pair = (map_name, last, earlier)
        return any(key[:3] == pair for key in self.recognitions)

    def change(self, map_name: str, stages: Sequence[str]) -> float | None:
        """Returns the published TCR_sym of a pair of stages, in any order."""
        first, second = sorted(stages)
        return self.changes.get((map_name, first, second))

    def further_changes(
        self, map_names: Iterable[str]
    ) -> Sequence[tuple[str, str, float]]:
        """Returns the published changes without place recognition.

        Only a report on a map of the source shows them.
        """
        return () if self.city_names.isdisjoint(map_names) else self.further

    def protocol_of(
        self, map_name: str, database: str, query: str, method: str
    ) -> RetrievalProtocol | None:
        """Returns the protocol of a method's published numbers of a pair."""
        key = map_name, database, query, method
        if not any(known[:4] == key for known in self.recognitions):
            return None
        return self.protocols[method]

    def covers(self, result: PlaceRecognition) -> bool:
        """Returns whether map, method and protocol are the source's."""
        return result.pair[0] in self.city_names and self._ran(result)

    def mode(self, method: str) -> Mode:
        """Returns in which mode the reference counts a method."""
        modes = (key[4] for key in self.recognitions if key[3] == method)
        return next(modes, "all")

    def values(self, result: PlaceRecognition, mode: Mode) -> Published | None:
        """Returns the published numbers, if they were counted in this mode.

        Returns None for numbers that were measured by another protocol.
        """
        if not self._ran(result):
            return None
        return self.recognitions.get((*result.pair, result.method, mode))

    def auc_over_change(self, method: str) -> list[tuple[float, float]]:
        """Returns the published points (TCR_sym, AUC) of a method."""
        return [
            (change, value.auc)
            for (city, *stages, name, _), value in self.recognitions.items()
            if name == method
            and (change := self.change(city, stages)) is not None
        ]

    def to_results(self) -> Results:
        """Returns the published AUC and TCR_sym of all pairs as a table."""
        rows = []
        for key, value in self.recognitions.items():
            city, *stages, method, _ = key
            where: dict[str, Any] = {
                **dict(zip(("database", "query"), stages, strict=True)),
                **{"experiment": self.title, "map": city, "seed": 0},
                **{"factors": {}, "gate": False, "protocol": ""},
            }
            place: dict[str, Any] = {"task": "place", "method": method}
            rows.append(Row(**where, **place, metric="auc", value=value.auc))
            if (change := self.change(city, stages)) is not None:
                whole: dict[str, Any] = {"task": "change", "method": ""}
                whole |= {"metric": "tcr_sym", "value": change}
                rows.append(Row(**where, **whole))
        return Results.of(rows)

    def _ran(self, result: PlaceRecognition) -> bool:
        """Returns whether the source ran the method by the same protocol."""
        protocol = replace(result.protocol, exclude_recent=None)
        return protocol == self.protocols.get(result.method)


NO_REFERENCE = Reference()
