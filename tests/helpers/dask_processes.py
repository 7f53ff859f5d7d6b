"""A scheduler of Dask and its workers as processes, as on a cluster."""

import contextlib
import os
import subprocess
import sys
import threading

from distributed import Client
import psutil


class DaskProcesses:
    """A context manager: a scheduler, and workers started on demand.

    Attributes:
        address: of the scheduler.
        workers: the processes, one thread each, which are not restarted.
    """

    def __init__(self, folder, security=None, options=()):
        """Takes the settings of clients and those of the scheduler."""
        self._folder = folder
        self._security = security
        self._options = options
        self.workers = []

    def __enter__(self):
        self.scheduler = self._start(
            "dask_scheduler",
            "--port",
            "0",
            "--no-dashboard",
            *self._options,
            "--host",
            "tls://127.0.0.1" if self._options else "127.0.0.1",
        )
        for line in self.scheduler.stderr:
            if "Scheduler at:" in line:
                self.address = line.split()[-1]
                break
        # Output that is not read would stop the writing process.
        threading.Thread(target=self.scheduler.stderr.read, daemon=True).start()
        return self

    def __exit__(self, *error):
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()

    def add_workers(self, number):
        """Starts workers and waits until they have registered."""
        for _ in range(number):
            worker = self._start(
                "dask_worker",
                self.address,
                "--nthreads",
                "1",
                "--no-nanny",
                "--no-dashboard",
                "--memory-limit",
                "0",
                "--local-directory",
                self._folder,
                *self._options,
                quiet=True,
            )
            self.workers.append(worker)
        alive = sum(worker.poll() is None for worker in self.workers)
        with Client(
            self.address, set_as_default=False, security=self._security
        ) as client:
            client.wait_for_workers(alive, timeout=600)

    def job_processes(self):
        """Returns (worker, process of a job) for all that run."""
        found = []
        for worker in self.workers:
            with contextlib.suppress(psutil.NoSuchProcess):
                # A job is forked from a child of its worker.
                for child in psutil.Process(worker.pid).children():
                    found += [(worker, job) for job in child.children()]
        return found

    def _start(self, module, *arguments, quiet=False):
        # The workers import the functions of the tests as well.
        path = os.pathsep.join(sys.path)
        return subprocess.Popen(
            [sys.executable, "-m", f"distributed.cli.{module}", *arguments],
            env={**os.environ, "PYTHONPATH": path},
            cwd=self._folder,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL if quiet else subprocess.PIPE,
            text=True,
        )
