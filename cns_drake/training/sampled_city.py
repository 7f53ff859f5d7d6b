"""Cities with drives for training, all sampled at random.

A city has the streets of a map, or streets sampled at random. All other
structures, and two earlier stages, are sampled anew. Several drives follow the
same route and differ as real visits do: in stage, effects, LiDAR and driver.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree
import yaml

from cns_drake.scenarios import (
    Scenario,
    load_scenario,
    marked_yaml,
    redrawn_inputs,
)
from cns_drake.studies import turned_content
from evaluation.base import draft_folder
from evaluation.lidar_sheets import make_sheet
from worlds.city import City, generate_city, make_city, start_city
from worlds.maps import STAGES_NAME, MapFolder, shipped_maps
from worlds.roads import draw_route, load_road_network

# First seed, far from the seeds of all experiments and tests.
_FIRST_SEED = 500_000
# Distance between the seeds of successive trainings.
_MOST_CITIES = 1000
# Length of a route [m].
_ROUTE_LENGTH = 1600.0
# LiDARs of some drives; the others have the map's LiDAR.
_PRESETS = ("os1-64", "hdl-64e", "os1-32", "vlp-16", "os1-128")
_SHARE_OF_PRESETS = 0.35
# Takes the place of a map's name in cities whose streets are drawn.
DRAWN_STREETS = "drawn"
# Purpose of the random numbers of streets; cities and drives have the least.
_STREETS = 2**32 - 1
# The map whose first drive has the car and the LiDAR of all drives there.
_CAR_OF = "riverside"


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
        lidars: LiDARs of the drives, from which each drive gets one at random:
            names of presets, or fields of data sheets, for JSON. By default,
            some drives have one of five presets, and the others the LiDAR of
            the map.
    """

    map_name: str
    seed: int
    number: int
    num_drives: int = 4
    change: bool = True
    returns: bool = True
    driver: bool = True
    graded: bool = False
    lidars: tuple[str | Mapping[str, Any], ...] = ()

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
            stages = _draw_stages(make_city(draft), self._rng(0))
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
        lidars = self.lidars or _PRESETS
        lidar = lidars[int(rng.integers(len(lidars)))]
        changes = _draw_changes(rng, number)
        returns = rng.random() < 0.6
        fog = float(rng.uniform(80.0, 400.0)) if rng.random() < 0.2 else None
        seed = int(rng.integers(2**31))
        if rng.random() < _SHARE_OF_PRESETS or self.lidars:
            drive = drive.with_lidar(
                lidar if isinstance(lidar, str) else make_sheet(lidar, "lidars")
            )
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
        fields["offset"] = {"left": aside}
        return drive.with_fields(fields, drive.name)

    def _rng(self, purpose: int) -> np.random.Generator:
        return np.random.default_rng([self.seed, self.number, purpose])


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


# Names of all stages, from older to newer.
_STAGES = ("01", "02", "03")
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
# It goes with the nearest building up to this distance [m].
_BESIDE_WITHIN = 20.0


def _draw_stages(city: City, rng: np.random.Generator) -> dict[str, dict]:
    """Returns random stages of a city, as the content of `stages.yaml`.

    The last stage is the whole city. In earlier stages, whole buildings are
    missing. Objects that stand, grow or park beside a missing building are
    missing, too, unless another building is nearer. Some other trees are also
    missing, and a few buildings and trees are lower than in the last stage.
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
        cleared = set(
            _clustered_names(buildings, float(rng.uniform(0.1, 0.5)), rng)
        )
        absent = [
            *(s.name for s in buildings if s.name in cleared),
            *(
                s.name
                for s, k in zip(beside, near, strict=True)
                if k < len(buildings) and buildings[k].name in cleared
            ),
            *_random_names(trees, float(rng.uniform(0.0, 0.4)), rng),
        ]
        absent = [name for name in dict.fromkeys(absent) if name not in gone]
        gone.update(absent)
        lower = {
            "houses": {
                "height": float(rng.uniform(4.0, 9.0)),
                "structures": _random_names(
                    buildings, rng.uniform(0.0, 0.1), rng
                ),
            },
            "trees": {
                "height": float(rng.uniform(3.0, 6.0)),
                "structures": _random_names(trees, rng.uniform(0.0, 0.2), rng),
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


def _random_names(
    structures: Sequence[Any], share: float, rng: np.random.Generator
) -> list[str]:
    chosen = rng.random(len(structures)) < share
    return [s.name for s, one in zip(structures, chosen, strict=True) if one]


def _clustered_names(
    structures: Sequence[Any], share: float, rng: np.random.Generator
) -> list[str]:
    """Returns a share of structures: half at random, half near a place."""
    xy = np.array([s.xyz[:2] for s in structures])
    center = xy[int(rng.integers(len(xy)))]
    order = np.argsort(np.linalg.norm(xy - center, axis=1), kind="stable")
    near = [structures[k].name for k in order[: int(0.5 * share * len(order))]]
    return sorted({*near, *_random_names(structures, 0.5 * share, rng)})


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
