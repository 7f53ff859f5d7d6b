"""The section of a study's page that shows the results beside the paper's."""

from collections.abc import Mapping

from evaluation.paper.paper_values import Numbers, StagePair, paper
from evaluation.results import (
    OWN,
    STAGE,
    Answers,
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
    changes = {}
    known, _ = results.defined()
    for row in known.where({STAGE: OWN}, metric="tcr_sym").rows:
        pair = _pair(row, stages)
        if pair is not None and pair[0] in paper().city_names:
            city, *both = pair
            changes[(city, *sorted(both))] = row.value
    if not changes:
        return None
    of_pair: dict[
        StagePair, dict[str, tuple[Numbers, Numbers | None, float | None]]
    ] = {}
    for answers in queries.answers:
        pair = _pair(answers, stages)
        if pair is None or not _is_comparable(answers):
            continue
        key = (*pair, answers.label)
        of_pair.setdefault(pair, {})[answers.label] = (
            _numbers(answers),
            paper().recognitions.get(key),
            paper().simulated_aucs.get(key),
        )
    return page_section(
        "paper",
        "Paper",
        "results.csv: the rows with the change, of place recognition by the"
        " protocol paper; the tables of the paper",
        changes=[
            (pair, value, *paper().change(pair[0], pair[1:]))
            for pair, value in changes.items()
        ],
        methods=in_table_order(n for found in of_pair.values() for n in found),
        recognitions=of_pair,
    )


def _is_comparable(answers: Answers) -> bool:
    """Returns whether the paper measured this method in this city, like that.

    Answers without a query that has a match are not comparable.
    """
    return (
        answers.task == "place"
        and answers.map in paper().city_names
        and answers.label in paper().modes
        and answers.protocol == "paper"
        and not answers.verified
        and answers[STAGE] == OWN
        and bool(answers.outcomes.has_match.any())
    )


def _pair(key: Key, stages: Mapping[str, str]) -> StagePair | None:
    """Returns map and stages; None for a drive that is compared with itself."""
    if key.database == key.query:
        return None
    return key.map, stages[key.database], stages[key.query]


def _numbers(answers: Answers) -> Numbers:
    """Returns the numbers, counted as the paper counted the method's."""
    counted = answers.outcomes
    if paper().modes[answers.label] == "filtered":
        counted = counted.subset(counted.has_match)
    curve = counted.curve
    return Numbers(curve.auc, counted.recall_at(1), curve.f1_max)
