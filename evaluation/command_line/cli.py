"""The command line `cns-eval`: its commands, each with an example.

Each command imports its slow modules itself, so that the help comes at once.
"""

from __future__ import annotations

from cns_drake.base import terminal
from cns_drake.base.terminal import example
from evaluation.command_line.measuring import pr, ranking, scores, tcr
from evaluation.command_line.reporting import report, trend

app = terminal.make_program(
    "cns-eval",
    "Structural change and place recognition on LiDAR drives.",
    example("cns-eval tcr before.pcd after.pcd"),
)
app.command(
    epilog=example("cns-eval tcr drives/metropolis_01 drives/metropolis_04")
)(tcr)
app.command(
    epilog=example(
        "cns-eval pr drives/metropolis_01 drives/metropolis_04 \\",
        "    --method scan-context++",
    )
)(pr)
app.command(
    epilog=example(
        "cns-eval scores --method solid --output scores.csv \\",
        "    --database kitti/sequences/01/velodyne \\",
        "    --query kitti/sequences/04/velodyne",
    )
)(scores)
app.command(epilog=example("cns-eval report drives --output report"))(report)
app.command(
    epilog=example(
        "cns-eval trend family/riverside_01_m* \\",
        "    --query family/riverside_02 --output trend",
    )
)(trend)
app.command(epilog=example("cns-eval ranking simulated/report real/report"))(
    ranking
)


def main() -> None:
    """Runs the command line and exits with its status."""
    terminal.run(app, "cns-eval")
