"""Drives for training: cities, stages and effects, all sampled at random.

A city has the streets of a map, or streets sampled at random. All other
structures, and two earlier stages, are sampled anew. Several drives follow the
same route and differ as real visits do: in stage, effects, LiDAR and driver.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
import shutil
from typing import Any

import numpy as np
from scipy.spatial import cKDTree
import yaml

from cns_drake.base import poses
from cns_drake.base.errors import InputError
from cns_drake.base.files import draft_folder
from cns_drake.base.jobs.step import Reporter
from cns_drake.base.progress import track
from cns_drake.city.generation.city_structures import City, make_city
from cns_drake.city.generation.generate import generate_city
from cns_drake.city.generation.starter import start_city
from cns_drake.roads.network import load_road_network
from cns_drake.roads.route import draw_route
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import load_scenario
from cns_drake.scenarios.shipped import shipped_maps
from cns_drake.scene.map_folder import STAGES_NAME, MapFolder
from cns_drake.simulation.simulated_drive import SimulatedDrive
from cns_drake.studies.exact_overlap import VisibleSurfaces, sights_of
from cns_drake.studies.redrawing import (
    marked_yaml,
    redrawn_inputs,
    turned_content,
)
from cns_drake.studies.viewpoints import with_lidars_moved
from evaluation.drives.sampling import gather, sample_frames
from evaluation.methods.polar_images import polar_image

# First seed, far from the seeds of all experiments and tests.
_FIRST_SEED = 500_000
# Distance between the seeds of successive trainings.
_MOST_CITIES = 1000
# Length of a route [m].
_ROUTE_LENGTH = 1600.0
# Distance between two scans [m].
_SCAN_SPACING = 6.0
# As in the protocol of the paper [m].
_MAX_RANGE = 100.0
_STAGES = ("01", "02", "03")
_PRESETS = ("os1-64", "hdl-64e", "os1-32", "vlp-16", "os1-128")
# Classes of what comes and goes with a building, as in the shipped cities.
_BESIDE = frozenset(
    {
        "bicycle",
        "car",
        "fence",
        "other-object",
        "pole",
        "traffic-sign",
        "truck",
        "vegetation",
    }
)
# It goes with the nearest building if its center is within this distance [m].
_BESIDE_WITHIN = 20.0
# Takes the place of a map's name in cities whose streets are drawn.
DRAWN_STREETS = "drawn"
# Purpose of the random numbers of streets; cities and drives have the least.
_STREETS = 2**32 - 1
# The map whose first drive has the car and the LiDAR of all drives there.
_CAR_OF = "riverside"
# Scans farther apart count as having no overlap [m]. The overlap is estimated
# from this number of points of a scan.
_FARTHEST_OVERLAP = 50.0
_OVERLAP_POINTS = 1000


@dataclass(frozen=True)
class SampledCity:
    """A city with its drives, all sampled from a seed.

    Attributes:
        map_name: the shipped map whose streets the city has, or `DRAWN_STREETS`
            for streets sampled at random.
        seed: seed of the training.
        number: number of the city in the training.
        num_drives: number of drives along one route.
        change: whether drives see different stages and temporary changes.
        returns: whether some drives have weather, and LiDAR returns with the
            losses and errors of a data sheet.
        driver: whether drivers wander and change lanes.
        graded: whether the overlap of each scan with the places of the other
            scans is computed.
    """

    map_name: str
    seed: int
    number: int
    num_drives: int = 4
    change: bool = True
    returns: bool = True
    driver: bool = True
    graded: bool = False

    @property
    def city_seed(self) -> int:
        """Seed from which the city is generated; drives do not depend on it."""
        return _FIRST_SEED + self.seed * _MOST_CITIES + self.number

    def write(self, folder: Path) -> None:
        """Writes the map folder of the city.

        Raises:
            InputError: the city cannot be generated, or the folder cannot be
                written.
        """
        with draft_folder(folder, replaces=True) as draft:
            if self.map_name == DRAWN_STREETS:
                roads = marked_yaml(
                    "streets", draw_streets(self._rng(_STREETS))
                )
                MapFolder(draft).roads.write_bytes(roads)
                start_city(draft, self.city_seed)
            else:
                source = shipped_maps()[self.map_name]
                inputs = redrawn_inputs(source, _STAGES[-1], self.city_seed)
                for name, content in inputs.items():
                    (draft / name).write_bytes(content)
            stages = draw_stages(make_city(draft), self._rng(0))
            text = yaml.safe_dump({"stages": stages}, sort_keys=False)
            (draft / STAGES_NAME).write_text(text, encoding="utf-8")
            generate_city(draft)

    def drives(self, folder: Path) -> list[Scenario]:
        """Returns the drives through the city.

        Args:
            folder: folder to which `write` has written the map.
        """
        rng = self._rng(1)
        drawn = self.map_name == DRAWN_STREETS
        source = MapFolder(shipped_maps()[_CAR_OF if drawn else self.map_name])
        base = load_scenario(source.recordable_drives()[0])
        network = load_road_network(MapFolder(folder).roads)
        base = base.replaced(
            map=str(folder),
            stage=_STAGES[-1],
            route=draw_route(network, _ROUTE_LENGTH, rng),
            waypoints=None,
            aside=0.0,
        )
        return [self._drive(base, number) for number in range(self.num_drives)]

    def _drive(self, base: Scenario, number: int) -> Scenario:
        # If one kind of change is left out, the draws of all others stay the
        # same.
        rng = self._rng(2 + number)
        drive = base.replaced(name=f"{self.map_name}_{self.number}_{number}")
        aside = float(rng.uniform(-1.0, 1.0))
        if rng.random() < 0.35:
            aside = float(rng.uniform(-2.0, 6.0))
        preset = _PRESETS[int(rng.integers(len(_PRESETS)))]
        changes = _draw_changes(rng, number)
        returns = rng.random() < 0.6
        fog = float(rng.uniform(80.0, 400.0)) if rng.random() < 0.2 else None
        seed = int(rng.integers(2**31))
        if rng.random() < 0.35:
            drive = drive.with_lidar_preset(preset)
        fields: dict[str, Any] = {"seed": seed}
        if self.driver:
            fields["driver"] = {
                "wander": 0.35,
                "lane_changes": 6.0,
                "seed": seed,
            }
        else:
            aside = 0.0
        if self.change:
            fields |= changes
        if self.returns and returns:
            drive = drive.with_returns("calibrated")
            fields["weather"] = {"visibility": fog}
        return with_lidars_moved(drive, 0.0, aside, 0.0).with_fields(
            fields, drive.name
        )

    def _rng(self, purpose: int) -> np.random.Generator:
        return np.random.default_rng([self.seed, self.number, purpose])


def scan_city(
    reporter: Reporter, drawn: SampledCity, folder: Path
) -> dict[str, np.ndarray]:
    """Simulates the drives through a city, without recording them.

    Args:
        reporter: reports progress.
        drawn: the random city.
        folder: folder to which the map of the city is written; the folder is
            removed at the end.

    Returns:
        `images` (N, RINGS, SECTORS, CHANNELS) uint8 polar images of the scans,
        `xy` (N, 2) positions of the sensors [m] and `drives` (N,) number of
        each scan's drive. If the field `graded` of the city is true, also
        `overlaps` (N, N) float16, the share of each scan that is visible from
        the place of each other scan.
    """
    images, xy, numbers = [], [], []
    taken: list[_Taken] = []
    try:
        drawn.write(folder)
        for number, scenario in enumerate(drawn.drives(folder)):
            try:
                drive = SimulatedDrive(scenario)
            except InputError as error:
                # A draw may be impossible, such as a U-turn in a narrow road.
                reporter.note(f"{scenario.name} left out: {error}")
                continue
            frames = sample_frames(drive.X_WS[:, :3, 3], _SCAN_SPACING)
            height = next(iter(scenario.lidars.values())).xyz[2]
            for frame in track(
                frames, f"simulating {scenario.name}", len(frames), "scans"
            ):
                points = gather(drive, int(frame), 1, _MAX_RANGE)
                images.append(polar_image(points, height))
                xy.append(drive.X_WS[frame, :2, 3])
                numbers.append(number)
                taken.append(_Taken(drive, int(frame), _few(points)))
        found = {"overlaps": _overlaps(taken, reporter)} if drawn.graded else {}
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return {
        "images": np.stack(images),
        "xy": np.stack(xy),
        "drives": np.array(numbers),
        **found,
    }


@dataclass(frozen=True)
class _Taken:
    """A scan of a drive, with some of its points in the LiDAR's frame."""

    drive: SimulatedDrive
    frame: int
    points: np.ndarray


