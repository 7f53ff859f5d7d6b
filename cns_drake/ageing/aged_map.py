"""Writes the map folder of an ageing city: stages for today and each year."""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import astuple, dataclass, fields
from pathlib import Path
import shutil

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry
import yaml

from cns_drake.ageing.ageing_city import AgeingCity
from cns_drake.ageing.events import Event
from cns_drake.ageing.old_world import OldWorld
from cns_drake.ageing.standing_structures import StandingStructures
from cns_drake.ageing.years import check_years
from cns_drake.base.complete_files import draft_folder
from cns_drake.base.csv_files import write_csv
from cns_drake.base.errors import InputError
from cns_drake.base.files import is_there, user_errors
from cns_drake.base.progress import doing
from cns_drake.base.yaml_files import read_yaml
from cns_drake.city.generation.stage_sizes import (
    count_triangles,
    stage_size,
    triangles_in,
)
from cns_drake.city.generation.world_sdf import world_sdf
from cns_drake.city.geometry import Mesh, MeshShape, Structure
from cns_drake.imports.map_files import YEAR_COLUMN
from cns_drake.motion.trajectory import Trajectory
from cns_drake.scenarios.drive_table import write_table
from cns_drake.scenarios.planning import plan_drive
from cns_drake.scenarios.scenario_files import (
    describe_scenario,
    load_scenario,
    make_paths_absolute,
)
from cns_drake.scene import map_folder
from cns_drake.scene.labels import MAX_INSTANCE
from cns_drake.scene.map_folder import MapFolder, stage_name
from cns_drake.scene.material_cells import (
    material_word,
    read_materials,
    write_materials,
)
from cns_drake.scene.materials import USUAL_MATERIALS
from cns_drake.scene.semantics import CLASS_IDS

HISTORY_NAME = "history.csv"
RATES_NAME = "rates.csv"
_MAX_SEED = 2**63
# Half the width of the car with its mirrors, and some room [m].
_HALF_CAR = 1.3
# Distance between the places along a drive [m].
_SPACING = 0.5


@dataclass(frozen=True)
class AgedMap:
    """The stages of an aged map, and the events between them.

    Attributes:
        years: stage -> its year; 0 is today.
        structures: stage -> number of structures.
        events: event -> how often it happened.
        changed: (N, 3) places of changed buildings in W [m].
        trajectory: the trajectory of the map's last drive.
    """

    years: Mapping[str, int]
    structures: Mapping[str, int]
    events: Mapping[str, int]
    changed: np.ndarray
    trajectory: Trajectory


def age_map(
    source: Path,
    years: Sequence[int],
    seed: int,
    rates: Mapping[str, float],
    output: Path,
    finish: Callable[[Path, AgedMap], None] = lambda folder, aged: None,
) -> AgedMap:
    """Writes a map folder in which a city ages by given numbers of years.

    Args:
        source: the folder of the map; its last stage is today.
        years: ascending years relative to today, from -200 to 200. Negative
            years lie before today, and are possible only if the column `built`
            of `structures.csv` contains the buildings' years of construction.
        seed: the seed of all random numbers, not negative.
        rates: event -> rate per year, see `cns_drake.ageing.rates.read_rates`.
        output: the folder to write, which must not exist yet.
        finish: function that can add files of your own. It is called with the
            folder and the result when all other work is done, before the folder
            gets its final name.

    Returns:
        The stages and the events.

    Raises:
        InputError: an argument or the map cannot be used.
    """
    wanted = check_years(years)
    if not 0 <= seed < _MAX_SEED:
        raise InputError(f"--seed: {seed}: not from 0 to {_MAX_SEED - 1}")
    map_folder.check_new_map(output)
    folder = MapFolder(source.resolve())
    drives = folder.recordable_drives()
    if not drives:
        raise InputError(
            f"{source}: no sequence_NN.yaml whose stage_NN.sdf is there"
        )
    doing(f"reading {folder.name}")
    ways = [plan_drive(load_scenario(path)) for path in drives]
    world = OldWorld(folder)
    if min(wanted) < 0 and world.today is None:
        raise InputError(
            f"{source}: --years: {min(wanted)}: no building has a year in "
            f"column {YEAR_COLUMN} of {map_folder.STRUCTURES_NAME}, as the "
            "past needs"
        )
    doing("looking for lots")
    city = AgeingCity(
        world, rates, seed, shapely.union_all([*map(_swept_area, ways)])
    )
    # Today is the first stage.
    others = [year for year in wanted if year != 0]
    stages = {f"{k:02d}": year for k, year in enumerate([0, *others], start=1)}
    with draft_folder(output) as draft:
        (draft / map_folder.MESH_FOLDER).mkdir()
        _copy_inputs(folder, drives, draft)
        writing = _Writing(world, draft, seed)
        shutil.copyfile(world.path, draft / stage_name("01"))
        writing.finish("01", dict.fromkeys(world.visuals))
        events: list[Event] = []
        for stage, year in stages.items():
            if year < 0:
                standing, passed = world.structures_in(year)
                events += passed if year == min(wanted) else []
                writing.stage(stage, year, standing)
            while (now := city.standing.year) < year:
                doing("ageing the city", now, max(wanted), "years")
                city.live()
            if year > 0:
                doing(f"writing year {year}")
                writing.stage(stage, year, city.standing.by_name)
        events += city.standing.events
        writing.table(city.standing.new)
        names = [field.name for field in fields(Event)]
        write_csv(draft / HISTORY_NAME, names, map(astuple, events))
        (draft / RATES_NAME).write_text(city.tally.to_csv(), "utf-8")
        _write_drives(folder, drives, draft, stages, seed)
        write_table(draft, sizes=writing.sizes)
        counts = Counter(one.event for one in events)
        aged = AgedMap(
            stages,
            {stage: number for stage, (number, _) in writing.sizes.items()},
            counts,
            _changed_places(city.standing),
            ways[-1],
        )
        # Frees memory that the pictures need.
        del world, city, writing, events
        finish(draft, aged)
    return aged


