"""Cities that change, driven and recorded by simulated LiDAR in Drake."""

__version__ = "0.1.0"
