"""Frames as ROS 2 messages in MCAP files that survive a crash."""
