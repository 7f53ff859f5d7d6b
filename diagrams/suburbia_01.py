"""Suburbia, stage 01: the old village.

A church, a school, a row of shops and the first gardens, before the flats in
the south, the terraces in the north and the wood in the east.
`diagrams/suburbia_02.py` drives through the same streets once they stand.
"""

from cns_drake import run_script

if __name__ == "__main__":
    run_script("suburbia_01", __doc__)
