"""The members of a family, and the files of each."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cns_drake.base.jobs.cluster import Cluster
    from cns_drake.scenarios.scenario import Scenario


def family_members(
    vary: Path, output: Path, cluster: Cluster
) -> list[Scenario]:
    """Returns the members of a family.

    Their scenario files go to `<output>/scenarios`, cities of their own to
    `<output>/cities`.

    Raises:
        InputError: the family cannot be used.
    """
    from cns_drake.scenarios.variation import load_family, write_scenarios
    from cns_drake.studies.redrawing import redraw_cities

    def redraw(
        map_folder: Path, stage: str, seeds: Sequence[int]
    ) -> dict[int, Path]:
        return redraw_cities(
            map_folder, stage, seeds, output / "cities", cluster
        )

    members = load_family(vary, redraw)
    write_scenarios(members, output / "scenarios")
    return members
