"""Jobs on a real scheduler and its workers, which are killed."""

import os
import shutil
import signal
import subprocess
import sys

from distributed import Security
from helpers import job_functions
from helpers.bag_recordings import contents
from helpers.dask_processes import DaskProcesses
from helpers.generation import Generation
from helpers.tiny_drive import long_scenario, tiny_scenario, write_scenario
import psutil
import pytest

from cns_drake.simulation import simulate
from evaluation.base import Cluster, InputError, Job, run_jobs

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def dask(tmp_path_factory):
    with DaskProcesses(tmp_path_factory.mktemp("dask")) as processes:
        yield processes


@pytest.fixture(scope="module")
def scenarios(tmp_path_factory):
    folder = tmp_path_factory.mktemp("scenarios")
    return [
        long_scenario(folder, "first"),
        long_scenario(folder, "second"),
        # The drive is shorter.
        tiny_scenario(folder, name="endless", frames=10**6),
        tiny_scenario(folder, name="short", frames=3),
    ]


@pytest.fixture(scope="module")
def files(scenarios, tmp_path_factory):
    folder = tmp_path_factory.mktemp("files")
    return [write_scenario(scenario, folder) for scenario in scenarios]


@pytest.mark.night
def test_a_worker_that_is_killed_costs_nothing(
    dask, scenarios, files, tmp_path
):
    dask.add_workers(2)
    output = tmp_path / "output"
    run = Generation(files[:2], output, "--scheduler", dask.address)
    run.wait_for("first simulating")
    worker, job = dask.job_processes()[0]
    worker.send_signal(signal.SIGKILL)
    status, results = run.end()
    assert status == 0, run.lines
    assert results == [str(output / "first"), str(output / "second")]
    for scenario in scenarios[:2]:
        folder = simulate(scenario, tmp_path / "whole").folder
        assert contents(output / scenario.name) == contents(folder)
    # The killed worker's job has ended before its successor begins.
    assert psutil.wait_procs([job], timeout=600)[1] == []
    assert {path.name for path in output.iterdir()} == {"first", "second"}


def test_a_job_that_cannot_be_done_and_the_address_in_the_environment(
    dask, files, tmp_path
):
    dask.add_workers(1)
    output = tmp_path / "output"
    run = Generation(files[2:], output, DASK_SCHEDULER_ADDRESS=dask.address)
    status, results = run.end()
    assert (status, results) == (1, []), run.lines
    assert run.lines[-1].startswith("cns-drake: error: endless: ")
    assert "frames: 1000000 is too many" in run.lines[-1]
    assert not [line for line in run.lines if "Traceback" in line]
    assert (output / "short" / "metadata.yaml").is_file()


def start_to_hold(dask, folder):
    """Starts a client whose job never ends; returns the two processes."""
    dask.add_workers(1)
    pipe = folder / "pipe"
    os.mkfifo(pipe)
    script = (
        "import sys\n"
        "from pathlib import Path\n"
        "from helpers import job_functions\n"
        "from evaluation.base import Cluster, Job, run_jobs\n"
        "address, pipe = sys.argv[1:]\n"
        "step = job_functions.Call(job_functions.hold, (Path(pipe),))\n"
        "run_jobs([Job('holds', step)], Cluster(scheduler=address))\n"
    )
    client = subprocess.Popen(
        [sys.executable, "-c", script, dask.address, pipe],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        stderr=subprocess.PIPE,
        text=True,
    )
    return client, psutil.Process(job_functions.read_holder(pipe))


@pytest.mark.parametrize(
    "number",
    [signal.SIGKILL, pytest.param(signal.SIGINT, marks=pytest.mark.night)],
)
def test_jobs_end_with_the_client_that_wanted_them(dask, tmp_path, number):
    client, job = start_to_hold(dask, tmp_path)
    client.send_signal(number)
    client.communicate()
    assert psutil.wait_procs([job], timeout=600)[1] == []


