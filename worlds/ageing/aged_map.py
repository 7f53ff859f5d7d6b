"""Writes the map folder of an ageing city: stages for today and each year."""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass, fields, replace
from itertools import pairwise
from pathlib import Path
import shutil

import numpy as np
import shapely

from evaluation.base import (
    MAX_INSTANCE,
    InputError,
    doing,
    draft_folder,
    is_there,
    user_errors,
    write_csv,
)
from worlds.ageing import kinds
from worlds.ageing.buildings import Buildings
from worlds.ageing.events import TAKEN_DOWN, Event
from worlds.ageing.lots import find_lots
from worlds.ageing.old_world import GeometryReader, OldWorld
from worlds.ageing.standing_structures import StandingStructures
from worlds.ageing.street_renewal import StreetRenewal
from worlds.ageing.trees import Trees
from worlds.ageing.yearly_draws import YearlyDraws
from worlds.city import (
    count_triangles,
    lot_objects,
    stage_size,
    triangles_in,
    use_by_size,
    world_sdf,
)
from worlds.imports import YEAR_COLUMN
from worlds.maps import (
    IMPORT_NAME,
    MESH_FOLDER,
    ROADS_NAME,
    TRAFFIC_NAME,
    MapFolder,
    check_new_map,
    no_drives,
    stage_name,
)
from worlds.shapes import (
    STRUCTURES_NAME,
    USUAL_MATERIALS,
    Area,
    Mesh,
    MeshShape,
    Structure,
    Way,
    material_word,
    read_materials,
    younger_plant,
)

HISTORY_NAME = "history.csv"
RATES_NAME = "rates.csv"
_MAX_SEED = 2**63
# Half the width of the car with its mirrors, and some room [m].
_HALF_CAR = 1.3
# In each past year, a tree was lower by this height [m].
_GROWTH = 0.4
# Trees were never lower than this [m].
_LEAST_TREE = 2.0


@dataclass(frozen=True)
class AgedMap:
    """The stages of an aged map, and the events between them.

    Attributes:
        years: stage -> its year; 0 is today.
        sizes: stage -> number of its structures, and number of its triangles.
        events: event -> how often it happened.
        changed: (N, 3) places of changed buildings in W [m].
    """

    years: Mapping[str, int]
    sizes: Mapping[str, tuple[int, int]]
    events: Mapping[str, int]
    changed: np.ndarray


def age_map(
    source: Path,
    years: Sequence[int],
    seed: int,
    rates: Mapping[str, float],
    output: Path,
    read_geometry: GeometryReader,
    plan_ways: Callable[[Sequence[Path]], Sequence[Way]],
    finish: Callable[[Path, AgedMap], None] = lambda folder, aged: None,
) -> AgedMap:
    """Writes a map folder in which a city ages by given numbers of years.

    The drives of the map are not written.

    Args:
        source: the folder of the map; its last stage is today.
        years: ascending years relative to today, from -200 to 200. Negative
            years lie before today, and are possible only if the column `built`
            of `structures.csv` contains the buildings' years of construction.
        seed: the seed of all random numbers, not negative.
        rates: event -> rate per year, see `worlds.ageing.rates.read_rates`.
        output: the folder to write, which must not exist yet.
        read_geometry: function that reads the geometry of a stage.
        plan_ways: function that returns where the car drives, given the
            scenario files of the map's drives. Nothing is built there.
        finish: function that can add files, such as drives. It is called with
            the folder and the result when all other work is done, before the
            folder gets its final name.

    Returns:
        The stages and the events.

    Raises:
        InputError: an argument or the map cannot be used.
    """
    wanted = check_years(years)
    if not 0 <= seed < _MAX_SEED:
        raise InputError(f"--seed: {seed}: not from 0 to {_MAX_SEED - 1}")
    check_new_map(output)
    folder = MapFolder(source.resolve())
    drives = folder.recordable_drives()
    if not drives:
        raise no_drives(source)
    doing(f"reading {folder.name}")
    ways = plan_ways(drives)
    world = OldWorld(folder, read_geometry)
    if min(wanted) < 0 and world.today is None:
        raise InputError(
            f"{source}: --years: {min(wanted)}: no building has a year in "
            f"column {YEAR_COLUMN} of {STRUCTURES_NAME}, as the "
            "past needs"
        )
    doing("looking for lots")
    kept_free = shapely.union_all([way.area(_HALF_CAR) for way in ways])
    city = AgeingCity(world, rates, seed, kept_free)
    with draft_folder(output) as draft:
        aged = _write_map(draft, world, city, wanted, seed)
        del world, city  # Pictures need their memory.
        finish(draft, aged)
    return aged


class AgeingCity:
    """A city at the end of a year.

    It follows from the city at the end of the year before. Each object has its
    own random numbers for each year and event, so that a simulation of more
    years begins with the same events as a simulation of fewer years.

    Attributes:
        standing: the year, what stands at its end, and the events since today.
        tally: counts of these events.
    """

    def __init__(
        self,
        world: OldWorld,
        rates: Mapping[str, float],
        seed: int,
        kept_free: Area,
    ) -> None:
        """Begins with the city of today.

        Args:
            world: the city of today.
            rates: event -> rate per year, see
                `worlds.ageing.rates.read_rates`.
            seed: seed of all random draws.
            kept_free: area in W [m] on which nothing is built, because drives
                lead across it.

        Raises:
            InputError: the city has no building.
        """
        # Trees grow within distances from buildings, which stand on lots.
        lots = find_lots(world, kept_free)
        self.standing = StandingStructures(world)
        draws = YearlyDraws(self.standing, rates, seed)
        self.tally = draws.tally
        self._trees = Trees(world, self.standing, draws, seed)
        self._buildings = Buildings(
            world, self.standing, draws, self._trees, lots, kept_free
        )
        self._streets = StreetRenewal(world, self.standing, draws, kept_free)

    def live(self) -> None:
        """Simulates one year: samples which structures change."""
        self.standing.year += 1
        self._buildings.live()
        self._trees.live()
        self._streets.live()


