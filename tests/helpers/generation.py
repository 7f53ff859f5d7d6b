"""`cns-drake generate` as a process that tests watch and kill."""

import os
import subprocess
import sys

import pytest

# The program, with the names of all that its jobs do.
_PROGRAM = """
import sys
from evaluation.base import program
from evaluation.base.progress import JobsListener, Listener, heard_by
from cns_drake.command_line.cli import app

class Printing(Listener, JobsListener):
    def jobs(self, *args):
        return self

    def doing(self, name, activity="", *args):
        print(name, activity, file=sys.stderr, flush=True)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        pass

program.run(app, "cns-drake", heard_by(Printing()))
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
