"""Sorts the meshes of a building by what they are made of."""

from __future__ import annotations

from cns_drake.city.buildings.parts.site import Assembly, Rgb
from cns_drake.city.geometry.mesh import Mesh, merge_meshes


class Materials:
    """Collects meshes; each material becomes one mesh and one visual.

    A small building of many small pieces stays at a handful of visuals.
    """

    def __init__(self, **colours: Rgb):
        self._colours = colours
        self._pieces: dict[str, list[Mesh]] = {}

    def add(self, material: str, *meshes: Mesh) -> None:
        """Adds meshes in the building's frame."""
        if material not in self._colours:
            raise ValueError(f"unknown material {material}")
        self._pieces.setdefault(material, []).extend(meshes)

    def moved(self, translation, yaw: float = 0.0) -> Materials:
        """Returns the same, rotated about z by `yaw`, then translated."""
        result = Materials(**self._colours)
        for material, pieces in self._pieces.items():
            mesh = merge_meshes(*pieces)
            result.add(material, mesh.moved(translation, yaw))
        return result

    def finish(self, assembly: Assembly) -> None:
        """Adds one part for each material in use, named like it."""
        for material, rgb in self._colours.items():
            mesh = merge_meshes(*self._pieces.get(material, []))
            if mesh.faces:
                assembly.add(material, mesh, rgb=rgb)
