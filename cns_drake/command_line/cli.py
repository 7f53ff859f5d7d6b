"""The command `cns-drake`: its commands, each with an example.

A command's slow modules are imported when the command runs, and not before, so
that `--help` and `list` answer at once. Interrupts wait during imports.
"""

from collections.abc import Callable

from cns_drake.base import Command, example, program, show_progress
from cns_drake.command_line import exporting, learning, simulating, studying
from cns_drake.command_line.ageing import age
from cns_drake.command_line.importing import import_city
from cns_drake.command_line.maps import city, list_drives

# Command -> its example, line by line.
_EXAMPLES: dict[Callable[..., None], tuple[str, ...]] = {
    list_drives: ("list",),
    simulating.simulate: ("simulate metropolis_01 --output drives",),
    simulating.scan: (
        "scan worlds/metropolis/stage_01.sdf \\",
        "    --pose 0 0 1.6 0 0 1.57 --output scan.pcd",
    ),
    exporting.export: (
        "export drives/metropolis_01 \\",
        "    --format kitti --output kitti",
    ),
    simulating.generate: (
        "generate metropolis_01 metropolis_04 \\",
        "    --output drives --jobs 2",
    ),
    studying.reproduce: ("reproduce metropolis --output study",),
    studying.study: ("study ladder suburbia --quick --output ladder",),
    learning.train: ("train --output mine.npz --minutes 10",),
    import_city: (
        "import delft.city.jsonl \\",
        "    --years 1930 1970 2000 2020 --output delft",
    ),
    age: (
        "age suburbia \\",
        "    --years 1 5 20 --seed 1 --output old_suburbia",
    ),
    city: ("city town --new",),
}
# Commands whose names differ from the names of their functions.
_NAMES = {list_drives: "list", import_city: "import"}

app = program.make_program(
    "cns-drake",
    "Cities that change, driven and recorded by simulated LiDAR.",
    example("cns-drake simulate metropolis_01 --output drives"),
    groups={
        "Make cities": ("import", "age", "city"),
        "Drive through them": ("list", "simulate", "scan", "generate"),
        "Study what change costs": ("study", "reproduce", "train"),
        "Convert for other programs": ("export",),
    },
)
for _command, (_first, *_rest) in _EXAMPLES.items():
    app.command(
        _NAMES.get(_command),
        cls=Command,
        epilog=example(f"cns-drake {_first}", *_rest),
        # Years before today look like options.
        context_settings={"ignore_unknown_options": _command is age},
    )(_command)


def main() -> None:
    """Runs the command line."""
    program.run(app, "cns-drake", show_progress())


if __name__ == "__main__":
    main()
