"""Makes a map folder, with stages and drives, from the file of a city."""

from collections import Counter, defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
import math
from pathlib import Path
import re

import numpy as np
import shapely
from shapely.geometry import MultiLineString
from shapely.geometry.base import BaseGeometry
from threadpoolctl import threadpool_limits

from evaluation.base import InputError, doing, dot, draft_folder, reads
from worlds.imports import map_files, overview
from worlds.imports.dressing.dressed_city import dress_city
from worlds.imports.drives.cell_graph import CellGraph
from worlds.imports.drives.free_space import FreeSpace, find_free_space
from worlds.imports.drives.search import find_drives
from worlds.imports.drives.steerable_drives import (
    WaypointRoute,
    driven_path,
    with_ground_heights,
)
from worlds.imports.drives.street_graph import StreetGraph
from worlds.imports.faults import ImportFaults
from worlds.imports.foreign_city import ForeignCity
from worlds.imports.ground import ground_of, ground_structures
from worlds.imports.grown_city import grow
from worlds.imports.imported_objects import FARTHEST, ImportedObject
from worlds.imports.map_source import MapSource, source_of
from worlds.imports.options import DriveOn, ImportOptions
from worlds.imports.report import ImportReport
from worlds.imports.staged_city import StagedCity, stage_city
from worlds.maps import MESH_FOLDER, check_new_map
from worlds.shapes import (
    POINT_SPACING,
    TIGHTEST_RADIUS,
    Mesh,
    MeshShape,
    load_waypoint_path,
    read_waypoints,
)

# Plausible heights of the median building of a city, and a usual one [m].
_PLAUSIBLE_HEIGHTS = (1.2, 200.0)
_USUAL_HEIGHT = 8.0
# Factors between units that are confused: kilometres, metres, feet, inches,
# centimetres and millimetres.
_FACTORS = (1e6, 1000.0, 100.0, 3.28084, 0.3048, 0.0254, 0.01, 0.001)

# Share of the buildings that usually change between an added first stage and
# today.
_CHANGED_SHARE = 0.3
# A function that gets a map's folder, and the name of each stage -> the numbers
# of structures and triangles in the stage.
Finish = Callable[[Path, Mapping[str, tuple[int, int]]], None]


# One thread for linear algebra: the matrices are small and several processes
# run, so more threads would only wait for each other.
@threadpool_limits.wrap(limits=1)  # type: ignore[untyped-decorator]
@reads
def import_city(
    source: Path | str,
    output: Path | str,
    options: ImportOptions,
    finish: Finish = lambda folder, sizes: None,
) -> ImportReport:
    """Writes a map folder from a file of a real city.

    Args:
        source: a file of one of `map_sources`.
        output: the folder to write, which must not exist yet.
        options: the options of the import.
        finish: function that can add files. It is called with the folder and
            the sizes of its stages (see `write_world`), when the folder
            contains all other files and has its final name, but still lies in a
            temporary folder. If `finish` fails, nothing is left.

    Returns:
        Counts of what was imported.

    Raises:
        InputError: if the file or the options cannot be used, or the folder
            exists or cannot be written.

    Example:
        from worlds import ImportOptions, import_city

        report = import_city("delft.city.json", "delft", ImportOptions())
    """
    source, output = Path(source), Path(output)
    kind = source_of(source)
    _check_options(kind, source, output, options)
    own = None if options.along is None else [drive_along(options.along)]
    doing(f"reading {source}")
    if kind.read is None:
        return _import_roads(kind, source, output, options, own, finish)
    city = kind.read(source, options)
    city.faults.check_ruins(source, map(city.source_of, city.objects))
    _check_sizes(source, city.objects)
    staged = stage_city(source, city, options)
    changes = None
    if options.grow is not None:
        staged, changes = grow(staged, options.grow, options.seed)
    doing("looking for streets")
    ground = ground_of(staged.kept, city.level)
    space = find_free_space(staged.kept, ground)
    side = options.drive_on or ("left" if city.keeps_left else "right")
    drives = own or _find_drives(city, space, side)
    if options.within is not None:
        staged = _cropped_city(staged, drives, options.within, city.faults)
        ground = ground_of(staged.kept, city.level)
    drives = with_ground_heights(drives, ground.height, city.faults)
    bare = staged.kept
    dressing = None
    with draft_folder(output) as draft:
        (draft / MESH_FOLDER).mkdir()
        overview.draw_overview(draft / "from_above.png", bare, space, drives)
        if options.dressed:
            doing("dressing buildings and streets")
            dressing = dress_city(staged, city, drives, ground, options.seed)
            staged = dressing.city
        doing(f"writing {output}")
        guessed_ground = (
            dressing.guessed_ground
            if dressing
            else ground_structures(bare, ground)
        )
        sizes = map_files.write_world(
            draft, source, staged, guessed_ground, dressing
        )
        facts = map_files.city_facts(
            city, options, list(staged.standing), changes, dressing
        )
        map_files.write_facts(draft, source, facts, city.faults)
        built = set(map(city.source_of, bare))
        if dressing is not None:
            built |= dressing.sources
        report = _report_of(staged, drives, city, len(built))
        map_files.write_report(draft, report)
        map_files.write_drives(
            draft,
            _titles_of_stages(staged, options),
            [drive.waypoints for drive in drives],
        )
        finish(draft, sizes)
    return report


