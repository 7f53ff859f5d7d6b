"""The command line `cns-drake`.

Each module of the folder `commands` is a command. Its slow modules are imported
when the command runs, and not before, so that `--help` and `list` answer at
once. Interrupts wait during imports.
"""

from evaluation.base import example, program, show_progress

app = program.make_program(
    "cns-drake",
    "Cities that change, driven and recorded by simulated LiDAR.",
    example("cns-drake simulate metropolis_01 --output drives"),
    commands="cns_drake.command_line.commands",
    groups=(
        "Make cities",
        "Drive through them",
        "Study what change costs",
        "Convert for other programs",
    ),
    gone={
        "pairs --format": (
            "pairs without it (PointNetVLAD's format), or "
            "cns-drake truth --format overlaps"
        ),
    },
)


def main() -> None:
    """Runs the command line."""
    program.run(app, "cns-drake", show_progress())


if __name__ == "__main__":
    main()
