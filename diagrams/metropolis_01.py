"""Metropolis, stage 01: the city before its towers.

The oldest stage that the map has. A drive around the ring and along both
avenues past cleared lots and young streets; `diagrams/metropolis_04.py`
drives through the finished city on a route that overlaps with this one.
"""

from cns_drake import run_script

if __name__ == "__main__":
    run_script("metropolis_01", __doc__)
