"""What a method makes of two drives, in numbers."""

import numpy as np
import pytest

from evaluation.methods import make_method
from evaluation.recognition import (
    PlaceOutcome,
    PoseErrors,
    QueryDrive,
    Retrieval,
    RetrievalProtocol,
)


def part(number, kept):
    """Returns which queries are right: the first ones."""
    return np.arange(number) < kept


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
    found = one.outcomes.columns
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
    assert (one.query, one.protocol.verified) == ("town_03", True)
    assert one.protocol.scans_per_place == 1
    # Each query has one candidate.
    assert one.best_places.tolist() == [[k, -1, -1, -1, -1] for k in range(8)]
    np.testing.assert_array_equal(one.best_scores[:, 0], np.diag(scores))
    assert np.isnan(one.best_scores[:, 1:]).all()
    assert one.matches.tolist() == [[k, k] for k in range(5)]
    assert found["nearest"].tolist() == [1.0] * 8
    assert [bool(why) for why in found["why"]] == [*~right]
