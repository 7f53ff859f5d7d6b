"""Areas of one kind of ground, and the structures of their surfaces."""

from collections.abc import Iterator
from typing import NamedTuple

from shapely.geometry import MultiPolygon
from shapely.geometry.base import BaseGeometry

from worlds.shapes import (
    HeightMap,
    Mesh,
    MeshShape,
    Model,
    Part,
    Structure,
    surface_mesh,
    tiles,
)

# Tag of structures that are ground. No stage may lack them.
GROUND_TAG = "ground"
# The ground is divided into squares of this size, so that each part has small
# bounds [m].
TILE = 64.0


class Covering(NamedTuple):
    """A kind of ground, such as parking bays, and the area that it covers.

    Attributes:
        name: name of the structure of this ground.
        semantic_class: a key of `worlds.shapes.semantics.CLASS_IDS`.
        area: the area in W [m].
        rgb: colour.
        material: name of the material; by default the usual material
            of the class.
    """

    name: str
    semantic_class: str
    area: BaseGeometry
    rgb: tuple[float, float, float]
    material: str | None = None

    def tiles(self) -> Iterator[tuple[str, MultiPolygon]]:
        """Yields the name and the polygons of each square tile of the area."""
        for k, piece in enumerate(tiles(self.area, TILE)):
            yield f"tile_{k:02d}", piece

    def surface(
        self, height: HeightMap | float, spacing: float = 0.0
    ) -> Structure:
        """Returns the surface as a structure with one part per tile.

        `height` is one height or a height map [m]. To follow a height map, give
        the distance between vertices as `spacing` [m]; with 0, the surface has
        only the vertices of the area's outline.
        """
        return self.structure(
            {
                part: surface_mesh(piece, height, spacing)
                for part, piece in self.tiles()
            }
        )

    def structure(self, pieces: dict[str, Mesh]) -> Structure:
        """Returns a structure of this kind, made of meshes given in W.

        `pieces` maps the name of a part to its mesh. Meshes without faces,
        which come from slivers, are left out.
        """
        pieces = {part: mesh for part, mesh in pieces.items() if mesh.faces}
        meshes = {f"{self.name}_{part}": mesh for part, mesh in pieces.items()}
        parts = tuple(
            Part(part, MeshShape(mesh), rgb=self.rgb, material=self.material)
            for part, mesh in zip(pieces, meshes, strict=True)
        )
        model = Model(parts, meshes, self.area)
        origin = (0.0, 0.0, 0.0)
        return Structure(
            self.name, self.semantic_class, model, origin, tags=(GROUND_TAG,)
        )


def water(name: str, area: BaseGeometry) -> Covering:
    """Returns the water that covers an area in W [m].

    `name` is the name of the water's structure.
    """
    return Covering(name, "other-ground", area, (0.25, 0.38, 0.45), "water")
