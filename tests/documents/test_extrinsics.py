"""The extrinsics that the documents write out, against the sensors' places."""

from helpers import documents
import numpy as np
import yaml

from cns_drake.sensors import ImuSection, LidarSection, sensor_pose


def test_extrinsics_are_those_of_the_default_places():
    page = documents.read("docs/how-to/lidar_odometry.md")
    rows = documents.table(page, "## LIO-SAM and FAST-LIO2")
    said = {
        row[0].strip("`"): yaml.safe_load(row[1])
        for row in rows
        if row[0].strip("`") in ("extrinsicTrans", "extrinsic_T")
    }
    X_LI = sensor_pose(LidarSection()).inverse() @ sensor_pose(ImuSection())
    np.testing.assert_allclose(said["extrinsicTrans"], X_LI.translation())
    np.testing.assert_allclose(
        said["extrinsic_T"], X_LI.inverse().translation()
    )
    np.testing.assert_array_equal(X_LI.rotation().matrix(), np.eye(3))
