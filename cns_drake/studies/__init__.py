"""Studies of many drives: experiments, the pairs they compare, the results.

`study` runs an experiment with the help of these packages, each of which
imports only packages that stand below it:

- `exports`, `tasks` and `training` use pairs, or the drives of a pair.
- `pairs` has the drives to compare, in all conditions of an experiment.
- `recordings` records the drives of maps, and reports on them.
- `drives` changes drives, `maps` makes the maps that these drives need, and
  `ground_truth` labels scans and maps by rays.
- `experiments` reads the file of an experiment, and lists its conditions.
"""

from cns_drake.base import attach, check_evaluation

# Checked before a module in here imports `evaluation`.
check_evaluation()

__getattr__, __dir__, __all__ = attach(__name__, __file__)