def _write_map(
    draft: Path,
    world: OldWorld,
    city: AgeingCity,
    years: Sequence[int],
    seed: int,
) -> AgedMap:
    """Writes all files of an aged map, except those of `finish`.

    Args:
        draft: the folder to write.
        world: the city of today.
        city: the same city, which ages up to the last year.
        years: ascending years relative to today.
        seed: the seed of the ageing.
    """
    # Today is the first stage.
    others = [year for year in years if year != 0]
    stages = {f"{k:02d}": year for k, year in enumerate([0, *others], start=1)}
    (draft / MESH_FOLDER).mkdir()
    _copy_inputs(world.folder, draft)
    writing = _StageWriter(world, draft, seed)
    events = _write_stages(writing, world, city, stages)
    writing.table(city.standing.new)
    names = [field.name for field in fields(Event)]
    write_csv(draft / HISTORY_NAME, names, map(astuple, events))
    (draft / RATES_NAME).write_text(city.tally.to_csv(), "utf-8")
    return AgedMap(
        stages,
        writing.sizes,
        Counter(one.event for one in events),
        _changed_places(city.standing),
    )


# Name of the stage of today, which is the first.
_TODAY = "01"


class _StageWriter:
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
        shutil.copyfile(world.path, draft / stage_name(_TODAY))
        self._finish(_TODAY, dict.fromkeys(world.visuals))

    def stage(
        self, stage: str, year: int, standing: Mapping[str, Structure | None]
    ) -> None:
        """Writes the world of a stage: the aged city in a given year.

        Args:
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


def _write_stages(
    writing: _StageWriter,
    world: OldWorld,
    city: AgeingCity,
    stages: Mapping[str, int],
) -> list[Event]:
    """Writes all stages except today's; returns the events in order of time.

    The city ages from stage to stage.

    Args:
        writing: the object that writes the stages.
        world: the city of today.
        city: the same city, which ages up to the last stage.
        stages: stage -> its year. Years after today must ascend.
    """
    events: list[Event] = []
    for stage, year in stages.items():
        if year < 0:
            standing, passed = past_structures(world, year)
            events += passed if year == min(stages.values()) else []
            writing.stage(stage, year, standing)
        while (now := city.standing.year) < year:
            doing("ageing the city", now, max(stages.values()), "years")
            city.live()
        if year > 0:
            doing(f"writing year {year}")
            writing.stage(stage, year, city.standing.by_name)
    return events + city.standing.events


def _copy_inputs(folder: MapFolder, draft: Path) -> None:
    """Copies roads, traffic and views."""
    for name in (
        ROADS_NAME,
        TRAFFIC_NAME,
        IMPORT_NAME,
        folder.views.name,
    ):
        if is_there(folder.path / name):
            shutil.copyfile(folder.path / name, draft / name)


def _changed_places(city: StandingStructures) -> np.ndarray:
    """Returns the places (N, 3) of new buildings and additions [m]."""
    places = [
        one.xyz
        for one in city.new.values()
        if one.semantic_class == "building" and one.name in city.by_name
    ]
    return np.array(places, float).reshape(-1, 3)


def past_structures(
    world: OldWorld, year: int
) -> tuple[dict[str, Structure | None], list[Event]]:
    """Returns the structures of a past year, and the events since then.

    Buildings that were built after that year are missing, and their lots have
    another use. Trees are smaller. The city must have years of construction, so
    `world.today` is not None.

    Returns:
        Name of each structure -> the structure, or None if it is the same as
        today; and the events in order of time.
    """
    assert world.today is not None
    standing: dict[str, Structure | None] = dict.fromkeys(world.visuals)
    events = []
    for name, one in world.geometry.items():
        built = world.built.get(name)
        if built is not None and built - world.today > year:
            since = built - world.today
            events.append(Event(since, "built", name))
            del standing[name]
            for former in _objects_before(world, name, built):
                standing[former.name] = former
                events.append(
                    Event(since, TAKEN_DOWN, former.name, detail="empty plot")
                )
        elif one.semantic_class == "vegetation":
            height = one.top - one.bottom
            if height > _LEAST_TREE and one.kind == kinds.TREE:
                young = max(height + _GROWTH * year, _LEAST_TREE)
                whole = world.structure(name)
                model = younger_plant(whole.model, young)
                standing[name] = replace(whole, model=model)
    events.sort(key=lambda event: event.year)
    return standing, events


def _objects_before(
    world: OldWorld, name: str, built: int
) -> Iterator[Structure]:
    """Returns the objects on a lot before its building was built."""
    lot = world.structure(name)
    rng = np.random.default_rng(built)
    return lot_objects(lot, use_by_size(lot), {"hatchback": 1}, rng)


# A city ages by at most this many years, or was this many years younger.
LAST_YEAR = 200


def check_years(years: Iterable[int]) -> tuple[int, ...]:
    """Checks the years of an aged map, relative to today, and returns them.

    Raises:
        InputError: the years do not ascend, or a year is more than
            `LAST_YEAR` years from today.
    """
    found = tuple(years)
    text = " ".join(map(str, found))
    if not found or any(a >= b for a, b in pairwise(found)):
        raise InputError(f"--years: {text or 'none'}: not in ascending order")
    if max(map(abs, found)) > LAST_YEAR:
        raise InputError(
            f"--years: {text}: none may be beyond {LAST_YEAR} years"
        )
    return found
