"""Downtown, stage 02: half built.

The shopping hall, the gas station and the plateau's station have come, the
office towers, the hotel and the car park not yet. A drive round the ring and
over the plateau, through the roundabout and round the south-western blocks.
"""

from cns_drake import run_script

if __name__ == "__main__":
    run_script("downtown_02", __doc__)
