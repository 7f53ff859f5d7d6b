"""Ground-truth odometry: its description and its system."""
