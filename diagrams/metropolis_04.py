"""Metropolis, stage 04: the finished city.

Every tower, tree and landmark stands. `diagrams/metropolis_01.py` drives
through the same streets three stages earlier.
"""

from cns_drake import run_script

if __name__ == "__main__":
    run_script("metropolis_04", __doc__)
