"""Runs `cns-drake city` as `python -m cns_drake.city`."""

import sys

from cns_drake.__main__ import main

if __name__ == "__main__":
    sys.argv.insert(1, "city")
    main()
