"""One function a verb: a public noun. The commands call them, and print.

`recognise`, `change_between`, `localise` and `update_map` measure two drives or
maps. What they return has all that a command prints, and the rows of its
tables. `report` evaluates a folder of recordings.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
