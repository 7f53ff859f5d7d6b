"""Writes routes through an imported city, and scenarios that follow them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import yaml

_CRUISE = 8.0  # [m/s]
_ACCELERATION = {"longitudinal_acceleration": 2.0, "lateral_acceleration": 2.5}


def write_drives(
    folder: Path,
    stages: Mapping[str, str],
    routes: Sequence[np.ndarray],
    cruise: Sequence[float] = (_CRUISE, _CRUISE),
) -> None:
    """Writes routes, and scenarios of each through every stage.

    Args:
        folder: of the map, with the map's name.
        stages: stage -> words for its time, the end of a title.
        routes: waypoints (N, 3) of at most two [m].
        cruise: speed on each [m/s].
    """
    for letter, waypoints in zip("ab", routes, strict=False):
        rows = [f"{x:.3f},{y:.3f},{z:.3f}" for x, y, z in waypoints]
        text = "\n".join(["x,y,z", *rows, ""])
        (folder / f"route_{letter}.csv").write_text(text, "utf-8")
    speeds = dict(zip("ab", cruise, strict=False))
    for number, (stage, when) in enumerate(stages.items()):
        # The query drive is in the last stage, on another route than the
        # databases.
        letters = "ab"[: len(routes)]
        if number < len(stages) - 1:
            letters = letters[::-1]
        for kind, letter in zip(("sequence", "other"), letters, strict=False):
            scenario = {
                "map": ".",
                "stage": stage,
                "title": f"Route {letter} through {folder.name}{when}",
                "waypoints": f"route_{letter}.csv",
                "speeds": {"cruise": speeds[letter], **_ACCELERATION},
            }
            text = yaml.safe_dump(scenario, sort_keys=False)
            (folder / f"{kind}_{stage}.yaml").write_text(text, "utf-8")
