"""Riverside, stage 02: the finished town.

Row houses and shops, flats, a mill and a wharf at the river, gardens and
woods around. `diagrams/riverside_01.py` drives through its older stage.
"""

from cns_drake import run_script

if __name__ == "__main__":
    run_script("riverside_02", __doc__)
