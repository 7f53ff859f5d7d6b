"""Schedulers that do not answer within half a second, instead of ten."""

import socket

import pytest

from evaluation.base import Cluster, InputError, choose_cluster
from evaluation.base.jobs import running

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    "address",
    [
        "tcp://127.0.0.1:1", "nonsense://here", "nonsense", "tls://127.0.0.1:1",
        None,
    ],
)  # fmt: skip
def test_a_scheduler_that_does_not_answer(monkeypatch, address):
    monkeypatch.setattr(running, "_ANSWER_TIMEOUT", 0.5)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        address = address or f"tcp://127.0.0.1:{silent.getsockname()[1]}"
        with (
            pytest.raises(
                InputError, match=f"^--scheduler: {address}: no answer"
            ),
            Cluster(scheduler=address).connect(print),
        ):
            pass
        monkeypatch.setenv("DASK_SCHEDULER_ADDRESS", address)
        with (
            pytest.raises(InputError, match=r"^DASK_SCHEDULER_ADDRESS: "),
            choose_cluster(None, None).connect(print),
        ):
            pass
