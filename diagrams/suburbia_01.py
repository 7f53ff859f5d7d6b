"""Suburbia, stage 01: the old village.

A church, a school, a row of shops and the first gardens, before the flats in
the south, the terraces in the north and the wood in the east.
`diagrams/suburbia_02.py` drives through the same streets once they stand.

What is driven is data, `worlds/suburbia/sequence_01.yaml`; how it is wired is
`cns_drake.simulation.station.make_station`.
"""

from cns_drake import run_script

if __name__ == "__main__":
    run_script("suburbia_01", __doc__)