def _check_sizes(source: Path, objects: Sequence[ImportedObject]) -> None:
    """Checks that the buildings have plausible heights.

    Each value of a file in another unit is plausible, but the city is not.
    """
    heights = [
        np.ptp(one.triangles[:, :, 2])
        for one in objects
        if "building" in one.object_type.lower()
    ]
    low, high = _PLAUSIBLE_HEIGHTS
    height = float(np.median(heights)) if heights else low
    if low <= height <= high:
        return
    away = {
        factor: abs(math.log(max(height, 1e-9) * factor / _USUAL_HEIGHT))
        for factor in _FACTORS
    }
    factor = min(away, key=lambda one: away[one])
    raise InputError(
        f"{source}: the median building is {height:.3g} m high; "
        + (
            f"multiply coordinates by {factor:g}?"
            if height
            else "footprints are no city"
        )
    )


def with_usual_growth(source: Path, options: ImportOptions) -> ImportOptions:
    """Returns options by which a dressed city has two stages at least.

    Of a city that would have a single stage, some buildings are missing in an
    additional first stage.

    Args:
        source: a file of one of `map_sources`.
        options: the options; their `grow` stays if it is given.

    Raises:
        InputError: the file has an unknown ending.
    """
    has_stages = bool(options.years) or source_of(source).has_stages
    if options.grow is not None or has_stages or not options.dressed:
        return options
    return replace(options, grow=_CHANGED_SHARE)


def _titles_of_stages(
    staged: StagedCity, options: ImportOptions
) -> dict[str, str]:
    """Returns for each stage the words that end the titles of its drives."""
    titles = [f" in {year}" for year in options.years] or [""]
    if options.grow is not None:
        titles = [", not all of it built", ""]
    return dict(zip(staged.standing, titles, strict=True))


def _find_drives(
    city: ForeignCity, space: FreeSpace, side: DriveOn
) -> list[WaypointRoute]:
    """Returns at most two drives: along streets or, without them, anywhere."""
    streets = StreetGraph(city.streets, space, side)
    return find_drives(streets) or find_drives(CellGraph(space))


def _report_of(
    staged: StagedCity,
    drives: Sequence[WaypointRoute],
    city: ForeignCity,
    num_built: int,
) -> ImportReport:
    faults = city.faults
    return ImportReport(
        kinds=dict(Counter(one.object_type for one in staged.kept)),
        triangles=sum(one.num_own_triangles for one in staged.kept),
        stages={
            stage: len(objects) for stage, objects in staged.standing.items()
        },
        undated=staged.undated,
        dated=staged.dated,
        drives=tuple(drive.length for drive in drives),
        faults=faults.rows(),
        parts=faults.parts(),
        num_elements=city.num_elements,
        num_built=num_built,
        shares=faults.shares(_volumes(city.objects), city.num_elements),
    )


def _volumes(objects: Sequence[ImportedObject]) -> dict[str, float]:
    """Returns the volume of each building above its lowest point [m^3].

    The keys are the names by which faults are counted.
    """
    volumes: defaultdict[str, float] = defaultdict(float)
    for one in objects:
        size = np.ptp(one.triangles, axis=(0, 1))
        if one.is_building and (size < FARTHEST).all():
            a, b, c = np.moveaxis(one.triangles, 1, 0)
            twice_area = np.cross(b - a, c - a)[:, 2]
            height = (a + b + c)[:, 2] / 3.0 - one.triangles[:, :, 2].min()
            volumes[_name_in_faults(one)] += (
                abs(float(dot(twice_area, height))) / 2.0
            )
    return dict(volumes)


def _name_in_faults(imported: ImportedObject) -> str:
    """Returns the name of an object that counts of faults give as an example.

    Parts of a multipolygon of OpenStreetMap have a number behind their id.
    """
    name = imported.structure.name
    found = re.match(r"building_([nwr]-?\d+)(_\d+)?$", name)
    return found[1] if found else name


