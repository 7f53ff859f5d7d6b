"""Road networks of random streets."""

from typing import Any

import numpy as np

from cns_drake.studies.maps.turned_inputs import turned_content


def draw_streets(rng: np.random.Generator) -> dict[str, Any]:
    """Returns the content of a `roads.yaml` with random streets.

    Streets run along the lines of a bent grid with random spacings; the whole
    grid has a random orientation. Some cross streets are missing, and some are
    bent.
    """
    columns, rows = rng.integers(3, 6), rng.integers(3, 5)
    x = np.cumsum(rng.uniform(70.0, 170.0, columns))
    y = np.cumsum(rng.uniform(60.0, 140.0, rows))
    places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
    places += rng.uniform(-14.0, 14.0, places.shape)
    kerb = [round(float(k), 1) for k in rng.uniform(5.0, 9.0, (columns * rows))]
    junctions = {
        f"j{i}{k}": {
            "position": places[i, k].round(2).tolist(),
            "kerb_radius": kerb.pop(),
        }
        for i in range(columns)
        for k in range(rows)
    }
    roads: dict[str, Any] = {}
    wide = {("x", int(rng.integers(rows))), ("y", int(rng.integers(columns)))}

    def add(axis: str, line: int, i: int, k: int, to: tuple[int, int]) -> None:
        start, end = places[i, k], places[to]
        road: dict[str, Any] = {"start": f"j{i}{k}", "end": f"j{to[0]}{to[1]}"}
        if (axis, line) in wide:
            road["lanes"] = [2, 2]
        elif rng.random() < 0.5:
            road["parking"] = 2.2
        if rng.random() < 0.3:
            along = end - start
            aside = np.array([-along[1], along[0]]) / np.linalg.norm(along)
            bend = (start + end) / 2.0 + aside * rng.uniform(-16.0, 16.0)
            road["via"] = [[*bend.round(2).tolist(), 30.0]]
        roads[f"{axis}{line}_{i}{k}"] = road

    for k in range(rows):
        for i in range(columns - 1):
            add("x", k, i, k, (i + 1, k))
    for i in range(columns):
        is_inside = 0 < i < columns - 1
        for k in range(rows - 1):
            # Every junction still has two streets.
            if not (is_inside and rng.random() < 0.3):
                add("y", i, i, k, (i, k + 1))
    defaults = {
        "lanes": [1, 1],
        "lane_width": round(float(rng.uniform(3.2, 4.2)), 1),
        "sidewalk": round(float(rng.uniform(2.0, 5.0)), 1),
        "kerb_height": 0.15,
        "speed_limit": 12.0,
    }
    plan = {"defaults": defaults, "junctions": junctions, "roads": roads}
    return turned_content(plan, float(rng.uniform(0.0, 90.0)))
