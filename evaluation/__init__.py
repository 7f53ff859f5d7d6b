"""Structural change and place recognition on LiDAR drives.

`recognise`, `change_between`, `localise` and `update_map` measure two drives or
maps; the commands of `cns-eval` print what they return. The package imports
neither Drake nor anything of `cns_drake` but `cns_drake.base` and
`cns_drake.drives`.

`__all__` lists the public names. Each is imported when it is first used, from
the module that `__init__.pyi` names. `evaluation.drives` and
`evaluation.methods` are public as well.
"""

from pkgutil import extend_path

from cns_drake.base import attach

# Python prefers a package to a folder without `__init__`. With this line,
# modules in a user's folder of the same name can be imported as well.
__path__ = extend_path(__path__, __name__)

__getattr__, __dir__, __all__ = attach(__name__, __file__)
