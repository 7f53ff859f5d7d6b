"""Metropolis, stage 02: the first building boom is over.

The works and the rows at the edges have been filled in; the lots around the
first skyscraper, along the boulevard and in the east are still empty. A drive
once round the ring and twice along the boulevard, the other way round than
most of `diagrams/metropolis_04.py`, which drives through the finished city.
"""

from cns_drake import run_script

if __name__ == "__main__":
    run_script("metropolis_02", __doc__)
