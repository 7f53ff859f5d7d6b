"""Riverside, stage 01: the town before its newer quarters.

A small town on both banks of a river with four bridges.
`diagrams/riverside_02.py` drives along its eastern half when all is built.
"""

from cns_drake import run_script

if __name__ == "__main__":
    run_script("riverside_01", __doc__)
