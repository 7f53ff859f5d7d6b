"""Downtown, stage 01: before it was built up.

Brick rows, houses and the monument stand; along the ring, on the plateau and
around the southern avenue most lots are open. A drive over the plateau, along
both avenues and round the south-western blocks; `diagrams/downtown_04.py`
drives through the finished city.

What is driven is data, `worlds/downtown/sequence_01.yaml`; how it is wired
is `cns_drake.station.make_station`.
"""

from cns_drake.sequence_script import main

if __name__ == "__main__":
    main("downtown_01", __doc__)
