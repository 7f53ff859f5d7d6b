"""Which changes of a city a drive's page shows first."""

import numpy as np

from cns_drake.pictures.city_parts import ColouredPart, greatest_changes
from cns_drake.scene import TriangleSurface

# A way of 400 m along x, a metre a frame.
WAY = np.column_stack([np.arange(401.0), np.zeros(401), np.zeros(401)])


def box(x, y, side, height):
    corners = np.array(
        [[i, k, z] for i in (0, 1) for k in (0, 1) for z in (0, 1)]
    )
    points = corners * [side, side, height] + [x, y, 0.0]
    triangles = np.array([[0, 1, 2], [5, 6, 7]], np.int32)
    surface = TriangleSurface(points, triangles)
    return [ColouredPart("building", (0.5, 0.5, 0.5), surface)]


def test_greatest_changes_are_apart_and_near_the_route():
    own = {
        "hall_1": box(300, 10, 20, 10),  # Gone.
        "tower_1": box(100, 10, 10, 30),  # Higher in the other stage.
        "house_1": box(0, 10, 10, 6),  # The same.
    }
    other = {
        "tower_1": box(100, 10, 10, 42),
        "house_1": box(0, 10, 10, 6),
        "kiosk_1": box(290, 5, 3, 3),  # Beside the hall.
        "far_1": box(200, 31, 50, 50),  # Too far away.
        "row_house_n17": box(200, -18, 8, 9),
    }
    changes = greatest_changes(own, other, WAY, 5)
    assert [(c.frame, c.kind, c.height, c.is_own) for c in changes] == [
        (65, "tower", 12.0, False),
        (165, "row house", 9.0, False),
        (265, "hall", 10.0, True),
    ]
    assert changes[0].place == (105.0, 15.0, 36.0)
    # The tower's change is of 12 m times 14 m, and the hall of 10 m times 28.
    (only,) = greatest_changes(own, other, WAY, 1)
    assert only.kind == "hall"
    assert greatest_changes(own, own, WAY, 5) == []
