"""The LiDAR: its description, its presets, its beams and its Drake system."""
