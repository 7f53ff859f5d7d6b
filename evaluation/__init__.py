"""Structural change and place recognition on LiDAR drives.

`recognise`, `change_between`, `localise` and `update_map` measure two drives or
maps; the commands of `cns-eval` print what they return. The package imports
neither Drake, nor `cns_drake` or `worlds`.

`__all__` lists the public names. Each is imported when it is first used, from
the module that `__init__.pyi` names. `evaluation.drives` and
`evaluation.methods` are public as well.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
