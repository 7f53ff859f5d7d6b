"""Metropolis, stage 04: the finished city.

Every tower, tree and landmark stands. `diagrams/metropolis_01.py` drives
through the same streets three stages earlier.

What is driven is data, `worlds/metropolis/sequence_04.yaml`; how it is wired
is `cns_drake.make_station`.
"""

from cns_drake import run_script

if __name__ == "__main__":
    run_script("metropolis_04", __doc__)
