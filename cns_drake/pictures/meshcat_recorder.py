"""Records a drive while it is simulated, for its web page."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import numpy as np
from pydrake.common.value import Value
from pydrake.geometry import FrameId, QueryObject
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, EventStatus, LeafSystem
from pydrake.systems.sensors import ImageRgba8U

from cns_drake.pictures.city_parts import changed_above, read_parts
from cns_drake.pictures.drive_page import (
    OtherPage,
    make_drive_page,
    make_pair_page,
    moving_frames,
)
from cns_drake.pictures.drive_record import DriveRecord, ScanRecord, pack_scan
from cns_drake.pictures.page_panel import ShownStages, point_kinds
from cns_drake.scene import World
from evaluation.base import to_jpeg, write_text
from evaluation.lidar_sheets import MOST_RINGS

# Greatest number of images per camera.
_MAX_IMAGES = 200
# Longer side of an image [pixels].
_IMAGE_SIDE = 400


class MeshcatRecorder(LeafSystem):
    """A system that records a drive and saves it as a web page.

    See `make_drive_page` for the page.

    .. pydrake_system::

        name: MeshcatRecorder
        input_ports:
        - geometry_query
        - odometry
        - specific_force
        - angular_velocity
        - <lidar>_scan (one for each LiDAR)
        - <camera>_image (one for each camera)

    Frames: world W, vehicle B (`base_link`), LiDAR S, IMU I. `odometry` is an
    `Odometry`; `specific_force` [m/s^2] and `angular_velocity` w_WI_I [rad/s]
    are expressed in I; `<lidar>_scan` is a structured array of points expressed
    in S; `<camera>_image` is an ImageRgba8U.

    The poses of all moving frames are recorded at every frame. Scans are
    recorded with all of their points, of as many evenly spaced frames as a page
    can hold.

    Attributes:
        drive: what was recorded so far.
    """

    def __init__(
        self,
        world: World,
        *,
        X_BSs: Mapping[str, RigidTransform],
        period: float,
        num_frames: int | None = None,
        shown: ShownStages | None = None,
        sensors: Sequence[str] = (),
        cameras: Mapping[str, int] = MappingProxyType({}),
    ):
        """Declares the ports and the schedule.

        Args:
            world: the world that is drawn.
            X_BSs: name of a LiDAR -> pose of its frame S on the body B.
            period: time between two frames [s].
            num_frames: number of frames that are recorded; all if None.
            shown: stages whose differences the page shows; None for none.
            sensors: a line of text for each sensor.
            cameras: name of a camera -> number of frames from one image to the
                next.
        """
        super().__init__()
        self._world = world
        self._shown = shown or ShownStages()
        own = read_parts(world)
        other = self._shown.other
        self._parts = own, own if other is None else read_parts(other)
        self._changed_above = changed_above(*self._parts, world.structures)
        self._X_BSs = dict(X_BSs)
        self._num_frames = num_frames
        self.drive = DriveRecord(
            period,
            X_WFs={frame_id: [] for frame_id in moving_frames(world)},
            scans=ScanRecord(num_frames),
            sensors=tuple(sensors),
        )

        self._geometry_query = self.DeclareAbstractInputPort(
            "geometry_query", Value(QueryObject())
        )
        self._odometry = self.DeclareAbstractInputPort(
            "odometry", Value(object())
        )
        self._specific_force = self.DeclareVectorInputPort("specific_force", 3)
        self._angular_velocity = self.DeclareVectorInputPort(
            "angular_velocity", 3
        )
        self._scans = {
            name: self.DeclareAbstractInputPort(f"{name}_scan", Value(object()))
            for name in self._X_BSs
        }
        self._cameras = dict(cameras)
        self._images = {}
        for name in cameras:
            self.drive.images[name] = []
            self._images[name] = self.DeclareAbstractInputPort(
                f"{name}_image", Value(ImageRgba8U())
            )
        self.DeclarePeriodicPublishEvent(
            period_sec=period, offset_sec=0.0, publish=self._publish
        )

    def add_moving_object(self, name: str, frames: Sequence[FrameId]) -> None:
        """Adds a moving object to the page.

        The object moves as a rigid body: only the motion of the first frame is
        recorded, and all other frames follow it.

        Args:
            name: name of the object, unique in the page.
            frames: geometry frames of the object.
        """
        leading = frames[0]
        self.drive.X_WFs[leading] = []
        self.drive.names[leading] = name
        self.drive.limbs[leading] = dict.fromkeys(frames, RigidTransform())

    def save(
        self,
        path: Path,
        *,
        title: str = "cns-drake",
        beside: OtherPage | None = None,
    ) -> None:
        """Writes the web page of the drive as recorded so far.

        Args:
            path: the file.
            title: title of the page.
            beside: page of another drive in the same city, to show it on the
                left of this one.

        Raises:
            InputError: if the file cannot be written.
        """
        page = make_drive_page(
            self.drive, self._world, self._parts, self._shown, title
        )
        if beside is not None:
            page = make_pair_page(beside, OtherPage(title, page))
        write_text(path, page)

    def _publish(self, context: Context) -> EventStatus:
        if len(self.drive.X_WBs) == self._num_frames:
            return EventStatus.DidNothing()
        query_object = self._geometry_query.Eval(context)
        for frame_id, X_WFs in self.drive.X_WFs.items():
            X_WF = query_object.GetPoseInWorld(frame_id)
            # Copies, since the values of the ports may be overwritten in the
            # next step.
            X_WFs.append(RigidTransform(X_WF))
        if not self.drive.X_WBs:
            for leading, X_FLs in self.drive.limbs.items():
                X_FW = self.drive.X_WFs[leading][0].inverse()
                for limb in X_FLs:
                    X_FLs[limb] = X_FW @ query_object.GetPoseInWorld(limb)
        odometry = self._odometry.Eval(context)
        X_WB = RigidTransform(odometry.X_WB)
        self.drive.speeds.append(float(odometry.V_WB_B.translational()[0]))
        self.drive.specific_forces_I.append(
            self._specific_force.Eval(context).copy()
        )
        self.drive.angular_velocities_I.append(
            self._angular_velocity.Eval(context).copy()
        )
        frame = len(self.drive.X_WBs)
        self.drive.X_WBs.append(X_WB)
        if self.drive.scans.wants(frame):
            self._take_scan(context, frame, X_WB)
        self._take_images(context, frame)
        return EventStatus.Succeeded()

    def _take_images(self, context: Context, frame: int) -> None:
        for name, images in self.drive.images.items():
            if frame % self._cameras[name]:
                continue
            # The import is slow, and few drives have cameras.
            from PIL import Image

            pixels = self._images[name].Eval(context).data[:, :, :3]
            picture = Image.fromarray(np.ascontiguousarray(pixels))
            images.append((frame, to_jpeg(picture, longest=_IMAGE_SIDE)))
            if len(images) > _MAX_IMAGES:
                del images[1::2]
                self._cameras[name] *= 2

    def _take_scan(
        self, context: Context, frame: int, X_WB: RigidTransform
    ) -> None:
        p_WRsets, rings = [np.empty((0, 3))], [np.empty(0, int)]
        marks = [np.empty((0, 2), np.uint8)]
        for k, (name, port) in enumerate(self._scans.items()):
            scan = port.Eval(context)
            X_WS = X_WB @ self._X_BSs[name]
            p_SRset = np.column_stack([scan["x"], scan["y"], scan["z"]])
            p_WRset = p_SRset @ X_WS.rotation().matrix().T + X_WS.translation()
            p_WRsets.append(p_WRset)
            rings.append(scan["ring"].astype(int) + k * MOST_RINGS)
            is_changed = p_WRset[:, 2] > self._changed_above[scan["instance"]]
            marks.append(
                np.column_stack(
                    [
                        self.drive.scans.intensity_levels(scan["intensity"]),
                        point_kinds(scan["label"], is_changed),
                    ]
                )
            )
        self.drive.scans.add(
            pack_scan(
                frame,
                np.concatenate(p_WRsets),
                np.concatenate(rings),
                X_WB.translation(),
                np.concatenate(marks),
            )
        )
