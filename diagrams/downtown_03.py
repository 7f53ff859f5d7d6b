"""Downtown, stage 03: nearly complete.

Only the east is open: the building site is a field, and the towers at the
roundabout and beyond the ring are to come. A drive round the north-east the
other way than that of `diagrams/downtown_04.py`, which overlaps with it.
"""

from cns_drake import run_script

if __name__ == "__main__":
    run_script("downtown_03", __doc__)
