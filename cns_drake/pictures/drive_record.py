"""What is recorded of a drive for its web page."""

from dataclasses import dataclass, field

import numpy as np
from pydrake.geometry import FrameId
from pydrake.math import RigidTransform


@dataclass(frozen=True)
class DriveRecord:
    """The record of a drive of F frames; most lists have one entry per frame.

    Attributes:
        period: time between frames [s].
        X_WBs: poses of the vehicle.
        X_WFs: id of a geometry frame that moves -> its poses.
        scans: for each scan to show, the index of the frame, and the positions
            (N, 3) of the points in W [m].
        speeds: forward speed of the vehicle [m/s].
        specific_forces_I: specific force in the IMU's frame I [m/s^2].
        angular_velocities_I: angular velocity w_WI_I [rad/s].
        num_points: number of points in each scan as measured.
        limbs: maps the id of each moving object's root frame to the parts of
            the object. The parts map the id of a geometry frame to its constant
            pose in the root frame. Only the poses of the root frame are
            recorded. The vehicle has no entry.
        names: id of an object's root frame -> name of the object in the page.
        images: maps the name of a camera to the images to show. Each image is
            the index of its frame, and the image as JPEG.
    """

    period: float
    X_WBs: list[RigidTransform] = field(default_factory=list)
    X_WFs: dict[FrameId, list[RigidTransform]] = field(default_factory=dict)
    scans: list[tuple[int, np.ndarray]] = field(default_factory=list)
    speeds: list[float] = field(default_factory=list)
    specific_forces_I: list[np.ndarray] = field(default_factory=list)
    angular_velocities_I: list[np.ndarray] = field(default_factory=list)
    num_points: list[int] = field(default_factory=list)
    limbs: dict[FrameId, dict[FrameId, RigidTransform]] = field(
        default_factory=dict
    )
    names: dict[FrameId, str] = field(default_factory=dict)
    images: dict[str, list[tuple[int, bytes]]] = field(default_factory=dict)
