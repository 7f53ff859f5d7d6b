"""The cities, both as generated and as in their files."""

from dataclasses import dataclass
import fcntl
from functools import cache
import hashlib
import os
from pathlib import Path
import pickle
from xml.etree import ElementTree

from pydrake.geometry import SceneGraph
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
import pytest

from evaluation.base import fingerprint
from worlds.city import City, make_city
from worlds.city.generation import rendering
from worlds.city.growth.stage_structures import GrowingCity
from worlds.maps import worlds_folder
from worlds.roads import RoadNetwork, load_road_network
from worlds.shapes import Structure

# Map -> its last stage, the whole city.
LAST_STAGES = {
    "metropolis": "04",
    "riverside": "02",
    "downtown": "04",
    "suburbia": "02",
}

# To draw one of these takes over ten seconds of processor time.
_BY_NIGHT = ("downtown", "metropolis", "riverside")


def by_day_or_night() -> list:
    """Returns a parameter for each map; all but Suburbia are for the night."""
    night = pytest.mark.night
    return [
        pytest.param(name, marks=night) if name in _BY_NIGHT else name
        for name in LAST_STAGES
    ]


def world_of(name: str) -> Path:
    """Returns the folder of a map."""
    return worlds_folder() / name


@dataclass(frozen=True)
class Drawn:
    """What the generator makes of the inputs of a map.

    Attributes:
        structures: all there ever are, in the order of instance ids.
        standing: stage -> structures; what stays has the same model.
        texts: relative path -> text of a file.
    """

    city: City
    structures: list[Structure]
    standing: dict[str, list[Structure]]
    texts: dict[str, str]


class _Kept(GrowingCity):
    """A city whose stages are kept; to lower its buildings takes long."""

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.standing = {}
        _grown.append(self)

    def at(self, stage):
        self.standing[stage] = super().at(stage)
        return self.standing[stage]


_grown: list[_Kept] = []
# The packages whose code draws cities.
_DRAWN_BY = ("base", "city", "roads", "scene")


def _draw(name: str) -> Drawn:
    whole = make_city(world_of(name))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rendering, "GrowingCity", _Kept)
        texts = rendering.render_city(world_of(name), whole)
    growing = _grown.pop()
    return Drawn(whole, growing.structures, growing.standing, texts)


def city(name: str) -> City:
    """Returns the generated city."""
    return drawn(name).city


@cache
def drawn(name: str) -> Drawn:
    """Returns what is generated; the first process makes it.

    It is kept until the code or the files change that it is made of.
    """
    inputs = {
        path.name: hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(world_of(name).glob("*.yaml"))
    }
    code = Path(rendering.__file__).parents[2]
    for path in sorted(code.rglob("*.*")):
        package = path.relative_to(code).parts[0]
        if package in _DRAWN_BY and path.suffix in (".py", ".yaml", ".obj"):
            inputs[str(path)] = hashlib.sha256(path.read_bytes()).hexdigest()
    folder = Path(os.environ["CNS_DRAKE_TEST_CITIES"])
    file = folder / f"{name}_{fingerprint(inputs)}.pickle"
    for other in folder.glob(f"{name}_*.pickle"):
        if other != file:
            other.unlink(missing_ok=True)
    # The file is opened without truncation, for processes that wait.
    with file.open("a+b") as stream:
        fcntl.flock(stream, fcntl.LOCK_EX)
        if file.stat().st_size == 0:
            pickle.dump(_draw(name), stream)
        stream.seek(0)
        return pickle.load(stream)


@cache
def network_of(name: str) -> RoadNetwork:
    """Returns the roads of a map."""
    return load_road_network(world_of(name) / "roads.yaml")


def stage_files(name: str) -> list[Path]:
    """Returns the committed stages, earliest first."""
    return sorted(world_of(name).glob("stage_*.sdf"))


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
def visuals(sdf: Path) -> dict[str, bytes]:
    """Returns visual name -> pose, shape and colour, as comparable text."""
    root = ElementTree.parse(sdf).getroot()
    found = list(root.iter("visual"))
    texts = {one.attrib["name"]: ElementTree.tostring(one) for one in found}
    assert len(texts) == len(found)
    return texts


def structure_of(visual: str) -> str:
    """Returns the structure that a visual is part of."""
    return visual.partition("/")[0]
