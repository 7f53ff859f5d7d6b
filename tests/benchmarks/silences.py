"""Prints the longest silences of a command on stderr.

A silence is measured by the processor time of the command's processes, since
other programs do not make it longer:

    python tests/benchmarks/silences.py cns-drake simulate riverside_01 \\
        --output /tmp/drives --overwrite --frames 20
"""

import subprocess
import sys
import time

import psutil

# Number of silences that are printed.
_SHOWN = 8


def cpu_time(process: psutil.Process) -> float:
    """Returns the processor time of a process and all below it [s]."""
    total = 0.0
    try:
        for one in [process, *process.children(recursive=True)]:
            # Children that have ended count with their parent.
            total += sum(one.cpu_times()[:4])
    except psutil.Error:
        pass
    return total


def main() -> int:
    """Runs the command of the arguments, and returns its exit status."""
    begin = time.monotonic()
    command = subprocess.Popen(
        sys.argv[1:], stderr=subprocess.PIPE, text=True, bufsize=1
    )
    process = psutil.Process(command.pid)
    assert command.stderr is not None
    before = (0.0, 0.0, "(start)")
    silences = []
    for line in command.stderr:
        now = time.monotonic() - begin, cpu_time(process), line.rstrip()
        silences.append((now[1] - before[1], now[0] - before[0], *before))
        before = now
        print(f"{now[0]:7.1f} s {now[1]:7.1f} cpu  {now[2]}", flush=True)
    status = command.wait()
    print(
        f"{len(silences)} lines; the longest silences [CPU s], [s], and when:"
    )
    for cpu, wall, since, _, text in sorted(silences, reverse=True)[:_SHOWN]:
        print(f"{cpu:7.2f} {wall:7.2f}  {since:7.1f} s  {text}")
    return status


if __name__ == "__main__":
    sys.exit(main())
