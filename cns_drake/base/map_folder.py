"""The files in the folder of a map."""

from dataclasses import dataclass
from pathlib import Path

ROADS_NAME = "roads.yaml"
PLAN_NAME = "city.yaml"
STAGES_NAME = "stages.yaml"
STRUCTURES_NAME = "structures.csv"
LANES_NAME = "lanes.json"
MESH_FOLDER = "meshes"


def stage_name(stage: str) -> str:
    """Returns the name of the SDF file of a stage."""
    return f"stage_{stage}.sdf"


@dataclass(frozen=True)
class MapFolder:
    """The folder of a map, of which any file may be missing.

    Attributes:
        path: the folder.
    """

    path: Path

    @property
    def name(self) -> str:
        """The name of the map."""
        return self.path.name

    @property
    def roads(self) -> Path:
        """The road network."""
        return self.path / ROADS_NAME

    @property
    def lanes(self) -> Path:
        """Lanes and walkways of an imported map, for traffic."""
        return self.path / LANES_NAME

    @property
    def plan(self) -> Path:
        """The plan from which the city is generated."""
        return self.path / PLAN_NAME

    @property
    def stage_plan(self) -> Path:
        """The table of the structures that each stage lacks."""
        return self.path / STAGES_NAME

    @property
    def structures(self) -> Path:
        """The table of structures."""
        return self.path / STRUCTURES_NAME

    @property
    def drive_table(self) -> Path:
        """The table of drives and their figures."""
        return self.path / "sequences.csv"

    @property
    def meshes(self) -> Path:
        """The folder of the meshes that the stages name."""
        return self.path / MESH_FOLDER

    @property
    def views(self) -> Path:
        """The views of which pictures are made."""
        return self.path / "views.yaml"

    def stage(self, stage: str) -> Path:
        """Returns the SDF file of a stage."""
        return self.path / stage_name(stage)

    def stages(self) -> dict[str, Path]:
        """Returns stage -> SDF file of the stages that are there, in order."""
        return {
            path.stem.removeprefix("stage_"): path
            for path in sorted(self.path.glob(stage_name("*")))
        }

    def drive(self, number: str) -> Path:
        """Returns the scenario file of a drive."""
        return self.path / f"sequence_{number}.yaml"

    def drives(self) -> list[Path]:
        """Returns the scenario files of the drives, in order."""
        return sorted(self.path.glob(self.drive("*").name))

    def recordable_drives(self) -> list[Path]:
        """Returns those whose stage is there as well.

        A map's roads and drives may be there before its city is.
        """
        stages = self.stages()
        return [
            path
            for path in self.drives()
            if path.stem.removeprefix("sequence_") in stages
        ]


def drive_name(path: Path) -> str:
    """Returns the name of the drive that a scenario file describes.

    `<map>/sequence_04.yaml` is `<map>_04`; any other file has the name of
    its stem.
    """
    if path.stem.startswith("sequence_"):
        number = path.stem.removeprefix("sequence_")
        return f"{path.resolve().parent.name}_{number}"
    return path.stem
