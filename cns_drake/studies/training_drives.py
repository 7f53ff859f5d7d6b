"""Drives for training: cities, stages and effects, all drawn at random.

A city keeps the streets of a map; everything else is drawn anew, and so are two
younger stages. Several drives follow one route, with what comes between two
visits: other stages, other effects, another LiDAR, another driver.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
import shutil
from typing import Any

import numpy as np
import yaml

from cns_drake.base.errors import InputError
from cns_drake.base.files import draft_folder
from cns_drake.base.jobs.step import Reporter
from cns_drake.base.map_folder import STAGES_NAME, MapFolder
from cns_drake.city.generation.city_structures import City, make_city
from cns_drake.city.generation.generate import generate_city
from cns_drake.roads.network import load_road_network
from cns_drake.roads.route import draw_route
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scenarios.scenario_files import load_scenario
from cns_drake.scenarios.shipped import shipped_maps
from cns_drake.simulation.simulated_drive import SimulatedDrive
from cns_drake.studies.comparisons import moved
from cns_drake.studies.redrawing import redrawn_inputs
from evaluation.drives.sampling import gather, sample_frames
from evaluation.methods.learned import polar_image

# Far from the seeds of levels, ladders and clean tests.
_FIRST_SEED = 500_000
# Seeds of one training are this far from those of the next.
_MOST_CITIES = 1000
# Length of a route, and between two scans [m].
_LENGTH, _SPACING = 1600.0, 6.0
# As in the protocol of the paper [m].
_MAX_RANGE = 100.0
_STAGES = ("01", "02", "03")
_PRESETS = ("os1-64", "hdl-64e", "os1-32", "vlp-16", "os1-128")


@dataclass(frozen=True)
class DrawnCity:
    """A city with its drives, as a seed draws them."""

    map_name: str
    seed: int
    number: int
    num_drives: int = 4
    change: bool = True
    returns: bool = True
    driver: bool = True

    @property
    def city_seed(self) -> int:
        """The seed of the city itself."""
        return _FIRST_SEED + self.seed * _MOST_CITIES + self.number

    def write(self, folder: Path) -> None:
        """Writes the map folder of the city.

        Raises:
            InputError: it cannot be made or written.
        """
        source = shipped_maps()[self.map_name]
        inputs = redrawn_inputs(source, _STAGES[-1], self.city_seed)
        with draft_folder(folder, replaces=True) as draft:
            for name, content in inputs.items():
                (draft / name).write_bytes(content)
            stages = draw_stages(make_city(draft), self._rng(0))
            text = yaml.safe_dump({"stages": stages}, sort_keys=False)
            (draft / STAGES_NAME).write_text(text, encoding="utf-8")
            generate_city(draft)

    def drives(self, folder: Path) -> list[Scenario]:
        """Returns the drives through the city."""
        rng = self._rng(1)
        source = MapFolder(shipped_maps()[self.map_name])
        base = load_scenario(source.recordable_drives()[0])
        network = load_road_network(MapFolder(folder).roads)
        base = base.replaced(
            map=str(folder),
            stage=_STAGES[-1],
            route=draw_route(network, _LENGTH, rng),
            waypoints=None,
            aside=0.0,
        )
        return [self._drive(base, number) for number in range(self.num_drives)]

    def _drive(self, base: Scenario, number: int) -> Scenario:
        # Without one kind of change all others stay the same draws.
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
        return moved(drive, 0.0, aside, 0.0).with_fields(fields, drive.name)

    def _rng(self, purpose: int) -> np.random.Generator:
        return np.random.default_rng([self.seed, self.number, purpose])


def scan_city(
    reporter: Reporter, drawn: DrawnCity, folder: Path
) -> dict[str, np.ndarray]:
    """Simulates the drives of a city; nothing is recorded.

    Returns:
        `images` (N, RINGS, SECTORS, CHANNELS) uint8, `xy` (N, 2) places of the
        sensors [m], and `drives` (N,) number of the drive.
    """
    images, xy, numbers = [], [], []
    try:
        drawn.write(folder)
        for number, scenario in enumerate(drawn.drives(folder)):
            try:
                drive = SimulatedDrive(scenario)
            except InputError as error:
                # A draw may be impossible, such as a U-turn in a narrow road.
                reporter.note(f"{scenario.name} left out: {error}")
                continue
            frames = sample_frames(drive.X_WS[:, :3, 3], _SPACING)
            height = next(iter(scenario.lidars.values())).xyz[2]
            for frame in reporter.track(frames, scenario.name, len(frames)):
                points = gather(drive, int(frame), 1, _MAX_RANGE)
                images.append(polar_image(points, height))
                xy.append(drive.X_WS[frame, :2, 3])
                numbers.append(number)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return {
        "images": np.stack(images),
        "xy": np.stack(xy),
        "drives": np.array(numbers),
    }


def draw_stages(city: City, rng: np.random.Generator) -> dict[str, dict]:
    """Returns stages of a city: some buildings absent, lower, trees young.

    Returns:
        The content of `stages.yaml`, in which the last one is the whole city.
    """
    buildings = [s for s in city.structures if s.semantic_class == "building"]
    trees = [s for s in city.structures if s.name.startswith("tree_")]
    others = [
        s
        for s in city.structures
        if s.semantic_class == "vegetation" and not s.name.startswith("tree_")
    ]
    stages: dict[str, dict] = {}
    gone: set[str] = set()
    for stage in reversed(_STAGES[:-1]):
        absent = [
            *_nearest(buildings, float(rng.uniform(0.05, 0.3)), rng),
            *_some(trees, float(rng.uniform(0.0, 0.4)), rng),
            *_some(others, float(rng.uniform(0.0, 0.3)), rng),
        ]
        absent = [name for name in absent if name not in gone]
        gone.update(absent)
        lower = {
            "houses": {
                "height": float(rng.uniform(4.0, 9.0)),
                "structures": _some(buildings, rng.uniform(0.2, 0.9), rng),
            },
            "trees": {
                "height": float(rng.uniform(3.0, 6.0)),
                "structures": _some(trees, rng.uniform(0.2, 1.0), rng),
            },
        }
        stages[stage] = {
            "story": "Younger, at random.",
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
    """Returns about half at random and half of those nearest to a place."""
    xy = np.array([s.xyz[:2] for s in structures])
    center = xy[int(rng.integers(len(xy)))]
    order = np.argsort(np.linalg.norm(xy - center, axis=1), kind="stable")
    near = [structures[k].name for k in order[: int(0.5 * share * len(order))]]
    return sorted({*near, *_some(structures, 0.5 * share, rng)})


def _draw_changes(rng: np.random.Generator, number: int) -> dict[str, Any]:
    """Returns fields of a drive: its stage, and what comes and goes."""
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
        # The whole city, its first stage, and between them.
        "stage": (_STAGES[-1], _STAGES[0], _STAGES[1], _STAGES[-1])[number % 4],
        "transient": {"seed": int(rng.integers(2**31)), **parts},
    }
    if rng.random() < 0.5:
        changes["ride"] = {"roughness": rough, "seed": int(rng.integers(2**31))}
    return changes
