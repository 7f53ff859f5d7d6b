"""`cns-drake generate` as a process that tests watch and kill."""

import os
import subprocess
import sys

import pytest

# A log that says at once what is done.
_PROGRAM = """
from cns_drake.base import progress_display
progress_display._INTERVAL = 0.0
from cns_drake.__main__ import main
main()
"""


class Generation:
    """A run of the command line, in a group of processes of its own."""

    def __init__(self, files, output, *options, **environment):
        command = [sys.executable, "-c", _PROGRAM, "generate", *files]
        self.process = subprocess.Popen(
            [*command, "--output", output, *options],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            env={**os.environ, **environment},
        )
        self.lines = []

    def wait_for(self, text):
        """Reads until a line contains a text."""
        for line in self.process.stderr:
            self.lines.append(line)
            if text in line:
                return
        pytest.fail("".join(self.lines))

    def end(self):
        """Returns exit status and results once every process has ended.

        All have the same stderr: it ends when the last of them does.
        """
        self.lines.extend(self.process.stderr)
        results = self.process.stdout.read().splitlines()
        return self.process.wait(), results
