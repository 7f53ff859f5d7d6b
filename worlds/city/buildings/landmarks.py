"""Landmarks: archetypes whose buildings are a few fixed models from files.

Each folder in `landmark_models` contains one model. The folder's name is the
name of the archetype, an underscore and a letter. The folder contains the
model's meshes as OBJ files, and `model.yaml`:

    size: [50, 30]        # lengths of the model's lot along x and y [m]; the
                          # origin is the middle of the lot
    overhang: [1.5, 1.5]  # how far eaves reach beyond the lot, x and y [m]
    height: 17            # height of the model [m]
    parts:
    - name: walls         # name of the part
      mesh: walls         # an OBJ file in the folder or in `object_meshes`
      xyz: [0, 0, 1.8]    # position of the part [m]
      yaw: 1.5708         # heading, a multiple of pi/2 [rad]; 0 by default
      scale: [1, 1, 2]    # scale of a mesh in `object_meshes`; 1 by default
      rgb: [0.8, 0.74, 0.64]
      material: glass     # name of the material; by default the class's own
"""

from collections import defaultdict
from functools import cache
from pathlib import Path

import numpy as np
from pydantic import BaseModel

from evaluation.base import parse_yaml
from worlds.city.facades.building import Building
from worlds.shapes import Finish, Mesh, MeshShape, Rgb, read_mesh, triple

_MODELS = Path(__file__).parent / "landmark_models"
_Triple = tuple[float, float, float]


class _Part(BaseModel):
    """A part of a model, as the docstring of this module describes it."""

    name: str
    mesh: str
    xyz: _Triple = (0.0, 0.0, 0.0)
    yaw: float = 0.0
    scale: _Triple = (1.0, 1.0, 1.0)
    rgb: Rgb
    material: str | None = None


class _Model(BaseModel):
    """The contents of `model.yaml`, see the docstring of this module."""

    size: tuple[float, float]
    overhang: tuple[float, float]
    height: float
    parts: list[_Part]


def _folders_by_archetype() -> dict[str, list[Path]]:
    """Returns archetype -> folders of its models, in order."""
    folders = defaultdict(list)
    for path in sorted(_MODELS.glob("*/model.yaml")):
        folders[path.parent.name.rsplit("_", 1)[0]].append(path.parent)
    return dict(folders)


# Archetype -> folders of its models.
LANDMARKS = _folders_by_archetype()


class Landmark(Building):
    """A landmark: a fixed model from a file, stretched to fit its site."""

    def draw(self) -> None:
        """Chooses one of the landmark's models at random."""
        self.folder = self.pick(LANDMARKS[self.kind.name])

    def build(self) -> None:
        """Adds the parts of the landmark's model.

        The model is stretched to the building's height, and to the size of the
        building's site, which must be a rectangle.
        """
        x0, y0, x1, y1 = self.site.bounds
        model = _read_model(self.folder)
        lot, size = np.array((x1 - x0, y1 - y0)), np.array(model.size)
        # On a lot wider than the model, overhanging parts keep their reach.
        reach = np.where(lot > size, 2 * np.array(model.overhang), 0.0)
        stretch = np.array(
            [*(lot + reach) / (size + reach), self.height / model.height]
        )
        middle = np.array(((x0 + x1) / 2, (y0 + y1) / 2, 0.0))
        for part in model.parts:
            quarters = round(part.yaw / (np.pi / 2))
            along = stretch[[1, 0, 2]] if quarters % 2 else stretch
            path = self.folder / f"{part.mesh}.obj"
            if path.exists():
                name = f"{self.site.name}_{part.mesh}"
                if name not in self.meshes:
                    self.define(part.mesh, _stretched(read_mesh(path), along))
                shape = MeshShape(name)
            else:
                scale = triple(np.round(along * part.scale, 4))
                shape = self.shared(part.mesh, scale)
            xyz = middle + stretch * part.xyz
            finish = Finish(part.rgb, part.material)
            self.place(part.name, shape, xyz, yaw=part.yaw, finish=finish)


@cache
def _read_model(folder: Path) -> _Model:
    """Returns the contents of `model.yaml` in a folder."""
    text = (folder / "model.yaml").read_text(encoding="utf-8")
    return _Model.model_validate(parse_yaml(text))


def _stretched(mesh: Mesh, along: np.ndarray) -> Mesh:
    """Returns a mesh stretched along x, y and z by the factors `along`.

    The foundation, which lies below the ground, keeps its depth.
    """
    vertices = mesh.vertices * along
    below = mesh.vertices[:, 2] < 0.0
    vertices[below, 2] = mesh.vertices[below, 2]
    return Mesh(vertices, mesh.faces)
