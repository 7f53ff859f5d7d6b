"""The city of today: the last stage of a map, prepared for ageing."""

from collections.abc import Callable, Mapping
from functools import cached_property
from pathlib import Path
import re
from xml.etree import ElementTree

import numpy as np
import shapely

from evaluation.base import (
    InputError,
    check_regular,
    is_there,
    poses,
    product,
    read_elements,
    read_records,
    read_rows,
    to_number,
    whole_number,
)
from worlds.ageing import kinds
from worlds.imports import YEAR_COLUMN
from worlds.maps import MESH_FOLDER, MapFolder
from worlds.roads import load_road_network
from worlds.shapes import (
    Area,
    GroundSurface,
    MeshShape,
    Model,
    Part,
    Shape,
    Structure,
    StructureGeometry,
    from_above,
    ground_footprint,
    read_mesh,
    roll_pitch_yaw,
    triple,
)

# Reads the SDF file of a stage: name of each structure -> its geometry.
GeometryReader = Callable[[Path], Mapping[str, StructureGeometry]]
# Places farther than this from the origin are no places of a city [m].
_FARTHEST = 1e7
# The height of the ground is known this far around buildings [m].
_AROUND = 40.0
# Colour in the aged map of parts without one.
_GREY = (0.6, 0.6, 0.6)
# The only files that a stage may name, since only these are copied to the aged
# map.
_OWN_MESH = re.compile(rf"{MESH_FOLDER}/[^/]+\.obj")


class OldWorld:
    """The last stage of a map, which stands for the present.

    Attributes:
        columns: names of the columns of the map's structure table.
        rows: name of a structure -> its row in this table, in all stages of the
            map.
        geometry: name of a structure of the last stage -> its geometry in W,
            with its entry in the table.
        visuals: name of a structure of the last stage -> SDF texts of its
            visuals.
        built: name of a structure -> year of construction, for structures whose
            year is in the table.
        today: calendar year of the stage; None if the table has no years.
        folder: the folder of the map.
        path: the SDF file of the stage.
    """

    def __init__(self, folder: MapFolder, read_geometry: GeometryReader):
        """Reads the last stage of a map.

        Args:
            folder: the folder of the map.
            read_geometry: function that reads the geometry of a stage.

        Raises:
            InputError: the map has no stage; or the last stage cannot be
                loaded, or is not a world of one link with visuals named
                <structure>/<part>.
        """
        stages = list(folder.stages().values())
        if not stages:
            raise InputError(f"{folder.path}: no stage_NN.sdf: not a map")
        self.folder = folder
        self.path = stages[-1]
        self._read_table()
        self.visuals = _read_visuals(self.path)
        self.geometry = read_geometry(self.path)
        if self.geometry.keys() != self.visuals.keys():
            raise InputError(_not_one_model(self.path))
        self.built = {
            name: int(row[YEAR_COLUMN])
            for name, row in self.rows.items()
            if row.get(YEAR_COLUMN)
        }
        self.today = max(self.built.values(), default=None)

    def _read_table(self) -> None:
        path = self.folder.structures
        whole = ("instance", "label", YEAR_COLUMN)
        real = ("x", "y", "z", "yaw")
        records = read_records(path, ("name", "class", *whole[:2], *real))
        self.columns = read_rows(path)[0][1]
        for line, row in records:
            where = f"{path}: line {line}"
            for name in whole:
                if name != YEAR_COLUMN or row.get(name):
                    whole_number(row[name], f"{where}: {name}")
            for name in real:
                _number_within(row[name], _FARTHEST, f"{where}: {name}")
        self.rows = {row["name"]: row for _, row in records}

    def of_class(self, *classes: str) -> list[StructureGeometry]:
        """Returns the geometry of structures of some classes, by name."""
        return [
            one
            for one in self.geometry.values()
            if one.semantic_class in classes
        ]

    def structure(self, name: str) -> Structure:
        """Returns a structure of today as a model with a pose.

        Its footprint is the convex hull of its parts near the ground.

        Raises:
            InputError: a shape or a mesh of the structure is of an unsupported
                kind, or the table does not contain the structure.
        """
        row = self.rows.get(name)
        if row is None:
            raise InputError(f"{self.folder.structures}: no row for {name}")
        xyz = triple(float(row[axis]) for axis in "xyz")
        yaw = float(row["yaw"])
        X_SW = poses.inverse(poses.yaw_pose(yaw, *xyz))
        parts = []
        meshes = {}
        geometry = self.geometry[name]
        materials = geometry.entry.materials
        for one in geometry.parts:
            X_SG = product(X_SW, one.X_WG)
            shape = one.shape
            if shape is None:
                raise InputError(
                    f"{self.path}: {name}/{one.name}: a shape that ageing "
                    "cannot change"
                )
            if isinstance(shape, MeshShape):
                file = self.folder.path / MESH_FOLDER / f"{shape.mesh}.obj"
                try:
                    check_regular(file)
                    meshes[shape.mesh] = read_mesh(file.resolve())
                except ValueError:
                    raise InputError(
                        f"{file}: not an OBJ file that ageing can change"
                    ) from None
            parts.append(
                Part(
                    one.name,
                    shape,
                    triple(X_SG[:3, 3].round(4)),
                    triple(np.round(roll_pitch_yaw(X_SG[:3, :3]), 5)),
                    # Colours are read in single precision.
                    triple(np.round(one.rgb or _GREY, 6)),
                    materials.get(one.name, materials.get("")),
                )
            )
        model = Model(tuple(parts), meshes, ground_footprint(parts, meshes))
        return Structure(
            name,
            geometry.semantic_class,
            model,
            xyz,
            yaw,
            geometry.entry.tags,
            geometry.kind,
        )

    @cached_property
    def shapes(self) -> dict[str, list[Shape]]:
        """The shapes of each structure, by its name.

        Shapes of kinds that the city generator does not use are left out.
        """
        return {
            name: [p.shape for p in one.parts if p.shape is not None]
            for name, one in self.geometry.items()
        }

    def triangles(self, name: str) -> np.ndarray:
        """Returns the triangles (M, 3, 3) of a structure in W [m]."""
        found = [one.triangle_corners for one in self.geometry[name].parts]
        return np.concatenate([np.zeros((0, 3, 3)), *found])

    @cached_property
    def ground(self) -> GroundSurface:
        """The ground below and around buildings."""
        feet = [t.footprint for t in self.of_class("building", "pole")]
        near = shapely.union_all(feet).convex_hull.buffer(_AROUND)
        return GroundSurface(self.geometry, near)

    @cached_property
    def streets(self) -> Area:
        """Area of carriageways, adjacent car parks and sidewalks, in W [m]."""
        return shapely.union_all(
            [self.ground.carriageway, self.area(self._is_street)]
        )

    @cached_property
    def open_ground(self) -> Area:
        """Area of the ground outside streets, parks and water, in W [m]."""
        return self.area(_is_open).difference(self.streets)

    def area(self, wanted: Callable[[StructureGeometry], bool]) -> Area:
        """Returns the area that selected structures cover in W [m].

        The structures are seen from above.

        Args:
            wanted: function that returns whether a structure is selected.
        """
        found = [
            from_above(part.triangle_corners)
            for one in self.geometry.values()
            if wanted(one)
            for part in one.parts
        ]
        joined = shapely.union_all(np.concatenate([[], *found]), grid_size=0.01)
        return joined.buffer(0.05).buffer(-0.05)

    @staticmethod
    def _is_street(one: StructureGeometry) -> bool:
        is_bay = one.kind == kinds.PARKING_BAYS
        return one.semantic_class == "sidewalk" or is_bay

    def junctions(self) -> dict[str, Area]:
        """Returns junctions' areas in W by name; empty without `roads.yaml`."""
        if not is_there(self.folder.roads):
            return {}
        network = load_road_network(self.folder.roads)
        return dict(sorted(network.junction_areas.items()))


