"""Metropolis as the generator makes it and as its files hold it."""

from functools import cache
from pathlib import Path

from pydrake.geometry import Role, SceneGraph
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

from cns_drake.city.layout import City, make_city
from cns_drake.paths import worlds_folder

WORLD = worlds_folder() / "metropolis"


@cache
def city() -> City:
    """Returns the generated city."""
    return make_city(WORLD)


def stage_files() -> list[Path]:
    """Returns the committed stages, earliest first."""
    return sorted(WORLD.glob("stage_*.sdf"))


@cache
def parse_strictly(sdf: Path) -> SceneGraph:
    """Parses a world as Drake does, with strict parsing."""
    scene_graph = SceneGraph()
    plant = MultibodyPlant(time_step=0.0)
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    parser = Parser(plant)
    parser.SetStrictParsing()
    parser.AddModels(str(sdf))
    plant.Finalize()
    return scene_graph


@cache
def visuals(sdf: Path) -> dict[str, tuple]:
    """Returns visual name -> pose, shape and colour, as comparable text."""
    inspector = parse_strictly(sdf).model_inspector()
    result = {}
    for geometry_id in inspector.GetAllGeometryIds(Role.kPerception):
        name = inspector.GetName(geometry_id).rpartition("::")[2]
        properties = inspector.GetPerceptionProperties(geometry_id)
        result[name] = (
            str(inspector.GetPoseInFrame(geometry_id).GetAsMatrix34().tolist()),
            str(inspector.GetShape(geometry_id)),
            str(properties.GetProperty("phong", "diffuse")),
        )
    return result


def structure_of(visual: str) -> str:
    """Returns the structure that a visual is part of."""
    return visual.partition("/")[0]
