"""Recordings: a public noun, `McapRecorder`, which writes ROS 2 messages."""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
