"""The control points of the curve that a vehicle follows."""

from __future__ import annotations

# Their distance along the path [m]: the curvature then builds up over about
# 10 m, as a driver turns the wheel, and in the tightest bends of a town the
# path leaves the middle of the lane by less than 10 cm.
POINT_SPACING = 2.0
