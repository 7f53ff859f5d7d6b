"""The reference of a report: published numbers and claims to check."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from evaluation.change.drive_change import ChangeResult
from evaluation.recognition.metrics import Mode
from evaluation.recognition.place_outcome import PlaceOutcome
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.results.table import Results, Row


@dataclass(frozen=True)
class Published:
    """Published numbers of a method on a pair of drives.

    Attributes:
        auc: area under the precision-recall curve.
        recall_at_1: R@1.
        f1_max: greatest F1 on the curve.
    """

    auc: float
    recall_at_1: float
    f1_max: float


@dataclass(frozen=True)
class Finding:
    """A published claim, and whether the numbers of a report confirm it.

    Attributes:
        claim: the claim in words.
        verdict: whether the claim is confirmed, in a word or two.
        evidence: the numbers behind the verdict, in words.
        table: table or figure of the publication that makes the claim; may be
            empty.
    """

    claim: str
    verdict: str
    evidence: str
    table: str = ""


@dataclass(frozen=True)
class Judgement:
    """Verdicts on several claims of one source.

    Attributes:
        heading: heading that names the source of the claims.
        findings: the claims with their verdicts.
    """

    heading: str
    findings: Sequence[Finding]


@dataclass(frozen=True, eq=False)
class Reference:
    """Published numbers and claims with which a report is compared.

    By default there are none.

    Attributes:
        title: the source's name in the report.
        counting: clause that says for which methods the source counted all
            queries, and for which methods only queries with a match; used only
            if there are published results.
        changes: (map, earlier stage, later stage) -> TCR_sym.
        further: (label, stages, TCR_sym) of pairs for which the source states
            only the change, and no results of place recognition.
        recognitions: (map, database, query, method, mode) -> numbers. The mode
            says which queries the source counted, see
            `PlaceRecognitionMetrics`; all results of a method have the same
            mode.
        protocols: method -> protocol by which the source ran the method,
            including the number of scans per place.
        judge: function that returns verdicts on all claims that a report's
            numbers can test. It takes two lists. The first list contains the
            results on pairs of drives by the report's own protocol, followed by
            the results by the source's protocol. The second list contains the
            changes between stages.
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
        [Sequence[PlaceOutcome], Sequence[ChangeResult]], list[Judgement]
    ] = lambda results, changes: []

    @property
    def city_names(self) -> set[str]:
        """Names of the maps with published place recognition."""
        return {city for city, *_ in self.recognitions}

    def change(self, map_name: str, stages: Sequence[str]) -> float | None:
        """Returns the published TCR_sym of two stages, given in any order."""
        first, second = sorted(stages)
        return self.changes.get((map_name, first, second))

    def further_changes(
        self, map_names: Iterable[str]
    ) -> Sequence[tuple[str, str, float]]:
        """Returns published changes of pairs without other published results.

        Each item is the label of the pair, its stages, and the symmetric
        temporal change ratio TCR_sym. The result is empty if the publication
        has none of the maps.
        """
        return () if self.city_names.isdisjoint(map_names) else self.further

    def protocol_of(
        self, map_name: str, database: str, query: str, method: str
    ) -> RetrievalProtocol | None:
        """Returns the protocol of a method's published results on a pair."""
        key = map_name, database, query, method
        if not any(known[:4] == key for known in self.recognitions):
            return None
        return self.protocols[method]

    def covers(self, result: PlaceOutcome) -> bool:
        """Returns whether a result can be compared with published results.

        The publication must have results on the same map, and of the same
        method by the same protocol.
        """
        return result.pair[0] in self.city_names and self._ran(result)

    def mode(self, method: str) -> Mode:
        """Returns which queries count in the published numbers of a method.

        The mode is `all`, or `filtered` for only the queries with a match. For
        a method without published numbers, the mode is `all`.
        """
        modes = (mode for *_, name, mode in self.recognitions if name == method)
        return next(modes, "all")

    def values(self, result: PlaceOutcome, mode: Mode) -> Published | None:
        """Returns the published numbers of a method on a pair of drives.

        Args:
            result: the result of the same method on the same pair.
            mode: which queries count: `all`, or only queries with a match
                (`filtered`).

        Returns:
            The numbers; None if the source has no numbers in this mode, or used
            another protocol than `result`.
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
        rows: list[Row] = []
        changed: set[tuple[str, str, str]] = set()
        for key, published in self.recognitions.items():
            city, database, query, method, _ = key
            row = Row(
                experiment=self.title,
                map=city,
                database=database,
                query=query,
                seed=0,
                factors={},
                task="place",
                method=method,
                gate=False,
                protocol="",
                metric="auc",
                value=published.auc,
            )
            rows.append(row)
            # The change of a pair does not depend on the method.
            change = self.change(city, (database, query))
            pair = city, database, query
            if change is not None and pair not in changed:
                changed.add(pair)
                rows.append(
                    replace(
                        row,
                        task="change",
                        method="",
                        metric="tcr_sym",
                        value=change,
                    )
                )
        return Results.of(rows)

    def _ran(self, result: PlaceOutcome) -> bool:
        """Returns whether the source ran the method by the same protocol."""
        protocol = replace(result.protocol, exclude_recent=None)
        return protocol == self.protocols.get(result.method)


NO_REFERENCE = Reference()
