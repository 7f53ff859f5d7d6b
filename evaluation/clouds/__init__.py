"""Files of single point clouds: PCD, PLY, NumPy and KITTI's.

`cloud_files` reads a file of any kind, by `pcd_files`, `ply_files`, `npy_files`
or `bin_columns`; `record_reading` is common to these. `count_images` reads and
makes bird's-eye images.
"""
