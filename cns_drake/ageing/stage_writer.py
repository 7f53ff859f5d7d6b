"""Writes the stages of an aged map, and the table of their structures."""

from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
import shutil

from cns_drake.ageing.old_world import OldWorld
from cns_drake.base import InputError, user_errors, write_csv
from cns_drake.city import (
    Mesh,
    MeshShape,
    Structure,
    count_triangles,
    stage_size,
    triangles_in,
    world_sdf,
)
from cns_drake.scene import (
    MAX_INSTANCE,
    MESH_FOLDER,
    STRUCTURES_NAME,
    USUAL_MATERIALS,
    material_word,
    read_materials,
    stage_name,
)

# Name of the stage of today, which is the first.
TODAY = "01"


class StageWriter:
    """Writes stages, the meshes they need, and the structure table.

    Attributes:
        sizes: stage -> number of its structures, and number of its triangles.
    """

    def __init__(self, world: OldWorld, draft: Path, seed: int) -> None:
        """Writes the stage of today.

        Args:
            world: the city of today.
            draft: the folder to write.
            seed: seed of the ageing; a comment in each stage states the seed.
        """
        self._world = world
        self._draft = draft
        self._seed = seed
        self.sizes: dict[str, tuple[int, int]] = {}
        self._triangles: dict[str, int] = {}
        self._past: dict[str, Structure] = {}
        # Name of a structure -> part of it -> material, in all written stages.
        self._materials: defaultdict[str, dict[str, str]] = defaultdict(dict)
        shutil.copyfile(world.path, draft / stage_name(TODAY))
        self._finish(TODAY, dict.fromkeys(world.visuals))

    def stage(
        self, stage: str, year: int, standing: Mapping[str, Structure | None]
    ) -> None:
        """Writes the world of a stage: the aged city in a given year.

        Args:
            stage: name of the stage.
            year: years since the original city; negative for years before.
            standing: name of each structure that stands in this year -> the
                structure, or None if it is the same as in the original city.
        """
        world = self._world
        new = [one for one in standing.values() if one is not None]
        for one in new:
            self._materials[one.name] |= one.materials
        old = [
            line
            for name, one in standing.items()
            if one is None
            for line in world.visuals[name]
        ]
        text = world_sdf(
            f"{world.folder.name}_year_{year}",
            new,
            comment=f"{world.folder.name} in year {year}, aged by cns-drake "
            f"with seed {self._seed}.",
            before=old,
        )
        (self._draft / stage_name(stage)).write_text(text, "utf-8")
        if year < 0:
            known = world.visuals
            self._past |= {o.name: o for o in new if o.name not in known}
        self._finish(stage, standing)

    def _finish(
        self, stage: str, standing: Mapping[str, Structure | None]
    ) -> None:
        """Writes a stage's meshes, and counts its structures and triangles.

        Meshes that an earlier stage also uses are not written again. The
        arguments are the same as for `stage`.
        """
        new = [one for one in standing.values() if one is not None]
        old = [name for name, one in standing.items() if one is None]
        shapes = [one for name in old for one in self._world.shapes[name]]
        meshes: dict[str, Mesh] = {}
        for one in new:
            meshes |= one.model.meshes
        own = [part.shape for one in new for part in one.model.parts]
        for shape in (*shapes, *own):
            if isinstance(shape, MeshShape):
                self._write_mesh(shape.mesh, meshes)
        number, triangles = stage_size(new, self._triangles)
        triangles += count_triangles(shapes, self._triangles)
        self.sizes[stage] = number + len(old), triangles

    def _write_mesh(self, name: str, meshes: Mapping[str, Mesh]) -> None:
        """Copies a mesh from today's map, or writes it from `meshes`.

        Does nothing if the mesh was written before.
        """
        if name in self._triangles:
            return
        place = Path(MESH_FOLDER) / f"{name}.obj"
        path = self._world.folder.path / place
        if path.is_file():
            with user_errors(path):
                obj = path.read_bytes()
        else:
            obj = meshes[name].to_obj().encode()
        (self._draft / place).write_bytes(obj)
        self._triangles[name] = triangles_in(obj.decode("latin-1"))

    def table(self, new: Mapping[str, Structure]) -> None:
        """Writes the structure table of all stages.

        Today's structures come first. Structures of later years (`new`) follow
        in the order in which they are built, and structures of the past come
        last. If later years are added, today's structures and those of the
        earlier `new` years keep their instance ids.

        Raises:
            InputError: there are more structures than instance ids.
        """
        world = self._world
        rows: list[Mapping[str, str]] = [
            {**row, "material": self._cell_of_old(row)}
            for row in world.rows.values()
        ]
        ids = [int(row["instance"]) for row in world.rows.values()]
        others = {n: o for n, o in self._past.items() if n not in new}
        first = max(ids, default=0) + 1
        if first + len(new) + len(others) > MAX_INSTANCE:
            raise InputError(
                f"{world.path}: {first + len(new)} structures are more than "
                f"instance ids can count ({MAX_INSTANCE})"
            )
        for k, one in enumerate((*new.values(), *others.values())):
            rows.append(one.row(first + k, self._materials[one.name]))
        columns = list(dict.fromkeys([*world.columns, "material"]))
        if any(row.get("kind") for row in rows):
            columns = list(dict.fromkeys([*columns, "kind"]))
        cells = ([row.get(name, "") for name in columns] for row in rows)
        write_csv(self._draft / STRUCTURES_NAME, columns, cells)

    def _cell_of_old(self, row: Mapping[str, str]) -> str:
        """Returns the cell `material` of a structure of today.

        The cell also contains the materials of parts that the structure got
        while the city aged. `row` is the structure's row in today's table.
        """
        cell = row.get("material", "")
        known = read_materials(cell)
        usual = known.get("", USUAL_MATERIALS[row["class"]])
        new = self._materials.get(row["name"], {})
        words = [
            material_word(part, material)
            for part, material in new.items()
            if part not in known and material != usual
        ]
        return " ".join([*cell.split(), *words])
