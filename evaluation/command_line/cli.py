"""The command line `cns-eval`.

Each module of the folder `commands` is a command, and imports its slow modules
itself, so that the help comes at once.
"""

from evaluation.base import example, program, show_progress

app = program.make_program(
    "cns-eval",
    "Structural change and place recognition on LiDAR drives.",
    example("cns-eval tcr before.pcd after.pcd"),
    commands="evaluation.command_line.commands",
    groups=("Measure change", "Recognise places", "Localise, and keep maps"),
    gone={
        "pr --scores": "cns-eval scores",
        "real": "pr and localise on drives of your own; docs/real.md has more",
        "tcr --paths": "cns-drake export --format tum, and evo_traj of evo",
        "localise --estimate": (
            "cns-drake export --format tum, and evo_ape and evo_rpe of evo"
        ),
    },
)


def main() -> None:
    """Runs the command line and exits with its status."""
    program.run(app, "cns-eval", show_progress())
