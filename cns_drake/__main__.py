"""`python -m cns_drake` is the command `cns-drake`."""

from cns_drake.cli import main

if __name__ == "__main__":
    main()
