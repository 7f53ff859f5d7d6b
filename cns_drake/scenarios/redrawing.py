"""Redraws a map's city: the same streets, but all other structures are new.

Roads and plan stay the same, and only the seed of the plan changes. So
buildings, plants, cars and furniture are sampled anew. Each redrawn city is a
map folder.
"""

from collections.abc import Callable
from dataclasses import dataclass
import os
from pathlib import Path

import yaml

from cns_drake.scenarios.map_step import MakeMap
from evaluation.base import (
    Reporter,
    __version__,
    draft_folder,
    errors_at,
    read_yaml,
    user_errors,
)
from worlds.city import generate_city, load_plan
from worlds.maps import STAGES_NAME, MapFolder

# Start of the first line of each input that is written here.
_MARK = "# Of a city drawn anew by cns-drake"
# The only stage of a city that is drawn anew.
REDRAWN_STAGE = "01"


@dataclass(frozen=True)
class RedrawCity(MakeMap):
    """A job step that makes a map with another city along a map's streets.

    The new map has one stage, which contains the whole city.

    Attributes:
        map_folder: folder of the map with the streets.
        stage: name of the new map's stage.
        seed: seed of the new city.
    """

    map_folder: Path
    stage: str
    seed: int

    def make(self, finish: Callable[[Path], None], reporter: Reporter) -> None:
        with draft_folder(self.folder) as draft:
            for name, content in self.inputs().items():
                (draft / name).write_bytes(content)
            place = f"{self.map_folder}: seed {self.seed}"
            with errors_at(place, f"{draft}{os.sep}"):
                self.finish_inputs(draft)
                generate_city(draft)
            finish(draft)

    def inputs(self) -> dict[str, bytes]:
        """Returns the content of the city's input files, by file name."""
        return redrawn_inputs(self.map_folder, self.stage, self.seed)

    def finish_inputs(self, draft: Path) -> None:
        """Writes further input files, such as `stages.yaml`; by default none.

        Override this function for files that contain names of structures,
        because these names follow from the other input files. To find the
        names, call `worlds.city.generation.city_structures.make_city` with
        `draft`.

        Args:
            draft: folder of the map, before it gets its final name. The folder
                already contains the files of `inputs`, but not the generated
                city.
        """

    def sources(self) -> dict[str, object]:
        """Returns all inputs of the city, ready for JSON."""
        return {
            name: content.decode() for name, content in self.inputs().items()
        }


def redrawn_city(map_folder: Path, seed: int, output: Path) -> RedrawCity:
    """Returns the step that makes a map's city anew, in a folder of `output`.

    Args:
        map_folder: folder of the map, with `roads.yaml` and `city.yaml`.
        seed: seed of the new city.
        output: folder of the new cities.
    """
    folder = output / f"{map_folder.name}_c{seed}"
    return RedrawCity(folder, map_folder, REDRAWN_STAGE, seed)


def redrawn_inputs(map_folder: Path, stage: str, seed: int) -> dict[str, bytes]:
    """Returns the content of the new city's input files, by file name.

    The files are the map's own `roads.yaml`, a `city.yaml` with the new seed,
    and a `stages.yaml` with one stage that contains the whole city.

    Args:
        map_folder: folder of the map.
        stage: name of the stage.
        seed: seed of the new city.

    Raises:
        InputError: a file of the map cannot be read, or is no plan.
    """
    source = MapFolder(map_folder)
    roads, plan = source.roads, source.plan
    load_plan(plan)
    with user_errors(roads):
        network = roads.read_bytes()
    stages = {stage: {"story": f"The whole city, as seed {seed} draws it."}}
    return {
        roads.name: network,
        plan.name: marked_yaml(
            "the map's plan with another seed", read_yaml(plan) | {"seed": seed}
        ),
        STAGES_NAME: marked_yaml("its only stage", {"stages": stages}),
    }


def marked_yaml(title: str, values: dict) -> bytes:
    """Returns the text of a YAML file with a title in its first comment.

    Args:
        title: the title.
        values: the content.
    """
    text = yaml.safe_dump(
        values, sort_keys=False, default_flow_style=None, width=79
    )
    return f"{_MARK} {__version__}: {title}.\n\n{text}".encode()
