"""The control points of the curve that a vehicle follows."""

from __future__ import annotations

# Distance of control points along the path [m]. The curvature then changes over
# about 10 m, as a driver turns the wheel. In the tightest bends of a town the
# path is less than 10 cm from the middle of the lane.
POINT_SPACING = 2.0
