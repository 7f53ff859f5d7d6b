"""The structural change between two drives, with its context.

TCR_sym is reported with three more values. The control is the TCR_sym that the
different routes cause without any change. The coverage-masked value counts only
the parts of the city that both routes saw. The registered value is what is left
after the maps are registered to each other: a yaw of 1.5 deg between the frames
of two drives gives a TCR_sym of about 0.2 in a city that has not changed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from evaluation.base import InputError
from evaluation.change.tcr import (
    COVERAGE_RADIUS,
    GRIDS,
    HULL_MARGIN,
    TAU,
    TemporalChange,
    covered,
    temporal_change,
)
from evaluation.clouds import read_blocks
from evaluation.drives import Drive, check_same_world
from evaluation.maps import (
    CELL_SIZE,
    VOXEL_SIZE,
    VoxelAccumulator,
    VoxelMap,
    map_drive,
)

if TYPE_CHECKING:
    from evaluation.alignment import AlignmentReport


# Greatest mean distance of two drives on one route [m]; lanes are 3.5 m wide.
_SAME_ROUTE = 1.0
# A registration with a smaller share of fitting upright surfaces is none: where
# the frames differ by more than some degrees, a wrong pose has below .05.
_LEAST_STRUCTURE = 0.3
# If registration lowers TCR_sym by more than this, the frames differ.
_EXPLAINED = 0.02


@dataclass(frozen=True)
class DriveMap:
    """A map, with the drive that made it.

    Attributes:
        name: name of the drive or file.
        voxels: the map in voxels of 1 m, from which the larger voxels of the
            TCR are made.
        positions: (N, 3) positions of the sensor [m]; None for a map file.
        drive: the drive, if it is open; None for a map file.
        notes: notes on how the file was read.
    """

    name: str
    voxels: VoxelMap
    positions: np.ndarray | None = None
    drive: Drive | None = None
    notes: tuple[str, ...] = ()


def map_source(source: Drive | Path, columns: int | None = None) -> DriveMap:
    """Returns the voxel map of a drive or of a cloud's file.

    Args:
        source: the drive, or the path of the file.
        columns: number of columns of a `.bin` file, see `read_cloud`.

    Raises:
        InputError: a scan or the file cannot be read.
    """
    if isinstance(source, Drive):
        voxels = map_drive(source, CELL_SIZE)
        positions = source.X_WS[:, :3, 3]
        return DriveMap(source.name, voxels, positions, source)
    accumulator = VoxelAccumulator(CELL_SIZE)
    notes: list[str] = []
    for points in read_blocks(source, columns, notes.append):
        accumulator.add(points)
    return DriveMap(source.name, accumulator.to_map(), notes=tuple(notes))


@dataclass(frozen=True)
class RegisteredChange:
    """The change between two maps A and B after B is registered to A.

    Attributes:
        symmetric: TCR_sym of A and of B at this pose.
        X_AB: (4, 4) pose of B's frame in A's frame; the identity if no other
            pose nearby fits better.
    """

    symmetric: float
    X_AB: np.ndarray

    @property
    def yaw_deg(self) -> float:
        """Yaw of B's frame in A's frame [deg]."""
        return float(np.degrees(np.arctan2(self.X_AB[1, 0], self.X_AB[0, 0])))

    @property
    def offset(self) -> tuple[float, float, float]:
        """Position of the origin of B's frame in A's frame [m]."""
        x, y, z = self.X_AB[:3, 3].tolist()
        return x, y, z


class Spread(NamedTuple):
    """The least and the greatest TCR_sym over positions of the voxel grid."""

    least: float
    greatest: float


@dataclass(frozen=True)
class ChangeReport:
    """The change between two maps A and B.

    Attributes:
        source: name of A.
        target: name of B.
        change: change over the whole maps.
        spread: least and greatest TCR_sym over several positions of the grid of
            voxels; None if it was not measured.
        masked: change over the parts that both drives passed within the
            coverage radius; None if a map has no drive.
        control: apparent change between two drives in the same stage, one on
            A's route and one on B's; None if it was not measured.
        control_names: names of the two drives that `control` compares.
        alignment: alignment of A and B; None if they were in one world already.
        registered: change after registration; None if a map has too few points,
            or if it was not measured.
    """

    source: str
    target: str
    change: TemporalChange
    spread: Spread | None = None
    masked: TemporalChange | None = None
    control: TemporalChange | None = None
    control_names: tuple[str, str] | None = None
    alignment: AlignmentReport | None = None
    registered: RegisteredChange | None = None

    @property
    def note(self) -> str | None:
        """What to know of the frames of A and B; None if they agree."""
        one = self.registered
        # The difference is NaN if nothing could be compared.
        if (
            one is None
            or not self.change.symmetric - one.symmetric > _EXPLAINED
        ):
            return None
        x, y, z = one.offset
        return (
            f"the frames of {self.source} and {self.target} differ by a yaw of"
            f" {one.yaw_deg:.2f} deg and ({x:.2f}, {y:.2f}, {z:.2f}) m, which"
            f" would explain a part of TCR_sym: {self.change.symmetric:.4f},"
            f" and {one.symmetric:.4f} after registration"
        )

    def beside(self, control: ChangeReport) -> ChangeReport:
        """Returns the same report, together with the change of its control."""
        return replace(
            self,
            control=control.change,
            control_names=(control.source, control.target),
        )

    def to_json(self) -> dict[str, Any]:
        """Returns what the metrics of the change leave out, for JSON."""
        change = self.change
        sides = {
            "source": change.source_to_target,
            "target": change.target_to_source,
        }
        values: dict[str, Any] = {
            "voxels": {k: len(side.in_hull) for k, side in sides.items()},
            "in_hull_of": {k: side.num_in_hull for k, side in sides.items()},
            "unchanged_of": {
                k: side.num_unchanged for k, side in sides.items()
            },
            "voxel_size": VOXEL_SIZE,
            "grids": len(GRIDS),
            "tau": TAU,
            "hull_margin": HULL_MARGIN,
            "coverage_masked": None,
            "no_change": None,
            "alignment": self.alignment and self.alignment.to_json(),
            "registration_xyz_m": self.registered
            and list(self.registered.offset),
        }
        if change.undefined_because:
            values["reason"] = change.undefined_because
        if self.masked is not None:
            masked = _numbers_of_change(self.masked)
            values["coverage_masked"] = masked | {"radius": COVERAGE_RADIUS}
        if self.control is not None and self.control_names is not None:
            names = list(self.control_names)
            values["no_change"] = _numbers_of_change(self.control) | {
                "between": names
            }
        return values


def change_of_maps(source: DriveMap, target: DriveMap) -> ChangeReport:
    """Returns the change between two maps, without its context.

    Raises:
        InputError: the maps are not in one world.
    """
    if source.drive is not None and target.drive is not None:
        check_same_world(source.drive, target.drive)
    change, clouds = _change_on_grid(source, target)
    masked = None
    if source.positions is not None and target.positions is not None:
        both = (source.positions, target.positions)
        masked = change.restricted(*(covered(cloud, both) for cloud in clouds))
    return ChangeReport(source.name, target.name, change, masked=masked)


def spread_over_grids(
    source: DriveMap, target: DriveMap, change: TemporalChange
) -> Spread:
    """Returns the least and the greatest TCR_sym over positions of the grid.

    The positions are the unshifted grid and each shift of `GRIDS`.

    Args:
        source, target: the two maps.
        change: their change on the unshifted grid.
    """
    values = [change.symmetric]
    values += [_change_on_grid(source, target, at)[0].symmetric for at in GRIDS]
    return Spread(float(np.min(values)), float(np.max(values)))


def registered_change(
    source: DriveMap, target: DriveMap
) -> RegisteredChange | None:
    """Returns the change that is left after two maps are registered.

    Args:
        source, target: the maps A and B.

    Returns:
        The change; None if a map has too few points for a registration.
    """
    # Imported here: it is slow to load, and not needed for other measures.
    from evaluation.alignment import (
        NUM_NEIGHBOURS,
        make_surface,
        register,
        registration_at,
    )

    clouds = [one.voxels.centroids_W for one in (source, target)]
    if min(map(len, clouds)) < NUM_NEIGHBOURS:
        return None
    # About the middle of A: coordinates may be large (UTM).
    middle = clouds[0].mean(axis=0)
    held, moved = (make_surface(cloud - middle) for cloud in clouds)
    unmoved = registration_at(moved, held, np.eye(4))
    fit = register(moved, held, np.eye(4))
    X_AB = np.eye(4)
    is_better = fit.fitness > unmoved.fitness
    if is_better and fit.structure >= _LEAST_STRUCTURE:
        X_AB[:3, :3] = fit.X_TS[:3, :3]
        X_AB[:3, 3] = fit.X_TS[:3, 3] + middle - fit.X_TS[:3, :3] @ middle
    change = temporal_change(
        source.voxels.merged().centroids_W,
        target.voxels.merged(X_NW=X_AB).centroids_W,
    )
    return RegisteredChange(change.symmetric, X_AB)


def _change_on_grid(
    source: DriveMap,
    target: DriveMap,
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> tuple[TemporalChange, list[np.ndarray]]:
    """Returns the change on a shifted grid, and the centroids of A and B.

    Args:
        source, target: the maps A and B.
        shift: shift of the grid [m].
    """
    clouds = [
        drive_map.voxels.merged(shift=shift).centroids_W
        for drive_map in (source, target)
    ]
    return temporal_change(*clouds), clouds


def same_stage_partner(
    source: DriveMap, target: DriveMap, control: DriveMap
) -> DriveMap:
    """Returns which of two drives is in the control's stage.

    This is the drive whose route the control does not follow.

    Args:
        source, target: the two drives.
        control: a drive on the route of one of them, in the stage of the other.

    Raises:
        InputError: one of the three is not a drive, the drives are not in one
            world, or the control follows neither route.
    """
    if (
        source.positions is None
        or target.positions is None
        or control.positions is None
    ):
        raise InputError(
            f"{control.name}: a control needs three recorded drives, not"
            " map files"
        )
    on_source = _route_distance(control.positions, source.positions)
    on_target = _route_distance(control.positions, target.positions)
    if min(on_source, on_target) > _SAME_ROUTE:
        raise InputError(
            f"{control.name}: as control on neither route: {on_source:.1f} m"
            f" from that of {source.name}, {on_target:.1f} m from that of"
            f" {target.name}"
        )
    return target if on_source <= on_target else source


def _route_distance(first: np.ndarray, second: np.ndarray) -> float:
    """Returns the mean distance between two routes [m].

    For each route, the distances of its points from the other route are
    averaged; the larger of the two means is returned.
    """
    there, _ = cKDTree(second).query(first)
    back, _ = cKDTree(first).query(second)
    return float(max(there.mean(), back.mean()))


def _numbers_of_change(change: TemporalChange) -> dict:
    values: dict[str, float | str | None] = {
        "tcr_sym": change.symmetric,
        "in_hull": change.num_in_hull,
        "unchanged": change.num_unchanged,
    }
    if change.undefined_because:
        values["reason"] = change.undefined_because
    return values
