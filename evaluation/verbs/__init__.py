"""One function a verb: a public noun. The commands call them, and print.

`recognise`, `change_between`, `localise` and `update_map` measure two drives or
maps. What they return has all that a command prints, and the rows of its
tables.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
