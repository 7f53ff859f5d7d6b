"""Runs `cns-drake` with the instructions of Embree of another processor.

The environment names them, see `helpers.processors`.
"""

import os

from cns_drake import __main__ as program

load = program._load


def load_with_instructions():
    run = load()
    from cns_drake.ray_casting import embree

    embree.ALONE += f",isa={os.environ['CNS_DRAKE_TEST_EMBREE']}".encode()
    return run


program._load = load_with_instructions
program.main()
