"""The command `cns-eval`."""
