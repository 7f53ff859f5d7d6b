"""Downtown, stage 04: the complete city.

Towers and offices around the roundabout, the plateau with its station, the
slabs beyond the ring and a tower under construction. A drive down from the
plateau, round the ring and round the south-western blocks, against which those
of the three earlier stages are compared.
"""

from cns_drake import run_script

if __name__ == "__main__":
    run_script("downtown_04", __doc__)
