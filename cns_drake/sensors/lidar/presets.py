"""Presets: the beam patterns of commercial LiDARs, by their data sheets.

The numbers are in the file `presets.yaml` next to this module.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from cns_drake.base import did_you_mean, parse_yaml
from cns_drake.sensors.lidar.patterns import (
    NoddingPattern,
    RosettePattern,
    SpinningPattern,
)

# Name of a class of patterns in `presets.yaml` -> the class.
_NONREPEATING = {
    "RosettePattern": RosettePattern,
    "NoddingPattern": NoddingPattern,
}
UnitPattern: TypeAlias = SpinningPattern | RosettePattern | NoddingPattern


class LidarPreset(NamedTuple):
    """The beam pattern of a commercial LiDAR.

    Attributes:
        pattern: the pattern.
        source: data sheet from which the numbers come.
    """

    pattern: UnitPattern
    source: str

    @classmethod
    def of(
        cls, *, source: str, ranges: tuple[float, float], **fields: Any
    ) -> LidarPreset:
        """Makes a preset from its entry in `presets.yaml`.

        Args:
            source: data sheet from which the numbers come.
            ranges: nearest and farthest measured range [m].
            fields: the other fields of the entry.
        """
        fields["min_range"], fields["max_range"] = ranges
        if "pattern" in fields:
            kind = _NONREPEATING[fields.pop("pattern")]
            for name, value in fields.items():
                if isinstance(value, list):
                    fields[name] = tuple(value)
            return cls(kind(**fields), source)
        azimuths_deg = fields.pop("azimuths_deg", None)
        if azimuths_deg is not None:
            fields["azimuths_rad"] = tuple(np.deg2rad(azimuths_deg).tolist())
        rings = [
            np.linspace(*part) if isinstance(part, list) else [part]
            for part in fields.pop("rings_deg")
        ]
        pattern = SpinningPattern(
            elevations_rad=tuple(np.deg2rad(np.concatenate(rings)).tolist()),
            num_columns=fields.pop("columns"),
            period=fields.pop("period", 0.05),
            **fields,
        )
        return cls(pattern, source)


_UNITS = parse_yaml(Path(__file__).with_name("presets.yaml").read_bytes())
# Units that fire at a fixed rate: a slower revolution has more columns.
_STEADY = {n for n, unit in _UNITS.items() if unit.pop("fires_steadily", False)}
LIDAR_PRESETS: dict[str, LidarPreset] = {
    name: LidarPreset.of(**unit) for name, unit in _UNITS.items()
}


def check_preset(preset: str) -> None:
    """Checks that there is a preset of this name.

    Raises:
        ValueError: there is no such preset; the message lists all presets.
    """
    if preset not in LIDAR_PRESETS:
        raise ValueError(
            f"unknown preset '{preset}'; known: {', '.join(LIDAR_PRESETS)}"
            f"{did_you_mean(preset, LIDAR_PRESETS)}"
        )


def make_beam_pattern(
    preset: str,
    period: float | None = None,
    *,
    num_columns: int | None = None,
    min_range: float | None = None,
    max_range: float | None = None,
) -> UnitPattern:
    """Returns the beam pattern of a preset.

    Args:
        preset: a key of `LIDAR_PRESETS`, whose values name the data sheets
            (field `source`).
        period: duration of a revolution [s]; by default the duration in the
            data sheet.
        num_columns: columns in a revolution; by default the number in the data
            sheet. If the lasers of a unit fire at a fixed rate, the period
            determines this number.
        min_range: nearest range that is measured [m]; by default the value in
            the data sheet.
        max_range: farthest range that is measured [m]; by default the value in
            the data sheet.

    Raises:
        ValueError: there is no preset of that name, `num_columns` is given for
            a preset without columns, or a value is impossible.

    Example:
        from cns_drake import LIDAR_PRESETS, make_beam_pattern

        patterns = [make_beam_pattern(name, 0.1) for name in LIDAR_PRESETS]
    """
    check_preset(preset)
    base = LIDAR_PRESETS[preset].pattern
    if num_columns is not None and base.num_columns is None:
        raise ValueError(f"the preset '{preset}' has no columns")
    if base.num_columns and preset in _STEADY and period and not num_columns:
        num_columns = max(round(base.num_columns * period / base.period), 1)
    changes: dict[str, Any] = {
        "period": period,
        "num_columns": num_columns,
        "min_range": min_range,
        "max_range": max_range,
    }
    return replace(
        base,
        **{name: value for name, value in changes.items() if value is not None},
    )