@pytest.mark.night
def test_jobs_end_with_their_scheduler(tmp_path):
    with DaskProcesses(tmp_path) as dask:
        client, job = start_to_hold(dask, tmp_path)
        dask.scheduler.kill()
        _, errors = client.communicate()
        assert "InputError: the connection to the scheduler was lost" in errors
        assert psutil.wait_procs([job], timeout=600)[1] == []


@pytest.mark.night
def test_a_worker_that_dies_each_time_is_a_fault(dask, tmp_path, capsys):
    # The scheduler tries three more times, and needs a worker for each.
    dask.add_workers(4)
    tries = tmp_path / "tries"
    step = job_functions.Call(job_functions.kill_worker, (tries,))
    job = Job("murder", step)
    with pytest.raises(InputError, match="murder: every worker that ran it"):
        run_jobs([job], Cluster(scheduler=dask.address))
    assert tries.read_text() == "xxxx"
    told = "job murder: its worker died; it is repeated"
    assert capsys.readouterr().err.splitlines() == [told] * 3


@pytest.fixture(scope="module")
def certificates(tmp_path_factory):
    """Options of TLS -> files, signed by an authority for this test."""
    folder = tmp_path_factory.mktemp("certificates")

    def openssl(*words):
        subprocess.run(
            ["openssl", *words], cwd=folder, check=True, capture_output=True
        )

    new = ("req", "-newkey", "rsa:2048", "-nodes", "-subj")
    openssl(*new, "/CN=test", "-x509", "-keyout", "ca.key", "-out", "ca.pem")
    openssl(*new, "/CN=me", "-keyout", "me.key", "-out", "me.csr")
    openssl(
        "x509",
        "-req",
        "-in",
        "me.csr",
        "-CA",
        "ca.pem",
        "-CAkey",
        "ca.key",
        "-CAcreateserial",
        "-out",
        "me.pem",
    )
    files = {"ca-file": "ca.pem", "cert": "me.pem", "key": "me.key"}
    return {name: str(folder / file) for name, file in files.items()}


@pytest.mark.skipif(shutil.which("openssl") is None, reason="no openssl")
@pytest.mark.night
def test_a_scheduler_that_asks_for_certificates(certificates, tmp_path):
    """A command's environment names the certificates as Dask's settings do."""
    ca_file, cert, key = (certificates[k] for k in ("ca-file", "cert", "key"))
    security = Security(
        tls_ca_file=ca_file,
        tls_client_cert=cert,
        tls_client_key=key,
        require_encryption=True,
    )
    options = [f"--tls-{k}={path}" for k, path in certificates.items()]
    prefix = "DASK_DISTRIBUTED__COMM__TLS__"
    variables = {
        f"{prefix}CA_FILE": ca_file,
        f"{prefix}CLIENT__CERT": cert,
        f"{prefix}CLIENT__KEY": key,
    }
    with DaskProcesses(tmp_path, security, options) as processes:
        assert processes.address.startswith("tls://")
        processes.add_workers(1)
        script = (
            "import sys\n"
            "from pathlib import Path\n"
            "from helpers import job_functions\n"
            "from evaluation.base import Cluster, Job, run_jobs\n"
            "address, path = sys.argv[1:]\n"
            "step = job_functions.Call(job_functions.join, ([], Path(path)))\n"
            "run_jobs([Job('a', step)], Cluster(scheduler=address))\n"
        )
        for environment, done in ((variables, True), ({}, False)):
            path = tmp_path / f"result_{done}"
            result = subprocess.run(
                [sys.executable, "-c", script, processes.address, path],
                env={
                    **os.environ,
                    **environment,
                    "PYTHONPATH": os.pathsep.join(sys.path),
                },
                check=False,
                capture_output=True,
                text=True,
            )
            assert path.is_file() == done, result.stderr
        assert "--scheduler: tls://" in result.stderr
