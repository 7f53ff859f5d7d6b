"""Place recognition: queries, places, scores and metrics.

- Protocol: `protocol`, `protocol_options`, `kept_places`.
- Descriptors of drives: `describing` makes them, `descriptors` holds them,
  `stored_places` reads them from files.
- Scores: `search` in a database, `scoring` of one query, `ranking`,
  `geometric_verification`, `sequence_matching`; `scan_folders` for scans
  without poses.
- Ground truth: `retrieval`, `overlap_truth`, `seen_surfaces`, `pose_errors`.
- Metrics: `query_outcomes`, `precision_recall`, `metrics`, `auroc`,
  `bootstrap`, `significance`, `costs`.
- Results: `place_outcome`, `place_numbers`, `result_number`, and why places are
  wrong: `faults`, `visible_change`.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
