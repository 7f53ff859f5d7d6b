"""What a method makes of two drives, in numbers."""

import numpy as np
import pytest

from evaluation.methods import make_method
from evaluation.recognition import (
    PlaceOutcome,
    PoseErrors,
    QueryDrive,
    QueryOutcomes,
    Retrieval,
    RetrievalProtocol,
    pose_numbers,
)


def outcome_of(method, outcomes, columns, errors):
    """An outcome whose best places are not known."""
    number = len(outcomes)
    poses = {
        "translation_error": errors.translation,
        "rotation_error_deg": errors.rotation_deg,
    }
    return PlaceOutcome(
        method=method,
        database="a",
        query="b",
        protocol=RetrievalProtocol(),
        protocol_name="recorded",
        outcomes=outcomes,
        columns={**columns, **poses},
        place_frames=np.arange(9),
        best_places=np.full((number, 5), -1),
        best_scores=np.full((number, 5), np.nan),
        matches=np.empty((0, 2), int),
        nearest=np.full(number, np.inf),
    )


def part(number, kept):
    """Returns which queries are right: the first ones."""
    return np.arange(number) < kept


def test_median_errors_are_those_of_right_answers():
    """Thirty queries without a match, and one wrong place, do not count."""
    right = part(41, 10)
    outcomes = QueryOutcomes(
        np.linspace(1.0, 0.5, 41),
        right,
        part(41, 11),
        np.where(right, 1.0, np.inf),
        9,
    )
    far = np.where(right, 0.1, 50.0)
    far[0] = np.nan
    now = outcome_of("btc", outcomes, {}, PoseErrors(far, 2.0 * far))
    assert {n.metric: (n.value, n.n) for n in pose_numbers(now, None)} == {
        "pose_success": (9 / 11, 11),
        "translation_median": (0.1, 9),
        "rotation_median_deg": (0.2, 9),
    }


@pytest.mark.parametrize("blocks", [None, np.arange(8) // 2])
def test_columns_hold_all_that_numbers_follow_from(blocks):
    right = part(8, 5)
    # Query k finds place k; the last places are of another town.
    scores = np.where(np.eye(8, 9) > 0, np.linspace(1, 0.1, 8)[:, None], np.nan)
    retrieval = Retrieval(
        query_frames=np.arange(8) * 10,
        database_frames=np.arange(9) * 7,
        scores=scores,
        distances=np.ones((8, 9)),
        matches=np.eye(8, 9, dtype=bool) & right[:, None],
        pose_errors=PoseErrors.unknown(8),
        is_known=np.ones((8, 9), bool),
        query_blocks=blocks,
    )
    one = PlaceOutcome.of(
        "solid rings=8",
        make_method("solid", {}),
        RetrievalProtocol(verified=True),
        retrieval,
        QueryDrive("town_03", np.arange(8) * 50, np.arange(24.0).reshape(8, 3)),
        ["town_01"] * 6 + ["town_02"] * 3,
        np.linspace(0.2, 0.8, 8),
    )
    found = one.columns
    assert {len(column) for column in found.values()} == {8}
    assert found["query_y"].tolist() == [1 + 3 * k for k in range(8)]
    assert found["match_frame"].tolist() == [7 * k for k in range(8)]
    assert found["match_drive"].tolist() == ["town_01"] * 6 + ["town_02"] * 2
    assert np.isnan(found["distance"]).tolist() == [False] * 6 + [True] * 2
    assert np.sum(found["correct"]) == 5
    # Without blocks each query is one.
    np.testing.assert_array_equal(
        found["block"], np.arange(8) if blocks is None else blocks
    )
    np.testing.assert_allclose(found["overlap"] + found["visible_change"], 1.0)
    assert (one.method, one.database) == ("solid rings=8", "town_01")
    assert (one.query, one.is_verified, one.radius) == ("town_03", True, 7.5)
    assert one.protocol.scans_per_place == 1
    # Each query has one candidate.
    assert one.best_places.tolist() == [[k, -1, -1, -1, -1] for k in range(8)]
    np.testing.assert_array_equal(one.best_scores[:, 0], np.diag(scores))
    assert np.isnan(one.best_scores[:, 1:]).all()
    assert one.matches.tolist() == [[k, k] for k in range(5)]
    assert one.nearest.tolist() == [1.0] * 8
    assert [bool(why) for why in found["why"]] == [*~right]
