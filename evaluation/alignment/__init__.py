"""Alignment of drives with poses in different worlds: a public noun.

`open_pair` opens what is compared, and says in which world it is. Drives in
different worlds are aligned: guesses of the pose, loops between submaps, and a
pose graph fitted to the loops.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
