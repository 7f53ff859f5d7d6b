"""The files in the folder of a map."""

import os
from pathlib import Path
import re

from evaluation.base import InputError, check_regular, listed
from worlds.shapes import STRUCTURES_NAME

ROADS_NAME = "roads.yaml"
PLAN_NAME = "city.yaml"
STAGES_NAME = "stages.yaml"
IMPORT_NAME = "import.yaml"
TRAFFIC_NAME = "traffic.npz"
MESH_FOLDER = "meshes"


def stage_name(stage: str) -> str:
    """Returns the file name of a stage: `stage_01.sdf` for the stage `01`."""
    return f"stage_{stage}.sdf"


class MapFolder:
    """The paths of the files of a map; any of the files may be missing.

    Attributes:
        path: the folder.
        name: the name of the map.
        roads: the road network.
        import_facts: where an imported map comes from.
        traffic: recorded traffic on the map's roads and sidewalks.
        plan: the generated city's plan, from which its stages are made.
        stage_plan: the table that lists, for each stage, which structures are
            missing.
        structures: the table of structures.
        drive_table: the table of the drives, with their lengths and other
            figures.
        meshes: the folder of the meshes that the stages name.
        views: the camera views from which pictures of the map are made.

    Example:
        from worlds import MapFolder, shipped_maps

        print(*MapFolder(shipped_maps()["riverside"]).stages())
    """

    def __init__(self, path: Path):
        self.path = path
        self.name = path.name
        self.roads = path / ROADS_NAME
        self.import_facts = path / IMPORT_NAME
        self.traffic = path / TRAFFIC_NAME
        self.plan = path / PLAN_NAME
        self.stage_plan = path / STAGES_NAME
        self.structures = path / STRUCTURES_NAME
        self.drive_table = path / "sequences.csv"
        self.meshes = path / MESH_FOLDER
        self.views = path / "views.yaml"

    def files(self) -> list[Path]:
        """Returns the files directly in the map's folder, sorted.

        All files of a map have a suffix. Files without a suffix, hidden files
        such as locks of editors, and dead links are left out.

        Raises:
            InputError: the folder contains a pipe or a device.
        """
        found = [
            path
            for path in sorted(self.path.glob("*.*"))
            if not (path.name.startswith(".") or path.is_dir())
            and path.exists()
        ]
        for path in found:
            check_regular(path)
        return found

    def stage(self, stage: str) -> Path:
        """Returns the path of the SDF file of a stage, such as `01`."""
        return self.path / stage_name(stage)

    def stages(self) -> dict[str, Path]:
        """Returns stage -> SDF file of all existing stages, in order."""
        return {
            path.stem.removeprefix("stage_"): path
            for path in listed(self.path, stage_name("*"))
        }

    def drive(self, number: str) -> Path:
        """Returns the path of the scenario file of a drive, such as `01`."""
        return self.path / f"sequence_{number}.yaml"

    def drives(self) -> list[Path]:
        """Returns the scenario files of the drives, in order."""
        return listed(self.path, self.drive("*").name)

    def other_drive(self, stage: str) -> Path:
        """Returns the path of the scenario file for the other route.

        An imported city has two routes, and each stage has a drive on each
        route. `MapFolder.drive` returns the path for the first route.
        """
        return self.path / f"other_{stage}.yaml"

    def other_drives(self) -> list[Path]:
        """Returns the scenario files for the other routes, in order."""
        return listed(self.path, self.other_drive("*").name)

    def recordable_drives(self) -> list[Path]:
        """Returns the scenario files of drives whose stage exists.

        A map's roads and drives may exist before its city does.
        """
        stages = self.stages()
        return [
            path
            for path in self.drives()
            if path.stem.removeprefix("sequence_") in stages
        ]


def drive_name(path: Path) -> str:
    """Returns the name of the drive that a scenario file describes.

    The name of `<map>/sequence_04.yaml` is `<map>_04`, and that of
    `<map>/other_04.yaml` is `<map>_other_04`. The name of any other file is the
    file's name without the suffix.
    """
    for prefix in ("sequence_", "other_"):
        if path.stem.startswith(prefix):
            number = path.stem.removeprefix("sequence_")
            return f"{path.resolve().parent.name}_{number}"
    return path.stem


def no_drives(folder: Path) -> InputError:
    """Returns the error that a map's folder has no drive that can be recorded.

    The message names `folder`; see `MapFolder.recordable_drives`.
    """
    return InputError(
        f"{folder}: no sequence_NN.yaml whose stage_NN.sdf is there"
    )


def check_new_map(output: Path) -> None:
    """Checks that a new map can be written to a folder.

    Raises:
        InputError: the folder exists already, or its name contains other
            characters than ASCII letters, digits and underscores.
    """
    if os.path.lexists(output):
        raise InputError(
            f"{output}: the folder is there already; give another one"
        )
    name = output.resolve().name
    if not re.fullmatch(r"\w+", name, re.ASCII):
        raise InputError(
            f"output: {name!r}: the folder's name may have letters, digits "
            "and underscores only"
        )
