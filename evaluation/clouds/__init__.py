"""Files of single point clouds: PCD, PLY, NumPy and KITTI's."""