def _few(points: np.ndarray) -> np.ndarray:
    return points[:: max(1, len(points) // _OVERLAP_POINTS)].astype(float)


def _overlaps(scans: Sequence[_Taken], reporter: Reporter) -> np.ndarray:
    """Returns which share of each scan is visible from every other scan.

    The share is exact (see `exact_overlap`). It is 0 for two scans of one drive
    and for scans over 50 m apart.

    Returns:
        (N, N) float16: a row for each scan, a column for each place.
    """
    result = np.zeros((len(scans), len(scans)), np.float16)
    X_WSs = np.stack([one.drive.X_WS[one.frame] for one in scans])
    places = track(enumerate(scans), "comparing scans", len(scans), "scans")
    for column, place in places:
        seen = VisibleSurfaces(sights_of(place.drive)(place.frame), _MAX_RANGE)
        X_PW = poses.inverse(X_WSs[column])
        apart = np.linalg.norm(X_WSs[:, :2, 3] - X_WSs[column, :2, 3], axis=1)
        for row in np.flatnonzero(apart <= _FARTHEST_OVERLAP).tolist():
            if scans[row].drive is not place.drive:
                X_PS = X_PW @ X_WSs[row]
                p_P = scans[row].points @ X_PS[:3, :3].T + X_PS[:3, 3]
                result[row, column] = seen.share_of(p_P)
    return result


def draw_streets(rng: np.random.Generator) -> dict[str, Any]:
    """Returns the content of a `roads.yaml` with random streets.

    Streets run along the lines of a bent grid with random spacings; the whole
    grid has a random orientation. Some cross streets are missing, and some are
    bent.
    """
    columns, rows = rng.integers(3, 6), rng.integers(3, 5)
    x = np.cumsum(rng.uniform(70.0, 170.0, columns))
    y = np.cumsum(rng.uniform(60.0, 140.0, rows))
    places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
    places += rng.uniform(-14.0, 14.0, places.shape)
    kerb = [round(float(k), 1) for k in rng.uniform(5.0, 9.0, (columns * rows))]
    junctions = {
        f"j{i}{k}": {
            "position": places[i, k].round(2).tolist(),
            "kerb_radius": kerb.pop(),
        }
        for i in range(columns)
        for k in range(rows)
    }
    roads: dict[str, Any] = {}
    wide = {("x", int(rng.integers(rows))), ("y", int(rng.integers(columns)))}

    def add(axis: str, line: int, i: int, k: int, to: tuple[int, int]) -> None:
        start, end = places[i, k], places[to]
        road: dict[str, Any] = {"start": f"j{i}{k}", "end": f"j{to[0]}{to[1]}"}
        if (axis, line) in wide:
            road["lanes"] = [2, 2]
        elif rng.random() < 0.5:
            road["parking"] = 2.2
        if rng.random() < 0.3:
            along = end - start
            aside = np.array([-along[1], along[0]]) / np.linalg.norm(along)
            bend = (start + end) / 2.0 + aside * rng.uniform(-16.0, 16.0)
            road["via"] = [[*bend.round(2).tolist(), 30.0]]
        roads[f"{axis}{line}_{i}{k}"] = road

    for k in range(rows):
        for i in range(columns - 1):
            add("x", k, i, k, (i + 1, k))
    for i in range(columns):
        is_inside = 0 < i < columns - 1
        for k in range(rows - 1):
            # Every junction still has two streets.
            if not (is_inside and rng.random() < 0.3):
                add("y", i, i, k, (i, k + 1))
    defaults = {
        "lanes": [1, 1],
        "lane_width": round(float(rng.uniform(3.2, 4.2)), 1),
        "sidewalk": round(float(rng.uniform(2.0, 5.0)), 1),
        "kerb_height": 0.15,
        "speed_limit": 12.0,
    }
    plan = {"defaults": defaults, "junctions": junctions, "roads": roads}
    return turned_content(plan, float(rng.uniform(0.0, 90.0)))


def draw_stages(city: City, rng: np.random.Generator) -> dict[str, dict]:
    """Returns random stages of a city, as the content of `stages.yaml`.

    The last stage is the whole city. In earlier stages, whole buildings are
    missing, and with each building the objects that stand, grow or park nearest
    to it. Some trees are missing as well, and a few buildings and trees are
    lower than in the last stage.

    Args:
        city: the city.
        rng: random generator.
    """
    buildings = [s for s in city.structures if s.semantic_class == "building"]
    trees = [s for s in city.structures if s.kind == "tree"]
    beside = [s for s in city.structures if s.semantic_class in _BESIDE]
    near = cKDTree([s.xyz[:2] for s in buildings]).query(
        [s.xyz[:2] for s in beside], distance_upper_bound=_BESIDE_WITHIN
    )[1]
    stages: dict[str, dict] = {}
    gone: set[str] = set()
    for stage in reversed(_STAGES[:-1]):
        cleared = set(_nearest(buildings, float(rng.uniform(0.1, 0.5)), rng))
        absent = [
            *(s.name for s in buildings if s.name in cleared),
            *(
                s.name
                for s, k in zip(beside, near, strict=True)
                if k < len(buildings) and buildings[k].name in cleared
            ),
            *_some(trees, float(rng.uniform(0.0, 0.4)), rng),
        ]
        absent = [name for name in dict.fromkeys(absent) if name not in gone]
        gone.update(absent)
        lower = {
            "houses": {
                "height": float(rng.uniform(4.0, 9.0)),
                "structures": _some(buildings, rng.uniform(0.0, 0.1), rng),
            },
            "trees": {
                "height": float(rng.uniform(3.0, 6.0)),
                "structures": _some(trees, rng.uniform(0.0, 0.2), rng),
            },
        }
        stages[stage] = {
            "story": "Lots that are built on later, at random.",
            "absent": {"": absent} if absent else {},
            "lower": {k: v for k, v in lower.items() if v["structures"]},
        }
    return {
        **{stage: stages[stage] for stage in _STAGES[:-1]},
        _STAGES[-1]: {"story": "The whole city."},
    }


def _some(
    structures: Sequence[Any], share: float, rng: np.random.Generator
) -> list[str]:
    chosen = rng.random(len(structures)) < share
    return [s.name for s, one in zip(structures, chosen, strict=True) if one]


def _nearest(
    structures: Sequence[Any], share: float, rng: np.random.Generator
) -> list[str]:
    """Returns a share of structures: half at random, half near a place."""
    xy = np.array([s.xyz[:2] for s in structures])
    center = xy[int(rng.integers(len(xy)))]
    order = np.argsort(np.linalg.norm(xy - center, axis=1), kind="stable")
    near = [structures[k].name for k in order[: int(0.5 * share * len(order))]]
    return sorted({*near, *_some(structures, 0.5 * share, rng)})


def _draw_changes(rng: np.random.Generator, number: int) -> dict[str, Any]:
    """Returns random changes of a drive: stage, temporary changes, ride."""
    ends = {
        "parked_cars": (0.0, 1.0),
        "leaves": (0.1, 1.0),
        "snow": (0.02, 0.2),
        "scaffolds": (0.0, 0.3),
        "works": (0.0, 0.15),
        "furniture": (0.0, 0.7),
    }
    parts = {
        name: round(float(rng.uniform(low, high)), 4)
        for name, (low, high) in ends.items()
        if rng.random() < (0.15 if name == "snow" else 0.4)
    }
    rough = "ABC"[int(rng.integers(3))]
    changes: dict[str, Any] = {
        # The last stage, the first, the one in between, and the last again.
        "stage": (_STAGES[-1], _STAGES[0], _STAGES[1], _STAGES[-1])[number % 4],
        "transient": {"seed": int(rng.integers(2**31)), **parts},
    }
    if rng.random() < 0.5:
        changes["ride"] = {"roughness": rough, "seed": int(rng.integers(2**31))}
    return changes
