"""Settings of a process: its number of cores, and its garbage collection."""

import atexit
import gc
import os

# Python collects garbage when so many objects have been added since the last
# collection. Python's default is 700 or 2,000.
_OBJECTS = 50_000

# Environment of a process that uses one core. More threads of linear algebra
# would wait for each other by spinning, and the matrices here are small.
ONE_CORE = dict.fromkeys(
    ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"), "1"
)


def num_cores() -> int:
    """Returns the number of cores that this process can use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def collect_garbage_seldom() -> None:
    """Makes Python's garbage collector run less often in this process.

    Imports and compilation create many objects that are never freed. At
    Python's default, scanning these objects takes up to a tenth of the time,
    and at the end as much again, although the memory is about to be returned.
    """
    gc.set_threshold(_OBJECTS, *gc.get_threshold()[1:])
    atexit.register(gc.freeze)
