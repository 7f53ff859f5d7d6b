"""The sensors of a vehicle: LiDARs, cameras, IMU and odometry."""
