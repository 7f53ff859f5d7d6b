"""The pictures of a map: its drives, and how its streets change."""

from __future__ import annotations

import abc
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cns_drake.base.interrupts import uninterrupted
from cns_drake.base.jobs.running import Job
from cns_drake.base.jobs.step import Reporter
from cns_drake.base.map_folder import MapFolder
from cns_drake.scenarios.provenance import digest_file, digest_inputs
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import load_scenario, world_file
from evaluation.study.parts import PartStep

# Expected time to draw a stage [s].
_STAGE_COST = 10.0


def plan_pictures(folder: Path, pictures: Path) -> list[Job]:
    """Returns the jobs that draw a map.

    Args:
        folder: of the map.
        pictures: folder to write: `<map>_drives.png`, the drives from above;
            `<map>_stages.png`, a street in the first and the last stage, if
            the map has a `views.yaml`.
    """
    # Workers may run elsewhere.
    folder, pictures = folder.resolve(), pictures.absolute()
    kinds: dict[str, tuple[type[_Picture], int]] = {
        "drives": (DrawDrives, len(MapFolder(folder).recordable_drives()))
    }
    if MapFolder(folder).views.is_file():
        kinds["stages"] = (DrawStages, 2)
    return [
        Job(
            name=f"picture {folder.name} {what}",
            step=draw(
                folder,
                pictures / f"{folder.name}_{what}.png",
                pictures / "parts" / f"{folder.name}_{what}.data",
            ),
            cost=_STAGE_COST * num_stages,
        )
        for what, (draw, num_stages) in kinds.items()
    ]


@dataclass(frozen=True)
class _Picture(PartStep):
    """Draws a picture of a map.

    Attributes:
        folder: of the map.
        picture: to write.
        part: a file with the fingerprint of the picture.
    """

    folder: Path
    picture: Path
    part: Path

    @property
    def figures(self) -> tuple[Path, ...]:
        return (self.picture,)

    @abc.abstractmethod
    def worlds(self) -> Sequence[Path]:
        """Returns the worlds that it shows."""


class DrawDrives(_Picture):
    """Draws the drives of a map from above."""

    def inputs(self) -> dict[str, object]:
        return {
            one.name: [one.model_dump(mode="json"), digest_inputs(one)]
            for one in self._scenarios()
        }

    def make(self, reporter: Reporter) -> None:
        with uninterrupted():
            from cns_drake.pictures.stage_pictures import draw_drives

        draw_drives(
            {one.name.replace("_", " "): one for one in self._scenarios()},
            self.picture,
        )

    def worlds(self) -> Sequence[Path]:
        return [world_file(one) for one in self._scenarios() if not one.without]

    def _scenarios(self) -> list[Scenario]:
        return [
            load_scenario(file)
            for file in MapFolder(self.folder).recordable_drives()
        ]


class DrawStages(_Picture):
    """Draws a street of a map in its first and its last stage."""

    def inputs(self) -> dict[str, object]:
        files = [*self.worlds(), MapFolder(self.folder).views]
        return {file.name: digest_file(file) for file in files}

    def make(self, reporter: Reporter) -> None:
        with uninterrupted():
            from cns_drake.pictures.stage_pictures import (
                draw_stages,
                load_views,
            )

        stages = {f.stem.replace("_", " "): f for f in self.worlds()}
        views = load_views(MapFolder(self.folder).views)
        draw_stages(stages, views["street"], self.picture)

    def worlds(self) -> Sequence[Path]:
        files = list(MapFolder(self.folder).stages().values())
        return files[0], files[-1]
