"""The tables of a ladder, as its files have them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from evaluation.recognition.protocol import RetrievalProtocol
from evaluation.recognition.rung_outcome import FAULTS
from evaluation.report.ladder_rows import LadderRow, LadderRung, MeasuredRung
from evaluation.report.tables import Table

_KEYS = ("map", "db", "query", "cause", "level", "method", "gate")
# The options of the protocol that all rungs share.
_OPTIONS = ("query_spacing", "place_spacing", "max_range")


def ladder_table(
    rows: Iterable[LadderRow], protocol: RetrievalProtocol
) -> Table:
    """Returns one row for each rung, method and gate."""
    return Table(
        (
            *_KEYS,
            "auc",
            "r1",
            "kept",
            "kept_low",
            "kept_high",
            "auc_low",
            "auc_high",
            "auc_none",
            "queries",
            "with_match",
            "places",
            "draws",
            "drives",
            "lost",
            "found",
            "hidden",
            "overlap",
            *FAULTS,
            "strength",
            "radius",
            *_OPTIONS,
        ),
        tuple(
            (
                *_keys(one.rung, one.method, one.is_gated),
                one.auc,
                one.r1,
                one.kept.share,
                one.kept.interval.low,
                one.kept.interval.high,
                one.auc_interval.low,
                one.auc_interval.high,
                one.kept.unchanged,
                one.queries,
                one.with_match,
                one.places,
                one.draws,
                one.drives,
                one.lost,
                one.found,
                one.hidden,
                one.overlap,
                *(one.faults[name] for name in FAULTS),
                one.rung.strength,
                one.rung.radius,
                *_options(protocol),
            )
            for one in rows
        ),
    )


def ladder_query_table(measured: Iterable[MeasuredRung]) -> Table:
    """Returns one row for each rung, draw, method, gate and query."""
    return Table(
        (
            *_KEYS,
            "seed",
            "query_frame",
            "query_stamp_ns",
            "query_x",
            "query_y",
            "query_z",
            "correct",
            "has_match",
            "score",
            "first_right_rank",
            "why",
            "match_drive",
            "match_frame",
            "distance",
            "translation_error",
            "rotation_error_deg",
            "overlap",
        ),
        tuple(row for one in measured for row in _query_rows(one)),
    )


def _query_rows(measured: MeasuredRung) -> Iterator[tuple[object, ...]]:
    for one in measured.outcomes:
        keys = _keys(measured.rung, one.method, one.is_gated)
        judged = one.outcomes
        faults = one.faults(measured.rung.radius)
        for k in range(len(judged)):
            rank = float(judged.first_right_ranks[k])
            frame = int(one.match_frames[k])
            yield (
                *keys,
                measured.seed,
                int(one.query_frames[k]),
                int(one.stamps_ns[k]),
                *one.p_WQs[k].tolist(),
                int(judged.is_right[k]),
                int(judged.has_match[k]),
                float(judged.best_scores[k]),
                int(rank) if np.isfinite(rank) else None,
                faults[k] or None,
                one.match_drives[k] or None,
                frame if frame >= 0 else None,
                float(one.distances[k]),
                float(one.pose_errors.translation[k]),
                float(one.pose_errors.rotation_deg[k]),
                float(one.overlaps[k]),
            )


def _keys(rung: LadderRung, method: str, is_gated: bool) -> tuple[object, ...]:
    return (
        rung.map_name,
        rung.database,
        rung.query,
        rung.cause,
        rung.level,
        method,
        int(is_gated),
    )


def _options(protocol: RetrievalProtocol) -> Iterator[float]:
    for name in _OPTIONS:
        yield getattr(protocol, name)
