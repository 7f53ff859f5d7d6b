"""The command `cns-drake` and the diagram scripts."""
