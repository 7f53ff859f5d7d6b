"""Recordings: a public noun, `McapRecorder`, which writes ROS 2 messages."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
