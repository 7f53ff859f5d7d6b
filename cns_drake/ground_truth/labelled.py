"""Drives whose world is known, so that their maps can have exact labels."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform

from cns_drake.ray_casting import RayCastingScene
from cns_drake.scenarios import (
    DrivePlan,
    Scenario,
    describe_scenario,
    digest_inputs,
    load_scenario,
    make_city,
)
from cns_drake.simulation import (
    SimulatedDrive,
    SimulationSource,
    load_stage,
    still_scene,
)
from evaluation.base import InputError, validated
from evaluation.drives import (
    Drive,
    DriveSource,
    McapDrive,
    RecordingSource,
    find_data_sets,
    holds_mcap,
)

# Recorded poses are those of the scenario up to this [m, or without a unit].
_SAME_POSE = 1e-6


@dataclass(frozen=True)
class LabelledDrive:
    """A drive whose map is labelled, with the simulation of its world.

    Attributes:
        drive: the source of the scans that make the map: a recording of the
            drive, or the object in `simulated`.
        simulated: simulation of the drive, in whose world rays can be cast.
        scenario: the scenario of the drive.
    """

    drive: Drive
    simulated: SimulatedDrive
    scenario: Scenario

    def still(self) -> RayCastingScene:
        """Returns the drive's world without moving objects, for ray casting.

        The recording vehicle is left out as well.
        """
        if self.scenario.traffic.is_off:
            # The LiDAR does not see its own vehicle.
            return self.simulated.look(0)[0]
        world = load_stage(DrivePlan(self.scenario), with_vehicle=False)
        simulated = self.simulated
        X_WS = simulated.X_WBs[0] @ RigidTransform(simulated.X_BS)
        return still_scene(world, X_WS, simulated.pattern)


def open_labelled(place: str | Path) -> LabelledDrive:
    """Opens a drive whose world is known, for exact labels of its map.

    Args:
        place: a recording of cns-drake; or the name of a shipped drive, or a
            scenario file, to simulate the drive.

    Raises:
        InputError: the drive cannot be used, its points do not name their
            structures, or the files of its world have changed since it was
            recorded.
    """
    path = Path(place)
    if not path.exists() or not find_data_sets(path):
        return simulate_labelled(load_scenario(place))
    folder = path if path.is_dir() else path.parent
    if not holds_mcap(path) or not (folder / "scenario.yaml").is_file():
        raise InputError(
            f"{path}: no recording of cns-drake with a scenario.yaml: the"
            " geometry of a drive by others is not known (cns-drake export"
            " --format map-sessions makes its maps)"
        )
    drive = McapDrive(path)
    _check_instances(drive, path)
    # Where the simulation of the recording has made its city.
    cities = folder.absolute().parent / "cities"
    scenario = make_city(load_scenario(folder / "scenario.yaml"), cities)
    _check_unchanged(drive, path, scenario)
    simulated = SimulatedDrive(scenario)
    planned = simulated.X_WS[: len(drive)]
    if planned.shape != drive.X_WS.shape or not np.allclose(
        planned, drive.X_WS, rtol=0.0, atol=_SAME_POSE
    ):
        raise InputError(
            f"{path}: its poses are not those of its scenario.yaml"
        )
    return LabelledDrive(drive, simulated, scenario)


def simulate_labelled(scenario: Scenario) -> LabelledDrive:
    """Returns a drive that is simulated while its scans are read.

    Raises:
        InputError: the scenario cannot be run.
    """
    simulated = SimulatedDrive(scenario)
    return LabelledDrive(simulated, simulated, scenario)


def labelled_drive(source: DriveSource) -> LabelledDrive:
    """Returns the drive of a source with its world, for exact labels.

    Raises:
        InputError: as in `open_labelled` or `simulate_labelled`.
    """
    if isinstance(source, SimulationSource):
        return simulate_labelled(source.scenario)
    assert isinstance(source, RecordingSource)
    return open_labelled(source.path)


def _check_instances(drive: McapDrive, path: Path) -> None:
    names = drive.scan(0).dtype.names or () if len(drive) else ()
    if drive.instances is None or not {"label", "instance"} <= set(names):
        raise InputError(
            f"{path}: its points have no label and instance; record the drive "
            "anew"
        )


def _check_unchanged(drive: McapDrive, path: Path, scenario: Scenario) -> None:
    """Refuses a recording of another scenario, or of a changed world.

    The files beside an MCAP can belong to another recording, so the MCAP's own
    data decide.
    """
    if drive.scenario is None or not isinstance(drive.inputs, dict):
        raise InputError(
            f"{path}: the recording does not say which world it shows"
        )
    recorded = describe_scenario(validated(Scenario, drive.scenario, path))
    told = describe_scenario(scenario)
    for field in sorted({*recorded, *told}):
        if recorded.get(field) != told.get(field):
            raise InputError(
                f"{path}: {field}: its scenario.yaml is that of another drive"
            )
    if drive.inputs != digest_inputs(scenario):
        raise InputError(
            f"{path}: its world ({scenario.folder.path}) has changed "
            "since it was recorded; record the drive anew"
        )