def _check_options(
    kind: MapSource, source: Path, output: Path, options: ImportOptions
) -> None:
    """Checks the options before the file is read."""
    kind.check_options(source, options)
    if options.grow is not None and options.years:
        raise InputError(
            "--grow: --years define the stages already; give one of them"
        )
    if options.lod is not None and not math.isfinite(options.lod):
        raise InputError(f"--lod: {options.lod} is not a finite number")
    check_new_map(output)


def _import_roads(
    kind: MapSource,
    source: Path,
    output: Path,
    options: ImportOptions,
    own: Sequence[WaypointRoute] | None,
    finish: Finish,
) -> ImportReport:
    """Writes a map folder from a road network, as `import_city` does.

    `own` are drives that replace the proposed drives; None to propose drives.
    """
    with draft_folder(output) as draft:
        assert kind.write_town is not None
        report, sizes = kind.write_town(source, options, own, draft)
        map_files.write_report(draft, report)
        finish(draft, sizes)
    return report


def drive_along(path: Path) -> WaypointRoute:
    """Returns the drive along the waypoints in a CSV file; heights are ignored.

    Raises:
        InputError: if the file cannot be used, or a bend is too tight.
    """
    points = read_waypoints(path).points
    control = load_waypoint_path(
        path, POINT_SPACING, ground=lambda xy: np.zeros(len(xy))
    ).points[:, :2]
    driven, radii = driven_path(control)
    radius = radii.min()
    x, y = driven[radii.argmin()]
    if radius < TIGHTEST_RADIUS:
        raise InputError(
            f"{path}: a bend at {x:.1f}, {y:.1f} has a radius of {radius:.2f} "
            f"m; the car needs {TIGHTEST_RADIUS:.2f} m"
        )
    return WaypointRoute(points[:, :2], control)


def _cropped_city(
    city: StagedCity,
    drives: Sequence[WaypointRoute],
    distance: float,
    faults: ImportFaults,
) -> StagedCity:
    """Returns a city without structures far from drives.

    A structure is kept if its bounding box is within `distance` [m] of a drive;
    all other structures are counted in `faults`. Terrain is cut to the part
    near the drives.
    """
    if not drives:
        raise InputError("--within: no drive was found; give one with --along")
    paths = MultiLineString([drive.path for drive in drives])
    shapely.prepare(paths)
    changed: dict[ImportedObject, ImportedObject | None] = {}
    for kept in city.kept:
        corners = kept.triangles.reshape(-1, 3)
        if not _are_near(corners[None], paths, distance)[0]:
            name = _name_in_faults(kept)
            faults.add("structure far from the drives, left out", name)
            changed[kept] = None
        elif kept.object_type == "TINRelief":
            changed[kept] = _cropped_terrain(kept, paths, distance)
    cropped = city.replaced(changed)
    if not cropped.kept:
        raise InputError(
            f"--within: nothing stands within {distance:g} m of the drives"
        )
    return cropped


def _are_near(
    corners: np.ndarray, paths: BaseGeometry, distance: float
) -> np.ndarray:
    """Returns (M,) bool: whether bounding boxes are near paths.

    `corners` (M, N, 3) contains the N corners of the surface in each box [m].
    """
    low, high = corners[:, :, :2].min(axis=1), corners[:, :, :2].max(axis=1)
    boxes = shapely.box(*low.T, *high.T)
    return np.asarray(shapely.dwithin(boxes, paths, distance))


def _cropped_terrain(
    terrain: ImportedObject, paths: BaseGeometry, distance: float
) -> ImportedObject:
    """Returns the part of a terrain that is within `distance` of paths [m].

    Meshes are cut by whole triangles. Parts of another shape, which no format
    has for terrain, are kept as they are.
    """
    model = terrain.structure.model
    meshes = {}
    for name, mesh in model.meshes.items():
        faces = mesh.triangles()
        near = faces[_are_near(mesh.vertices[faces], paths, distance)]
        used, index = np.unique(near, return_inverse=True)
        corners = map(tuple, index.reshape(-1, 3).tolist())
        meshes[name] = Mesh(mesh.vertices[used], tuple(corners))
    parts = tuple(
        part
        for part in model.parts
        if not isinstance(part.shape, MeshShape)
        or meshes[part.shape.mesh].faces
    )
    filled = {name: mesh for name, mesh in meshes.items() if mesh.faces}
    structure = replace(
        terrain.structure, model=replace(model, parts=parts, meshes=filled)
    )
    triangles = terrain.triangles
    triangles = triangles[_are_near(triangles, paths, distance)]
    return replace(terrain, structure=structure, triangles=triangles)
