"""All methods find the places of a query drive in a database.

Each method has two results, without the gate and with it.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from cns_drake.base.jobs.step import Reporter
from evaluation.methods.method import Method
from evaluation.recognition import description
from evaluation.recognition.costs import query_ms
from evaluation.recognition.overlap_truth import best_overlaps
from evaluation.recognition.place_outcome import PlaceOutcome
from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.recognition.retrieval import compare_with_gates
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
TIMED = 9
_LONGEST_MS = 3.6e6
# Places that no method is known to take so long for.
_MANY = 5000


def measure_places(
    reporter: Reporter,
    database: DescribedSource,
    query: DescribedSource,
    distractors: tuple[tuple[Part, ...], ...],
    num_distractors: int,
    methods: tuple[MethodChoice, ...],
    protocol: RetrievalProtocol,
) -> list[PlaceOutcome]:
    """Returns two outcomes of each method, without the gate and with it.

    A method that would take over an hour for all queries has no outcome.

    Args:
        reporter: reports progress.
        database: described drive of the places.
        query: described drive in the same world, whose scans ask.
        distractors: described drives through other cities, one part for each
            method.
        num_distractors: number of their places that are added to the database.
        methods: the methods.
        protocol: the protocol of the comparison.
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
        known = [mapped]
        for parts in distractors:
            if sum(len(d.places.frames) for d in known[1:]) >= num_distractors:
                break
            known.append(parts[k].read()[1])
        searched = replace(
            mapped,
            places=joined_places(
                [one.places for one in known], num_distractors
            ),
        )
        drives = [one.name for one in known for _ in one.places.frames]
        if len(searched.places.frames) > _MANY and _takes_long(
            method, searched, asked
        ):
            reporter.note(f"{choice.name}: it would take over an hour")
            continue
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
            PlaceOutcome.of(
                choice.key,
                is_gated,
                one,
                (asked.queries.stamps_ns, asked.queries.p_WSs),
                drives,
                overlaps,
                protocol.radius,
            )
            for is_gated, one in zip((False, True), both, strict=True)
        ]
    return outcomes


def _takes_long(
    method: Method,
    database: description.DescribedDrive,
    query: description.DescribedDrive,
) -> bool:
    one_ms = query_ms(
        method, database.places, query.queries, TIMED + 1, with_pose=False
    )
    return one_ms * len(query.queries.frames) > _LONGEST_MS


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
        keys=[choice.key for choice in methods],
    )
    assert isinstance(found.scans, list)
    return found.scans, lambda k: found.described.pop(methods[k].key)


def joined_places(
    drives: Sequence[description.DescribedScans], num_others: int
) -> description.DescribedScans:
    """Returns the places of a drive together with those of other drives.

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
