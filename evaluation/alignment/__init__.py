"""Alignment of drives with poses in different worlds.

`align` aligns two drives: `pose_guesses` guesses a pose, `loop_search` finds
loops by the `registration` of `submaps`, and `pose_graph` fits poses to the
loops. `trajectory_errors` compares an estimated trajectory with ground truth.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
