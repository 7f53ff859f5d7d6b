"""The values that each metric can have: one table, and the check of all output.

Every table and figure passes this check before it is written. A name is a
metric of `results.csv`, the head of a column of a table, or the label of an
axis. All values under a name must lie within the range that is listed here for
this name.
"""

from collections.abc import Iterable
from functools import cache
import math
import re
from typing import NamedTuple

import numpy as np

from cns_drake.base import InputError


class Range(NamedTuple):
    """The values that a metric can have.

    Attributes:
        least, greatest: limits of the metric.
        is_whole: whether the metric is a whole number, such as a count.
    """

    least: float = -math.inf
    greatest: float = math.inf
    is_whole: bool = False

    def __str__(self) -> str:
        numbers = "a whole number" if self.is_whole else "a number"
        if math.isinf(self.greatest):
            return f"{numbers} from {self.least:g} on"
        return f"{numbers} from {self.least:g} to {self.greatest:g}"


_SHARE = Range(0.0, 1.0)
_SIGNED_SHARE = Range(-1.0, 1.0)
_COUNT = Range(0.0, is_whole=True)
_NOT_NEGATIVE = Range(0.0)
_ANY = Range()
# Sums and quotients of floating-point numbers leave a range by this at most.
_ROUNDING = 1e-9
# Names, in lower case and with underscores between words -> their range.
_RANGES = (
    # The label of a chart whose values stand in its cells.
    (r"[\w@%]+_in_per_cent\w*", _ANY),
    # Place recognition.
    (r"(paper_s_)?(auc|r1|r@\d+%?|f1|f1max)(_(?!kept)\w+)?", _SHARE),
    (
        r"strict|precision\w*|recall\w*|(pose_)?success\w*|near_miss|within_03m",
        _SHARE,
    ),
    (r"mean_reciprocal_rank|(match_)?auroc\w*|(\w+_)?m?iou\w*|p", _SHARE),
    (r"(\w+_)?kept\w*|retained\w*|\w+_retained", _NOT_NEGATIVE),
    (r"with_match|n_with_a_match|queries|wrong|(tp|fp_fn)_of_[\w@]+", _COUNT),
    (r"(of_)?places|scans_a_place|first_right_rank", _COUNT),
    (r"accepted_matches", _COUNT),
    (r"no_\w+|just_too_far|other_\w+|too_far|twin|elsewhere", _COUNT),
    (r"changed|lost(_per_km)?|found|(right|called)_structures", _NOT_NEGATIVE),
    (r"hidden|distance|points|place_bytes|bytes_a_place|\w+_ms", _NOT_NEGATIVE),
    (r"memory|(query|build)_time", _NOT_NEGATIVE),
    (r"translation\w*|rotation\w*|error_of_position_m", _NOT_NEGATIVE),
    (r"difference|a_b|rank_correlation\w*", _SIGNED_SHARE),
    # Change.
    (r"tcr_\w+|paper|earlier_later|later_earlier|overlap", _SHARE),
    (r"same_stage_both_routes|where_both_drove", _SHARE),
    (r"least_of_the_grids|greatest|scan_without_map", _SHARE),
    (r"visible_change\w*|minus_the_control_s", _SIGNED_SHARE),
    (r"voxels_in_hulls|unchanged", _COUNT),
    # What has no limits, or says how something was measured.
    (r"share_left|score|(right|wrong)_fit|low|high|gate|\w*spacing", _ANY),
    (r"(\w+_)?(frame|stamp_ns|[xyz]|q[xyzw]|block)", _ANY),
    (r"correct|has_match|scans_per_place|radius|exclude_\w+", _ANY),
    (r"turn_queries|tilt_\w+|min_\w+|max_\w+|seed|offset", _ANY),
)


@cache
def range_of(name: str) -> Range | None:
    """Returns the range of a metric, a column or an axis; None if unknown."""
    # A dollar sign of a text for matplotlib is escaped.
    spelled = re.sub(r"[^\w@%]+", "_", name.lower()).strip("_")
    for pattern, limits in _RANGES:
        if re.fullmatch(pattern, spelled):
            return limits
    return None


def checked(name: str, value: float) -> float:
    """Returns a value, moved to its limit if rounding put it out of range.

    Args:
        name: name of the metric, head of the column or label of the axis.
        value: the value; NaN if it is unknown.

    Raises:
        InputError: the value is impossible for the metric.
    """
    limits = range_of(name)
    if limits is None or math.isnan(value):
        return value
    low, high, is_whole = limits
    inside = min(max(value, low), high)
    if abs(value - inside) > _ROUNDING or (
        is_whole and math.isfinite(value) and value != round(value)
    ):
        raise InputError(f"{name}: {value:g} cannot be: it is {limits}")
    return value if inside == value else inside


def check_all(name: str, values: Iterable[float]) -> None:
    """Checks several values of a metric; NaN and masked values are left out.

    Raises:
        InputError: a value is impossible for the metric.
    """
    numbers = np.ma.masked_invalid(np.asarray(values, dtype=float)).compressed()
    if len(numbers):
        checked(name, float(numbers.min()))
        checked(name, float(numbers.max()))