def _is_open(one: StructureGeometry) -> bool:
    is_ground = one.semantic_class in ("terrain", "other-ground", "parking")
    return is_ground and not kinds.is_never_built_on(one.kind)


def _read_visuals(path: Path) -> dict[str, list[str]]:
    """Returns the SDF texts of each structure's visuals, by its name."""
    root = read_elements(path)
    visuals = root.findall("world/model/link/visual")
    if len(root.findall("world//model")) != 1 or not all(
        "/" in one.get("name", "") for one in visuals
    ):
        raise InputError(_not_one_model(path))
    for one in root.iter("uri"):
        if not _OWN_MESH.fullmatch(one.text or ""):
            raise InputError(
                f"{path}: uri: {one.text!r} is no file {MESH_FOLDER}/NAME.obj "
                "of the map"
            )
    lines: dict[str, list[str]] = {}
    for one in visuals:
        name = one.attrib["name"].partition("/")[0]
        line = ElementTree.tostring(one, encoding="unicode").strip()
        lines.setdefault(name, []).append(line)
    return lines


def _not_one_model(path: Path) -> str:
    return (
        f"{path}: not one model with visuals named <structure>/<part>, as "
        "`cns-drake city` and `import` write it"
    )


def _number_within(text: str, largest: float, where: object) -> float:
    """Returns the number in a cell, from -`largest` to `largest`.

    Raises:
        InputError: the text is not a number, or its absolute value exceeds
            `largest`. The message begins with `where`.
    """
    value = to_number(text)
    if not abs(value) <= largest:
        raise InputError(
            f"{where}: {text[:40]!r} is no number up to {largest:g}"
        )
    return value