def _swept_area(trajectory: Trajectory) -> BaseGeometry:
    """Returns the area that the car covers on a drive, in W [m]."""
    number = max(2, int(trajectory.length / _SPACING))
    times = np.linspace(0.0, trajectory.duration, number)
    _, p_WB = trajectory.poses(times)
    return shapely.LineString(p_WB[:, :2]).buffer(_HALF_CAR)


class _Writing:
    """Writes stages, the meshes they need, and the structure table."""

    def __init__(self, world: OldWorld, draft: Path, seed: int):
        self._world = world
        self._draft = draft
        self._seed = seed
        self.sizes: dict[str, tuple[int, int]] = {}
        self._triangles: dict[str, int] = {}
        self._past: dict[str, Structure] = {}
        # Name of a structure -> part of it -> material, in all written stages.
        self._materials: defaultdict[str, dict[str, str]] = defaultdict(dict)

    def stage(
        self, stage: str, year: int, standing: Mapping[str, Structure | None]
    ) -> None:
        """Writes the world of a stage: the aged city in a given year.

        Args:
            stage: name of the stage.
            year: years since the original city; negative for years before.
            standing: name -> structure, for all that stand in this year; None
                for a structure that is as in the original city.
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
        self.finish(stage, standing)

    def finish(
        self, stage: str, standing: Mapping[str, Structure | None]
    ) -> None:
        """Writes the meshes of a stage, and counts its contents.

        Meshes that an earlier stage also uses are not written again. The
        arguments are those of `stage`.
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
        """Writes a mesh of the city of today, or else one of `meshes`."""
        if name in self._triangles:
            return
        place = Path(map_folder.MESH_FOLDER) / f"{name}.obj"
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

        Today's structures come first, then those of later years (`new`) in the
        order in which they are built, and last those of the past. If more years
        after today are added, the instance ids of structures built before stay
        the same.

        Raises:
            InputError: there are more structures than instance ids.
        """
        world = self._world
        rows: list[Mapping[str, object]] = [
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
            x, y, z = (f"{value:.3f}" for value in one.xyz)
            rows.append(
                {
                    "instance": first + k,
                    "name": one.name,
                    "class": one.semantic_class,
                    "label": CLASS_IDS[one.semantic_class],
                    **{"x": x, "y": y, "z": z, "yaw": f"{one.yaw:.5f}"},
                    "tags": " ".join(one.tags),
                    "material": write_materials(
                        one.semantic_class,
                        self._materials[one.name] | one.materials,
                    ),
                    "kind": one.kind_cell,
                }
            )
        columns = list(dict.fromkeys([*world.columns, "material"]))
        if any(row.get("kind") for row in rows):
            columns = list(dict.fromkeys([*columns, "kind"]))
        cells = ([row.get(name, "") for name in columns] for row in rows)
        write_csv(self._draft / map_folder.STRUCTURES_NAME, columns, cells)

    def _cell_of_old(self, row: Mapping[str, str]) -> str:
        """Returns the materials of a structure of today, with its new parts."""
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


def _copy_inputs(
    folder: MapFolder, drives: Iterable[Path], draft: Path
) -> None:
    """Copies roads, views and the waypoints of drives."""
    for path in drives:
        way = load_scenario(path).waypoints
        if way is not None:
            shutil.copyfile(way, draft / _way_name(path))
    for name in (
        map_folder.ROADS_NAME,
        map_folder.LANES_NAME,
        folder.views.name,
    ):
        if is_there(folder.path / name):
            shutil.copyfile(folder.path / name, draft / name)


def _way_name(drive: Path) -> str:
    """Returns a name for the copy of a drive's waypoints.

    It differs between drives, and from the map's own waypoint file.
    """
    return f"waypoints_{drive.stem.removeprefix('sequence_')}.csv"


def _write_drives(
    folder: MapFolder,
    drives: Sequence[Path],
    draft: Path,
    stages: Mapping[str, int],
    seed: int,
) -> None:
    """Writes a drive through each stage.

    The drive through today's stage has the route of the map's first drive. All
    others have the route of its last drive, which is the query.
    """
    for stage, year in stages.items():
        path = drives[0] if stage == "01" else drives[-1]
        values = read_yaml(path)
        if "base" in values:
            scenario = load_scenario(path)
            values = describe_scenario(scenario, folder.path)
        # Other files, such as recorded traffic, are not copied.
        make_paths_absolute(values, path)
        kept = {
            key: value
            for key, value in values.items()
            if key not in ("name", "map", "stage", "title", "without", "base")
        }
        if "waypoints" in kept:
            kept["waypoints"] = _way_name(path)
        when = "today" if year == 0 else f"in year {year} of seed {seed}"
        text = yaml.safe_dump(
            {
                "map": ".",
                "stage": stage,
                "title": f"{folder.name.capitalize()} {when}",
                **kept,
            },
            sort_keys=False,
        )
        MapFolder(draft).drive(stage).write_text(text, "utf-8")


def _changed_places(city: StandingStructures) -> np.ndarray:
    """Returns the places (N, 3) of new buildings and additions [m]."""
    places = [
        one.xyz
        for one in city.new.values()
        if one.semantic_class == "building" and one.name in city.by_name
    ]
    return np.array(places, float).reshape(-1, 3)
