"""The section of a study's page that shows the results beside the paper's."""

from collections.abc import Mapping

from evaluation.paper.findings import aims, findings
from evaluation.paper.paper_values import (
    TITLE,
    Measured,
    Numbers,
    StagePair,
    paper,
)
from evaluation.recognition import MODES, QueryOutcomes, pr_curve
from evaluation.results import (
    OWN,
    STAGE,
    Key,
    PageSection,
    QueryRows,
    Results,
    in_table_order,
    page_section,
)


def paper_section(
    results: Results, queries: QueryRows, stages: Mapping[str, str]
) -> PageSection | None:
    """Returns the section; None if the study has none of the paper's maps.

    Place recognition is compared in rows by the protocol `paper`, without
    geometric verification.

    Args:
        results: the table of results.
        queries: the table of queries.
        stages: name of a drive -> its stage.
    """
    changes = _measured_changes(results, stages)
    measured = _measured(queries, stages)
    if not any(pair[0] in paper().city_names for pair in changes):
        return None
    compared = [one for one in measured if paper().is_comparable(one)]
    methods = in_table_order(one.method for one in compared)
    of_pair: dict[StagePair, dict[str, tuple[Numbers, Numbers | None]]] = {}
    for one in compared:
        numbers = paper().counted(one), paper().printed(one)
        of_pair.setdefault(one.pair, {})[one.method] = numbers
    judgements = [
        (f"What {TITLE} claims", findings(measured, changes)),
        (
            "How near to the paper's numbers, to which TCR_sym and the AUC of"
            " SOLiD were fitted",
            aims(measured, changes),
        ),
    ]
    return page_section(
        "paper",
        "Paper",
        "results.csv: the rows with the change, of place recognition by the"
        " protocol paper; the tables of the paper",
        changes=[
            (pair, value, paper().change(pair[0], pair[1:]))
            for pair, value in changes.items()
            if pair[1] < pair[2]
        ],
        methods=methods,
        modes=paper().modes,
        recognitions=of_pair,
        judgements=[(name, found) for name, found in judgements if found],
    )


def _measured_changes(
    results: Results, stages: Mapping[str, str]
) -> dict[StagePair, float]:
    """Returns TCR_sym of pairs of stages, in both orders."""
    rows = results.where({STAGE: OWN}, task="change", metric="tcr_sym").rows
    found = {}
    for row in rows:
        if (pair := _pair(row, stages)) is not None:
            found[pair] = found[pair[0], pair[2], pair[1]] = row.value
    return found


def _measured(queries: QueryRows, stages: Mapping[str, str]) -> list[Measured]:
    """Returns the results of place recognition with a change of the city."""
    return [
        Measured(
            pair,
            answers.label,
            answers.protocol,
            {
                mode: _numbers(
                    answers.outcomes.subset(answers.outcomes.has_match)
                    if mode == "filtered"
                    else answers.outcomes
                )
                for mode in MODES
            },
        )
        for answers in queries.answers
        if answers.task == "place"
        and not answers.verified
        and answers[STAGE] == OWN
        and answers.outcomes.has_match.any()
        and (pair := _pair(answers, stages)) is not None
    ]


def _pair(key: Key, stages: Mapping[str, str]) -> StagePair | None:
    """Returns map and stages; None for a drive that is compared with itself."""
    if key.database == key.query:
        return None
    return key.map, stages[key.database], stages[key.query]


def _numbers(counted: QueryOutcomes) -> Numbers:
    curve = pr_curve(counted)
    return Numbers(
        curve.auc,
        counted.recall_at(1),
        float(curve.f1.max(initial=0.0)),
    )
