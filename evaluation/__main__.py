"""`python -m evaluation` is `cns-eval`."""

from evaluation.command_line.cli import main

if __name__ == "__main__":
    main()
