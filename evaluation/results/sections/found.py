"""The section with the places that each method found, without a baseline."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

from evaluation.results.keys import OWN, STAGE
from evaluation.results.method_names import title
from evaluation.results.page_frame import PageSection, page_section
from evaluation.results.table import Answers, QueryRows, Results


def lacks_baseline(results: Results) -> bool:
    """Returns whether drives are compared with a change, and never without."""
    return results.where(task="place").distinct(STAGE) == [OWN]


class _Found(NamedTuple):
    """How many places a method found, and how many there are.

    Attributes:
        found, number: in all pairs of drives.
        of_pairs: found and number in each pair.
    """

    found: int
    number: int
    name: str
    of_pairs: list[tuple[int, int]]


def found_section(queries: QueryRows) -> PageSection:
    """Returns who found how many of the places that both drives passed.

    A place is a query with a match. Only answers without geometric verification
    count, by the first protocol.
    """
    pairs, rows = _found_places(queries)
    return page_section(
        "found",
        "Found",
        "queries.csv: task place, verified 0, the first protocol",
        is_open=True,
        rows=rows,
        pairs=pairs,
    )


def found_lines(queries: QueryRows) -> Iterator[str]:
    """Yields the lines of the section's table, for a terminal."""
    _, rows = _found_places(queries)
    width = max(len(one.name) for one in rows)
    yield f"Places found, of {rows[0].number}"
    for one in rows:
        yield f"{one.name:<{width}}  {one.found}"
    yield ""


def _found_places(
    queries: QueryRows,
) -> tuple[list[tuple[str, str]], list[_Found]]:
    """Returns the pairs of drives, and what methods found, the most first."""
    answers = [
        one
        for one in queries.answers
        if one.task == "place" and not one.verified
    ]
    answers = [
        one
        for one in answers
        if one.protocol_digest == answers[0].protocol_digest
    ]
    pairs = list(dict.fromkeys((one.database, one.query) for one in answers))
    of_method: dict[str, list[Answers]] = {}
    for one in answers:
        of_method.setdefault(one.label, []).append(one)
    found = [
        _Found(
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
    ]
    return pairs, sorted(found, key=lambda one: (-one.found, one.name))


def _counted(answers: Iterable[Answers]) -> tuple[int, int]:
    """Returns how many queries are answered, and how many have a match."""
    columns = [one.columns for one in answers]
    return (
        sum(int(one["correct"].sum()) for one in columns),
        sum(int(one["has_match"].sum()) for one in columns),
    )
