"""One rung of a ladder: all methods find a query drive in a database.

Each method has two results, without the gate and with it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
import math
from typing import TypeAlias

import numpy as np

from cns_drake.base.jobs.step import Reporter
from evaluation.recognition import description
from evaluation.recognition.costs import cpu_ms, query_ms
from evaluation.recognition.metrics import pr_curve
from evaluation.recognition.overlap_truth import best_overlaps
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.recognition.query_outcomes import judge
from evaluation.recognition.retrieval import compare, compare_with_gates
from evaluation.recognition.rung_outcome import RungOutcome
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.parts import Part
from evaluation.study.surveys import DriveSource, survey_recording

# The source of a drive, or the parts of its scans and of its descriptions by
# each method.
DescribedSource: TypeAlias = "DriveSource | tuple[Part, ...]"

# Distance between a city and the next distracting one [m]. No scan reaches so
# far.
_APART = 1e5
# Queries whose time is measured, and the longest time for all queries at a size
# [ms].
_TIMED = 9
_LONGEST_MS = 3.6e6


def measure_rung(
    reporter: Reporter,
    database: DescribedSource,
    query: DescribedSource,
    distractors: tuple[tuple[Part, ...], ...],
    num_distractors: int,
    methods: tuple[MethodChoice, ...],
    protocol: RetrievalProtocol,
) -> list[RungOutcome]:
    """Returns the outcomes of a rung, two for each method.

    The drives are in one world. A number of places of distractors, described
    drives through other cities, is added to the database.
    """
    place_scans, places = _describe(
        database, "places", methods, protocol, reporter
    )
    query_scans, queries = _describe(
        query, "queries", methods, protocol, reporter
    )
    overlaps = None
    outcomes = []
    for k, choice in enumerate(
        reporter.track(methods, "comparing", len(methods))
    ):
        method = choice.make()
        mapped, asked = places(k), queries(k)
        known = [mapped, *(parts[k].read()[1] for parts in distractors)]
        searched = replace(
            mapped,
            places=joined_places(
                [one.places for one in known], num_distractors
            ),
        )
        drives = [one.name for one in known for _ in one.places.frames]
        both = compare_with_gates(
            method, searched, asked, protocol, [None, protocol.radius]
        )
        if overlaps is None:
            overlaps = best_overlaps(
                place_scans,
                mapped.places.X_WS,
                query_scans,
                asked.queries.X_WS,
                both[0].matches[:, : len(place_scans)],
            )
        outcomes += [
            RungOutcome.of(choice.name, is_gated, one, asked, drives, overlaps)
            for is_gated, one in zip((False, True), both, strict=True)
        ]
    return outcomes


def _describe(
    drive: DescribedSource,
    role: description.Role,
    methods: tuple[MethodChoice, ...],
    protocol: RetrievalProtocol,
    reporter: Reporter,
) -> tuple[list[np.ndarray], Callable[[int], description.DescribedDrive]]:
    """Returns the scans of a drive, and what gives each description once."""
    if isinstance(drive, tuple):
        scans, *parts = drive
        return scans.read(), lambda k: parts[k].read()[1]
    found = survey_recording(
        drive(),
        {role},
        [choice.make() for choice in methods],
        protocol,
        reporter.track,
        with_scans=True,
        with_map=False,
    )
    assert isinstance(found.scans, list)
    return found.scans, lambda k: found.described.pop(methods[k].name)


def joined_places(
    drives: Sequence[description.DescribedScans], num_others: int
) -> description.DescribedScans:
    """Returns the places of a drive together with places of others.

    The first drive is that of the query's world. The others are moved so far
    away that none of their places is a match. They add `num_others` places at
    most, from the first one on.
    """
    first, *others = drives
    poses = [first.X_WS]
    for number, one in enumerate(others, start=1):
        X_WS = one.X_WS.copy()
        X_WS[:, 0, 3] += number * _APART
        poses.append(X_WS)
    end = len(first.frames) + num_others
    return description.DescribedScans(
        frames=np.concatenate([one.frames for one in drives])[:end],
        stamps_ns=np.concatenate([one.stamps_ns for one in drives])[:end],
        X_WS=np.concatenate(poses)[:end],
        descriptors=[d for one in drives for d in one.descriptors][:end],
        clouds=[cloud for one in drives for cloud in one.clouds][:end],
    )


@dataclass(frozen=True)
class SizePoint:
    """A method in a database with places of other cities.

    Times are of the processor [ms]: the median of some queries, and for the
    database from descriptions. The AUC is without the gate; NaN if all queries
    would take over an hour.
    """

    method: str
    others: int
    places: int
    queries: int
    auc: float
    r1: float
    query_ms: float
    build_ms: float


def measure_size(
    reporter: Reporter,
    database: Part,
    query: Part,
    distractors: tuple[Part, ...],
    num_distractors: int,
    choice: MethodChoice,
    protocol: RetrievalProtocol,
) -> SizePoint:
    """Returns the point of a method that described these drives.

    The distractors lead through other cities.
    """
    method = choice.make()
    (_, mapped), (_, asked) = database.read(), query.read()
    known = [mapped.places]
    for part in distractors:
        if sum(len(one.frames) for one in known[1:]) >= num_distractors:
            break
        known.append(part.read()[1].places)
    places = joined_places(known, num_distractors)
    number = len(asked.queries.frames)
    build_ms = cpu_ms(method.build_database, places.descriptors)
    one_ms = query_ms(
        method, places, asked.queries, _TIMED + 1, with_pose=False
    )
    auc = r1 = math.nan
    if one_ms * number <= _LONGEST_MS:
        found = compare(
            method,
            replace(mapped, places=places),
            asked,
            replace(protocol, gate=False),
            reporter.track,
        )
        outcomes = judge(found.scores, found.matches)
        auc, r1 = pr_curve(outcomes).auc, float(outcomes.recall_at(1))
    return SizePoint(
        method.name,
        len(places.frames) - len(mapped.places.frames),
        len(places.frames),
        number,
        float(auc),
        r1,
        one_ms,
        build_ms,
    )
