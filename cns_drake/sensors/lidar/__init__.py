"""The LiDAR: its description, presets and beams, its system."""
