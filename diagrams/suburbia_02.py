"""Suburbia, stage 02: the finished suburb.

Houses with gardens, terraces, flats, a shopping street, a park and a sports
ground, along a ring and the streets across it. `diagrams/suburbia_01.py`
drives through the village that it grew from.
"""

from cns_drake import run_script

if __name__ == "__main__":
    run_script("suburbia_02", __doc__)
