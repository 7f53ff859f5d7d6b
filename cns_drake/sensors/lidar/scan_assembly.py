"""The points of a scan, assembled from the returns of its beams."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from pydrake.perception import PointCloud

from cns_drake.sensors.lidar.beams import Beams
from cns_drake.sensors.lidar.measurement import Returns
from evaluation.base import compiled

if TYPE_CHECKING:
    # Slow to import, and ideal returns do without.
    from cns_drake.sensors.returns.calibrated import CalibratedReturns

# One return, in the sensor frame. Fields have C alignment, for readers that map
# structs onto the bytes. NumPy's copies leave the two bytes after `ring`
# undefined.
POINT_DTYPE = np.dtype(
    [
        ("x", "<f4"),
        ("y", "<f4"),
        ("z", "<f4"),
        ("intensity", "<f4"),
        ("ring", "<u2"),
        ("t", "<u4"),
        ("label", "<u2"),
        ("instance", "<u2"),
    ],
    align=True,
)
# The class of points without a structure: SemanticKITTI's outlier.
SCATTERED_LABEL = 1


class BeamTable(NamedTuple):
    """Properties of the beams that are the same in every scan.

    Attributes:
        d_Sset: (num_beams, 3) float32 unit directions, expressed in S.
        p_Sset: (num_beams, 3) float32 where beams start [m]; (0, 3) if all
            beams start at the origin of S.
        ring: (num_beams,) uint16 number of each beam's laser.
        t_ns: (num_beams,) uint32 firing time since the start of the revolution
            [ns].
        place: (num_beams,) position of each beam in the order in which rays are
            cast.
    """

    d_Sset: np.ndarray
    p_Sset: np.ndarray
    ring: np.ndarray
    t_ns: np.ndarray
    place: np.ndarray


class Revolution:
    """The beams of a revolution, ready for casting and assembling.

    Attributes:
        beams: the beams in firing order.
        d_Sset_cast: (N, 3) directions in the order of casting.
        unit_beams: the beams with the errors of an individual unit; None for
            ideal returns.
        table: constants for assembling points.
    """

    def __init__(self, beams: Beams, returns: CalibratedReturns | None):
        """Takes the beams, and the model of a real unit's returns, if any."""
        self.beams = beams
        self.d_Sset_cast = beams.d_Sset[beams.packet_order]
        d_Sset, p_Sset = beams.d_Sset, np.zeros((0, 3))
        self.unit_beams = None
        if returns is not None:
            self.unit_beams = returns.unit_beams(beams)
            d_Sset = self.unit_beams.reported
            p_Sset = self.unit_beams.p_SLset
        self.table = BeamTable(
            d_Sset.astype(np.float32),
            p_Sset.astype(np.float32),
            beams.ring,
            beams.t_ns,
            np.argsort(beams.packet_order, kind="stable"),
        )


@lru_cache(maxsize=4)
def shared_revolution(
    beams: Beams, returns: CalibratedReturns | None
) -> Revolution:
    """Returns a revolution; LiDARs with equal beams and returns share it.

    Sharing saves memory, because Drake's bindings may keep a dropped Diagram
    with its LiDARs.
    """
    return Revolution(beams, returns)


@compiled
def assemble_points(
    scan: np.ndarray,
    table: BeamTable,
    returns: Returns,
    met: np.ndarray,
    label: np.ndarray,
    instance: np.ndarray,
    step: np.float32,
) -> None:
    """Fills a scan: one point of `POINT_DTYPE` for each of N returns.

    Args:
        scan: (N,) points, whose fields are set.
        table: properties of the beams.
        returns: beam, range and intensity of each return.
        met: (N,) int32 index of the hit geometry in `label` and `instance`;
            negative for returns from rain, snow or fog.
        label, instance: uint16 class and instance id of each geometry.
        step: step of the rounded coordinates [m]; 0 for exact coordinates.
    """
    # As names of their own, fields are fast.
    beams, ranges, intensity = returns.beams, returns.ranges, returns.intensity
    for k in range(len(beams)):
        # For a signed index, numba looks at each use whether it counts from
        # the end.
        beam = np.uint64(beams[k])
        point = scan[k]
        x = table.d_Sset[beam, 0] * ranges[k]
        y = table.d_Sset[beam, 1] * ranges[k]
        z = table.d_Sset[beam, 2] * ranges[k]
        if len(table.p_Sset):
            x += table.p_Sset[beam, 0]
            y += table.p_Sset[beam, 1]
            z += table.p_Sset[beam, 2]
        if step > 0:
            x = np.rint(x / step) * step
            y = np.rint(y / step) * step
            z = np.rint(z / step) * step
        point.x, point.y, point.z = x, y, z
        point.intensity = intensity[k]
        point.ring, point.t = table.ring[beam], table.t_ns[beam]
        if met[k] < 0:
            point.label, point.instance = SCATTERED_LABEL, 0
        else:
            geometry = np.uint64(met[k])
            point.label = label[geometry]
            point.instance = instance[geometry]


def set_points(
    cloud: PointCloud, p_FRset: np.ndarray, greys: np.ndarray
) -> None:
    """Sets the points of a cloud of Drake.

    Args:
        cloud: the cloud, with or without colours.
        p_FRset: (3, N) positions in any frame F [m].
        greys: (N,) brightness of the points, from 0 to 255.
    """
    cloud.resize(p_FRset.shape[1])
    cloud.mutable_xyzs()[:] = p_FRset
    if cloud.has_rgbs():
        cloud.mutable_rgbs()[:] = np.rint(np.clip(greys, 0.0, 255.0))
