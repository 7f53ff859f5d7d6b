"""The command line `cns-eval`: its commands, each with an example.

Each command is a module, and imports its slow modules itself, so that the help
comes at once.
"""

from cns_drake.base import Command, example, program, show_progress
from evaluation.command_line.compare import compare
from evaluation.command_line.localise import localise
from evaluation.command_line.map_update import map_update
from evaluation.command_line.pr import pr
from evaluation.command_line.real import real
from evaluation.command_line.report import report
from evaluation.command_line.tcr import tcr

app = program.make_program(
    "cns-eval",
    "Structural change and place recognition on LiDAR drives.",
    example("cns-eval tcr before.pcd after.pcd"),
    groups={
        "Measure change": ("tcr",),
        "Recognise places": ("pr", "report", "compare", "real"),
        "Localise, and keep maps": ("localise", "map-update"),
    },
    gone={
        "tcr --paths": "cns-drake export --format tum, and evo_traj of evo",
        "localise --estimate": (
            "cns-drake export --format tum, and evo_ape and evo_rpe of evo"
        ),
    },
)
app.command(
    cls=Command,
    epilog=example("cns-eval tcr drives/metropolis_01 drives/metropolis_04"),
)(tcr)
app.command(
    cls=Command,
    epilog=example(
        "cns-eval pr drives/metropolis_01 drives/metropolis_04 \\",
        "    --method scan-context++",
    ),
)(pr)
app.command(
    cls=Command,
    epilog=example(
        "cns-eval localise drives/metropolis_01 \\",
        "    drives/metropolis_04 --method gicp --start 1",
    ),
)(localise)
app.command(
    cls=Command, epilog=example("cns-eval report drives --output report")
)(report)
app.command(cls=Command, epilog=example("cns-eval compare mine/results.csv"))(
    compare
)
app.command(
    cls=Command, epilog=example("cns-eval real real_scans --output real")
)(real)
app.command(
    cls=Command, epilog=example("cns-eval map-update maps --baseline distance")
)(map_update)


def main() -> None:
    """Runs the command line and exits with its status."""
    program.run(app, "cns-eval", show_progress())
