"""Metropolis, stage 04: the finished city.

Every tower, tree and landmark stands. `diagrams/metropolis_01.py` drives
through the same streets three stages earlier.

What is driven is data, `worlds/metropolis/sequence_04.yaml`; how it is wired
is `cns_drake.station.make_station`.
"""

from cns_drake.sequence_script import main

if __name__ == "__main__":
    main("metropolis_04", __doc__)
