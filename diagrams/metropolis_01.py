"""Metropolis, stage 01: the city before its towers.

The oldest stage that the map has. A drive around the ring and along both
avenues past cleared lots and young streets; `diagrams/metropolis_04.py`
drives through the finished city on a route that overlaps with this one.

What is driven is data, `worlds/metropolis/sequence_01.yaml`; how it is wired
is `cns_drake.make_station`.
"""

from cns_drake import run_script

if __name__ == "__main__":
    run_script("metropolis_01", __doc__)
