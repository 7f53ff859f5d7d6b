"""Suburbia, stage 02: the finished suburb.

Houses with gardens, terraces, flats, a shopping street, a park and a sports
ground, along a ring and the streets across it. `diagrams/suburbia_01.py`
drives through the village that it grew from.

What is driven is data, `worlds/suburbia/sequence_02.yaml`; how it is wired is
`cns_drake.simulation.station.make_station`.
"""

from cns_drake import run_script

if __name__ == "__main__":
    run_script("suburbia_02", __doc__)
