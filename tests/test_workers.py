import os

import pytest

from evaluation.errors import InputError
from evaluation.workers import Workers, num_cores


def with_process(number):
    return number, os.getpid()


def refuse(number):
    raise InputError(f"{number}: refused")


def die(number):
    os._exit(number)


def test_one_job_works_here():
    with Workers(1) as workers:
        done = workers.map(with_process, [(3,), (1,)], "")
    assert done == [(3, os.getpid()), (1, os.getpid())]


def test_processes():
    with Workers(2) as workers:
        done = workers.map(with_process, [(i,) for i in range(6)], "")
        assert [number for number, _ in done] == list(range(6))
        assert os.getpid() not in {process for _, process in done}
        with pytest.raises(InputError, match=r"^2: refused$"):
            workers.map(refuse, [(2,)], "")
        with pytest.raises(InputError, match="a process died"):
            workers.map(die, [(7,)], "")


@pytest.mark.parametrize("number", [0, -1])
def test_number_of_jobs_is_positive(number):
    with pytest.raises(InputError, match=f"--jobs: {number} is not"):
        Workers(number)


def test_there_is_a_core():
    assert num_cores() >= 1
