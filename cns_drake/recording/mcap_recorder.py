"""Recording the sensors of a Diagram as ROS 2 messages."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
import math
from typing import Any

from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, EventStatus, LeafSystem

from cns_drake.recording import messages
from cns_drake.recording.background_writer import BackgroundWriter
from cns_drake.recording.bag_writer import BagWriter
from cns_drake.recording.frame_clock import frame_stamp_ns
from cns_drake.recording.rosbag2_metadata import Topic

_TF_STATIC = Topic("/tf_static", messages.TF, latched=True)
_TF = Topic("/tf", messages.TF)
_ODOMETRY = Topic("/odometry", messages.ODOMETRY)
_IMU = Topic("/imu/data", messages.IMU)

# Events of a periodic schedule come at exact multiples of the period; only
# the rounding of that product separates their times from a frame's.
_FRAME_TOLERANCE = 1e-6


class McapRecorder(LeafSystem):
    """Writes each frame's sensor outputs to a BagWriter.

    .. pydrake_system::

        name: McapRecorder
        input_ports:
        - odometry
        - specific_force
        - angular_velocity
        - <lidar>_scan (one for each LiDAR)

    Frames: map W, vehicle B (`base_link`), imu I, LiDAR S.

    - `odometry`: abstract, an object with `X_WB` (RigidTransform) and
      `V_WB_B` (SpatialVelocity expressed in B).
    - `specific_force`: of I, expressed in I, vector of size 3 [m/s^2].
    - `angular_velocity`: w_WI_I, vector of size 3 [rad/s].
    - `<lidar>_scan`: abstract, structured array of points expressed in S.

    The system has no state. Frame i is what the inputs show at i * period;
    it is written by a periodic publish event from time zero on, or by a
    forced publish at such a time. The inputs must be wired straight to
    continuous outputs: a publish sees the state before any update at the
    same time, so a hold in front would make every message one period old.

    Example:
        from cns_drake import McapRecorder

        recorder = McapRecorder(
            bag, X_BSs={"lidar": X_BS}, X_BI=X_BI, period=0.05, start_ns=0
        )
    """

    def __init__(
        self,
        bag: BagWriter | BackgroundWriter,
        *,
        X_BSs: Mapping[str, RigidTransform],
        X_BI: RigidTransform,
        period: float,
        start_ns: int,
    ):
        """Declares the ports and the schedule.

        Args:
            bag: an open bag with the topics of `recording_topics`.
            X_BSs: LiDAR name -> pose of its frame S in B.
            X_BI: pose of the imu frame I in B.
            period: time between frames [s].
            start_ns: the stamp of frame 0 [ns].
        """
        super().__init__()
        self._bag = bag
        self._X_BSs = dict(X_BSs)
        self._X_BI = X_BI
        self._period = period
        self._start_ns = start_ns

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
        self.DeclarePeriodicPublishEvent(
            period_sec=period, offset_sec=0.0, publish=self._publish
        )
        self.DeclareForcedPublishEvent(self._publish)

    def _publish(self, context: Context) -> EventStatus:
        frame = self._frame_index(context.get_time())
        stamp_ns = frame_stamp_ns(
            frame, start_ns=self._start_ns, period=self._period
        )
        odometry = self._odometry.Eval(context)
        if frame == 0:
            # Latched, hence once; in the first frame rather than before it,
            # so that the recorder needs no memory of having written it.
            self._write(_TF_STATIC, self._make_tf_static(stamp_ns), stamp_ns, 0)
        outgoing = {
            _TF: messages.make_tf(
                messages.MAP_FRAME,
                {messages.BASE_FRAME: odometry.X_WB},
                stamp_ns,
            ),
            _ODOMETRY: messages.make_odometry(
                odometry.X_WB, odometry.V_WB_B, stamp_ns
            ),
            _IMU: messages.make_imu(
                odometry.X_WB.rotation() @ self._X_BI.rotation(),
                self._angular_velocity.Eval(context),
                self._specific_force.Eval(context),
                stamp_ns,
            ),
        }
        for name, scan in self._scans.items():
            outgoing[_points_topic(name)] = messages.make_point_cloud(
                scan.Eval(context), name, stamp_ns
            )
        for topic, message in outgoing.items():
            self._write(topic, message, stamp_ns, frame)
        return EventStatus.Succeeded()

    def _write(
        self, topic: Topic, message: Any, stamp_ns: int, sequence: int
    ) -> None:
        self._bag.write(
            topic.name, stamp_ns, messages.serialize(message), sequence
        )

    def _make_tf_static(self, stamp_ns: int) -> Any:
        X_BCs = {**self._X_BSs, messages.IMU_FRAME: self._X_BI}
        return messages.make_tf(messages.BASE_FRAME, X_BCs, stamp_ns)

    def _frame_index(self, time: float) -> int:
        frame = round(time / self._period)
        if not math.isclose(
            time, frame * self._period, abs_tol=_FRAME_TOLERANCE
        ):
            raise ValueError(
                f"time {time} s is no multiple of the period {self._period} s"
            )
        return frame


def recording_topics(lidar_names: Iterable[str]) -> tuple[Topic, ...]:
    """Returns the topics of a recording with LiDARs of these names.

    Example:
        from cns_drake import recording_topics

        topics = recording_topics(["lidar"])
    """
    points = tuple(_points_topic(name) for name in lidar_names)
    return (*points, _IMU, _ODOMETRY, _TF, _TF_STATIC)


def make_calibration(
    X_BSs: Mapping[str, RigidTransform], X_BI: RigidTransform
) -> dict:
    """Returns the sensor frames as a JSON value, for an attachment.

    Args:
        X_BSs: LiDAR name -> pose of its frame S in the vehicle frame B.
        X_BI: pose of the imu frame I in B.

    Returns:
        Frame name -> parent frame, `translation` [m] and `quat_xyzw`.
    """
    return {
        name: {
            "parent": messages.BASE_FRAME,
            "translation": [float(x) for x in X_BC.translation()],
            "quat_xyzw": list(messages.to_quat_xyzw(X_BC.rotation())),
        }
        for name, X_BC in {**X_BSs, messages.IMU_FRAME: X_BI}.items()
    }


def _points_topic(lidar_name: str) -> Topic:
    return Topic(f"/{lidar_name}/points", messages.POINT_CLOUD)
