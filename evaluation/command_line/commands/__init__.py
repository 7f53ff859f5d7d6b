"""The commands of the program, a family: one file each."""
