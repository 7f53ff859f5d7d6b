"""Riverside, stage 01: the town before its newer quarters.

A small town on both banks of a river with four bridges.
`diagrams/riverside_02.py` drives along its eastern half when all is built.

What is driven is data, `worlds/riverside/sequence_01.yaml`; how it is wired is
`cns_drake.station.make_station`.
"""

from cns_drake.sequence_script import main

if __name__ == "__main__":
    main("riverside_01", __doc__)
