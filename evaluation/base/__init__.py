"""What two houses or more need: a wall, it knows none of them.

Errors, files, numbers, jobs, progress and the frame of command lines. Nothing
here imports Drake.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
