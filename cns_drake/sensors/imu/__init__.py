"""The IMU: its description, its errors, and its systems."""
