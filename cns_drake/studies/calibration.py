"""How much two stages differ, and what would bring that to a target.

A benchmark wants two stages to differ by a given TCR_sym. How much they do
depends on what both drives see, so that it has to be measured, and with
recordings every attempt takes minutes. Here both drives are scanned every few
metres only, with any structures left out. What comes of it is a proposal:
who tells the story of the stages writes it into `stages.yaml`.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform

from cns_drake.city.plan.stages import Stages, load_stages
from cns_drake.ray_casting.ray_casting_scene import RayCastingScene
from cns_drake.recording.frame_clock import FRAME_PERIOD, frames_within
from cns_drake.scenarios.planning import plan_drive
from cns_drake.scenarios.scenario import Scenario
from cns_drake.scene.perception_geometry import read_perception_geometry
from cns_drake.scene.structure_table import (
    StructureTable,
    load_structure_table,
)
from cns_drake.scene.world import load_world
from evaluation.change.tcr import temporal_change
from evaluation.maps.voxel_maps import VoxelAccumulator
from evaluation.sequences.sampling import sample_frames
from evaluation.support.errors import InputError

# Distance between two scans [m]; a recording has one every 0.5 m or so. For
# the three pairs of Metropolis the estimates are then within 0.001 of what
# recordings give, and those of controls within 0.002 above it. At 4 m the
# estimates are up to 0.003 higher.
SCAN_SPACING = 2.0
# Stands for a stage where `candidates` are meant.
CANDIDATES = "candidates"

_XYZ = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4")])

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Group:
    """Structures that the story takes away together.

    Attributes:
        stage: in whose list they are, or `CANDIDATES`.
        item: what the list calls them.
        names: of the structures.
    """

    stage: str
    item: str
    names: tuple[str, ...]


@dataclass(frozen=True)
class Proposal:
    """What to change in the earlier stage.

    Attributes:
        gives_back: whether the structures are to stand there again;
            otherwise they are to be missing there as well.
        groups: in the order in which they move; only the last of them may
            be a part of a group, its first structures.
        change: TCR_sym then, as estimated.
    """

    gives_back: bool
    groups: tuple[Group, ...]
    change: float


class Calibration:
    """Estimates TCR_sym between drives through two stages of a city.

    Attributes:
        given_back: the groups that only the later stage has, the next one to
            stand in the earlier stage first.
        taken: the groups that the earlier stage may lack besides, the next
            one to take away first.
        change: TCR_sym as the stages are.
        control: TCR_sym of the two routes in the later stage.
    """

    def __init__(
        self,
        earlier: Scenario,
        later: Scenario,
        *,
        spacing: float = SCAN_SPACING,
        progress: Progress = lambda line: None,
    ):
        """Scans both drives, each in its stage.

        Args:
            earlier: a sequence; its stage is the one to be calibrated.
            later: a sequence of the same city at a later stage.
            spacing: distance between two scans [m].
            progress: takes one line for each estimate.

        Raises:
            InputError: a file cannot be used, or the two are not an earlier
                and a later stage of one city.
        """
        folder = earlier.map_folder
        source = folder / "stages.yaml"
        if later.map_folder != folder:
            raise InputError(f"{later.name}: map: not that of {earlier.name}")
        structures = [entry.name for entry in _table(folder)]
        stages = load_stages(source, structures)
        names = list(stages.stages)
        first, second = (
            _stage_of(scenario, names, source) for scenario in (earlier, later)
        )
        if names.index(first) >= names.index(second):
            raise InputError(
                f"{earlier.name}: stage: not before that of {later.name}"
            )
        self._progress = progress
        self._city = _WholeCity(folder / f"stage_{names[-1]}.sdf")
        self._scanner = _Scanner(earlier, spacing)
        self._absent = stages.absent(first)
        self.given_back, self.taken = _groups(stages, first, second)
        progress(f"{earlier.name} and {later.name}: scanning")
        absent = stages.absent(second)
        self._later_map = _Scanner(later, spacing).map(self._city.scene(absent))
        self.control = self._estimate(absent, "control")
        self.change = self._estimate(self._absent, "as it is")

    def contributions(self) -> dict[Group, float]:
        """Returns what each group of `given_back` contributes to TCR_sym.

        That is by how much TCR_sym falls if this group alone is given back.
        Contributions do not add up to the whole: what one group hid may be
        missing as well.
        """
        return {
            group: self.change
            - self._estimate(
                self._absent - set(group.names), f"with {group.item}"
            )
            for group in self.given_back
        }

    def propose(self, target: float) -> Proposal:
        """Returns what brings TCR_sym as close to a target as it gets.

        Groups move in their order, and the last of them in part if need be.
        How many structures move is found by bisection: each one moves
        TCR_sym the same way, but for what comes to light behind it.
        """
        gives_back = self.change > target
        groups = self.given_back if gives_back else self.taken
        names = [name for group in groups for name in group.names]
        known = {0: self.change}

        def change(count: int) -> float:
            if count not in known:
                moved = set(names[:count])
                known[count] = self._estimate(
                    self._absent - moved
                    if gives_back
                    else self._absent | moved,
                    f"{count} structures {'back' if gives_back else 'less'}",
                )
            return known[count]

        low, high = 0, len(names)
        while high - low > 1:
            middle = (low + high) // 2
            if (change(middle) > target) == gives_back:
                low = middle
            else:
                high = middle
        change(high)
        best = min(known, key=lambda n: (abs(known[n] - target), n))
        return Proposal(gives_back, _first(groups, best), known[best])

    def _estimate(self, absent: Collection[str], what: str) -> float:
        earlier_map = self._scanner.map(self._city.scene(absent))
        change = temporal_change(earlier_map, self._later_map).symmetric
        self._progress(f"TCR_sym {change:.4f} {what}")
        return change


class _WholeCity:
    """The last stage of a city, from which structures can be left out."""

    def __init__(self, sdf: Path):
        world = load_world(sdf)
        self._frames = world.anchored_frames()
        self._geometries = read_perception_geometry(
            world.scene_graph.model_inspector()
        )

    def scene(self, absent: Collection[str]) -> RayCastingScene:
        """Returns the city without some structures, to cast rays on."""
        left = [g for g in self._geometries if g.structure not in absent]
        return RayCastingScene(left, self._frames, lambda _: RigidTransform())


class _Scanner:
    """The scans of a drive, a few metres apart."""

    def __init__(self, scenario: Scenario, spacing: float):
        drive = plan_drive(scenario)
        times = FRAME_PERIOD * np.arange(frames_within(drive.duration))
        frames = sample_frames(drive.positions(times), spacing)
        lidar = next(iter(scenario.lidars.values()))
        self._beams = lidar.pattern()
        self._X_WSs = [
            drive.pose(time) @ lidar.pose() for time in times[frames]
        ]

    def map(self, scene: RayCastingScene) -> np.ndarray:
        """Returns the (V, 3) voxel centroids of all scans of a scene [m]."""
        accumulator = VoxelAccumulator()
        d_Sset = self._beams.d_Sset[self._beams.packet_order]
        for X_WS in self._X_WSs:
            ranges = scene.cast_rays(
                X_WS.translation(),
                d_Sset,
                self._beams.max_range,
                R_WSset=X_WS.rotation().matrix(),
            ).ranges
            seen = (ranges >= self._beams.min_range) & np.isfinite(ranges)
            points = np.empty(np.count_nonzero(seen), _XYZ)
            p_SRset = d_Sset[seen] * ranges[seen, None]
            points["x"], points["y"], points["z"] = p_SRset.T
            accumulator.add(points, X_WS.GetAsMatrix4())
        return accumulator.to_map().centroids_W


def _table(folder: Path) -> StructureTable:
    path = folder / "structures.csv"
    if not path.is_file():
        raise InputError(f"{path}: no such file; generate the city first")
    return load_structure_table(path)


def _stage_of(scenario: Scenario, names: Sequence[str], source: Path) -> str:
    """Returns the stage of a scenario.

    Raises:
        InputError: it is none of those named in the file `source`.
    """
    if scenario.stage is None or scenario.stage not in names:
        raise InputError(
            f"{source}: stages: no stage '{scenario.stage}', which is "
            f"that of {scenario.name}"
        )
    return scenario.stage


def _groups(
    stages: Stages, earlier: str, later: str
) -> tuple[list[Group], list[Group]]:
    """Returns what an earlier stage can get back, and what it can lose.

    Lists are in the order in which the city is built, the first group last.
    So the earlier stage gets back groups from the end of its own list, and
    loses those at the top of the list of the stage before it.
    """
    names = list(stages.stages)
    first, end = names.index(earlier), names.index(later)
    groups = {
        stage: [
            Group(stage, item, tuple(structures))
            for item, structures in stages.stages[stage].absent.items()
        ]
        for stage in names
    }
    given_back = [
        group for stage in names[first:end] for group in groups[stage][::-1]
    ]
    taken = [group for stage in names[:first][::-1] for group in groups[stage]]
    if stages.candidates:
        taken.append(Group(CANDIDATES, "", tuple(stages.candidates)))
    return given_back, taken


def _first(groups: Sequence[Group], count: int) -> tuple[Group, ...]:
    """Returns the groups that have the first structures of all."""
    result = []
    for group in groups:
        if count > 0:
            result.append(replace(group, names=group.names[:count]))
        count -= len(group.names)
    return tuple(result)
