"""The section with the places that each method found, without a baseline."""

from collections.abc import Iterable

from evaluation.results.keys import OWN, STAGE
from evaluation.results.method_names import title
from evaluation.results.page_frame import PageSection, page_section
from evaluation.results.table import Answers, QueryRows, Results


def lacks_baseline(results: Results) -> bool:
    """Returns whether drives are compared with a change, and never without."""
    return results.where(task="place").distinct(STAGE) == [OWN]


def found_section(queries: QueryRows) -> PageSection:
    """Returns who found how many of the places that both drives passed.

    A place is a query with a match. Only answers without geometric verification
    count, by the first protocol.
    """
    answers = [
        one
        for one in queries.answers
        if one.task == "place" and not one.verified
    ]
    digest = answers[0].protocol_digest if answers else ""
    answers = [one for one in answers if one.protocol_digest == digest]
    pairs = dict.fromkeys((one.database, one.query) for one in answers)
    of_method: dict[str, list[Answers]] = {}
    for one in answers:
        of_method.setdefault(one.label, []).append(one)
    rows = sorted(
        (
            (
                *_counted(some),
                title(name),
                [
                    _counted(
                        one for one in some if (one.database, one.query) == pair
                    )
                    for pair in pairs
                ],
            )
            for name, some in of_method.items()
        ),
        key=lambda row: (-row[0], row[2]),
    )
    return page_section(
        "found",
        "Found",
        "queries.csv: task place, verified 0, the first protocol",
        is_open=True,
        rows=rows,
        pairs=list(pairs),
    )


def _counted(answers: Iterable[Answers]) -> tuple[int, int]:
    """Returns how many queries are answered, and how many have a match."""
    columns = [one.columns for one in answers]
    return (
        sum(int(one["correct"].sum()) for one in columns),
        sum(int(one["has_match"].sum()) for one in columns),
    )
