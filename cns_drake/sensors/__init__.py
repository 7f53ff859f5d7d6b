"""The LiDAR, the IMU and the odometry as Drake systems."""
