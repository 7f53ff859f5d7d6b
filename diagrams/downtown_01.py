"""Downtown, stage 01: before it was built up.

Brick rows, houses and the monument stand; along the ring, on the plateau and
around the southern avenue most lots are open. A drive over the plateau, along
both avenues and round the south-western blocks; `diagrams/downtown_04.py`
drives through the finished city.
"""

from cns_drake import run_script

if __name__ == "__main__":
    run_script("downtown_01", __doc__)
