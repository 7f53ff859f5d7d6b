"""Distances along rays by SceneGraph's own signed distances."""

import numpy as np


def marched_range(query_object, p_WS, d_W, max_range):
    """Distance along a ray by sphere tracing, inf for a miss.

    A signed distance of Drake's proximity geometry bounds a step that meets
    nothing.
    """
    distance = 0.0
    for _ in range(2000):
        found = query_object.ComputeSignedDistanceToPoint(
            p_WS + distance * d_W, max_range
        )
        if not found:
            return np.inf
        step = min(result.distance for result in found)
        if step < 1e-5:
            return distance
        distance += step
        if distance > max_range:
            return np.inf
    raise AssertionError("a ray goes along a surface for ever")
