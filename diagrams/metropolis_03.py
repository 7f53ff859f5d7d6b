"""Metropolis, stage 03: the last year before the towers.

Little has come since stage 02: an observation tower over the park, and trees
around the lots of the skyline. A drive round the middle and half the ring;
`diagrams/metropolis_04.py` drives through the same streets once everything
is built.
"""

from cns_drake import run_script

if __name__ == "__main__":
    run_script("metropolis_03", __doc__)
