"""The command `cns-drake`: its commands, each with an example.

Each command imports its slow modules itself, so that `--help` and `list` answer
at once. Interrupts wait during imports.
"""

from cns_drake.base import terminal
from cns_drake.base.terminal import example
from cns_drake.command_line.ageing import age, years
from cns_drake.command_line.laddering import ladder, levels, size
from cns_drake.command_line.learning import export_pairs, train
from cns_drake.command_line.map_truthing import map_pairs, map_truth
from cns_drake.command_line.maps import city, import_city, list_drives
from cns_drake.command_line.overlapping import overlap
from cns_drake.command_line.recorded import export, repair
from cns_drake.command_line.reproducing import fresh, reproduce
from cns_drake.command_line.simulating import generate, scan, simulate
from cns_drake.command_line.trends import trend

app = terminal.make_program(
    "cns-drake",
    "Cities that change, driven and recorded by simulated LiDAR.",
    example("cns-drake simulate metropolis_01 --output drives"),
)
app.command("list", epilog=example("cns-drake list"))(list_drives)
app.command(epilog=example("cns-drake simulate metropolis_01 --output drives"))(
    simulate
)
app.command(
    epilog=example(
        "cns-drake scan worlds/metropolis/stage_01.sdf \\",
        "    --pose 0 0 1.6 0 0 1.57 --output scan.pcd",
    )
)(scan)
app.command(
    epilog=example(
        "cns-drake export drives/metropolis_01 \\",
        "    --format kitti --output kitti",
    )
)(export)
app.command(
    epilog=example(
        "cns-drake generate metropolis_01 metropolis_04 \\",
        "    --output drives --jobs 2",
    )
)(generate)
app.command(
    epilog=example("cns-drake repair damaged.mcap --output whole.mcap")
)(repair)
app.command(
    epilog=example("cns-drake reproduce metropolis --output study --quick")
)(reproduce)
app.command(
    epilog=example("cns-drake fresh suburbia --number 2 --output fresh")
)(fresh)
app.command(
    epilog=example(
        "cns-drake trend --vary family.yaml \\",
        "    --query riverside_02 --output trend",
    )
)(trend)
app.command(
    epilog=example(
        "cns-drake overlap metropolis_01 metropolis_04 \\",
        "    --output overlaps.csv",
    )
)(overlap)
app.command(
    epilog=example(
        "cns-drake map-truth metropolis_01 metropolis_04 \\",
        "    --output maps",
    )
)(map_truth)
app.command(epilog=example("cns-drake map-pairs suburbia_5 --output pairs"))(
    map_pairs
)
app.command(
    epilog=example("cns-drake ladder metropolis --output ladder --quick")
)(ladder)
app.command(epilog=example("cns-drake levels ours.csv theirs.csv"))(levels)
app.command(epilog=example("cns-drake train --output mine.npz --minutes 10"))(
    train
)
app.command(
    "export-pairs",
    epilog=example(
        "cns-drake export-pairs riverside_01 riverside_02 \\",
        "    --format pointnetvlad --output pairs",
    ),
)(export_pairs)
app.command(epilog=example("cns-drake size suburbia --places 0 --output size"))(
    size
)
app.command(
    "import",
    epilog=example(
        "cns-drake import delft.city.jsonl \\",
        "    --years 1930 1970 2000 2020 --output delft",
    ),
)(import_city)
app.command(
    epilog=example(
        "cns-drake age suburbia \\",
        "    --years 1 5 20 --seed 1 --output old_suburbia",
    ),
    context_settings={"ignore_unknown_options": True},
)(age)
app.command(
    epilog=example(
        "cns-drake years suburbia \\",
        "    --years 5 20 --quick --output years",
    ),
    context_settings={"ignore_unknown_options": True},
)(years)
app.command(
    epilog=example(
        "cns-drake city town --start",
        "cns-drake city town --calibrate 01 02",
    )
)(city)


def main() -> None:
    """Runs the command line."""
    terminal.run(app, "cns-drake")


if __name__ == "__main__":
    main()
