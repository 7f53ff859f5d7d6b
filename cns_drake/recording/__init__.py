"""Recording of sensor data as ROS 2 messages in MCAP files."""
