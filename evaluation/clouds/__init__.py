"""Files of single point clouds: PCD, PLY, NumPy and KITTI's.

`cloud_files` reads a file of any of these formats, by means of `pcd_files`,
`ply_files`, `npy_files` or `bin_columns`. `record_reading` contains what these
readers share. `count_images` reads and makes bird's-eye images.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
