"""Reading that takes more than the file should is one line, and is undone."""

import contextlib
import resource
import signal
import sys
import threading

import numpy as np
import pytest

from evaluation.base import InputError, not_counted, reading

needs_linux = pytest.mark.skipif(
    sys.platform != "linux", reason="only Linux limits memory"
)


@pytest.fixture
def small(monkeypatch):
    """A thousandth of the budget: 500 kB and 30 ms."""
    monkeypatch.setenv("CNS_READING_BUDGET", "0.001")


@pytest.fixture
def state():
    """Checks that the process is as before."""

    def found():
        kinds = (resource.RLIMIT_DATA, resource.RLIMIT_CPU)
        limits = [resource.getrlimit(kind) for kind in kinds]
        handler = signal.getsignal(signal.SIGPROF)
        return limits, handler, signal.getitimer(signal.ITIMER_PROF)

    before = found()
    yield
    assert found() == before


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "a.txt"
    path.write_bytes(b"12345")
    return path


def spend():
    """Uses the processor, like a parser that goes on after any error."""
    number = 0
    while True:
        with contextlib.suppress(Exception):
            number += 1


@needs_linux
@pytest.mark.usefixtures("state")
def test_memory_is_limited_by_the_size_of_the_file(file):
    with reading(file):
        np.empty(1 << 28, np.uint8)
        with pytest.raises(MemoryError):
            np.empty(1 << 30, np.uint8)
    fault = f"^{file}: takes more memory"
    with pytest.raises(InputError, match=fault), reading(file):
        np.empty(1 << 30, np.uint8)
    file.write_bytes(bytes(8_000_000))
    with reading(file):
        np.empty(1 << 30, np.uint8)
        with reading(file), pytest.raises(MemoryError):  # Counted once.
            np.empty(1 << 31, np.uint8)
    np.empty(1 << 31, np.uint8)


@needs_linux
def test_what_a_file_with_holes_has_is_its_size(file):
    with file.open("r+b") as stream:
        stream.truncate(1 << 34)
    fault = "takes more memory"
    with pytest.raises(InputError, match=fault), reading(file):
        file.read_bytes()


@pytest.mark.usefixtures("small", "state")
def test_time_is_limited(file):
    fault = f"^{file}: takes more processor time"
    with pytest.raises(InputError, match=fault), reading(file):
        spend()


@pytest.mark.usefixtures("small", "state")
def test_the_file_that_is_read_is_named(file):
    other = file.with_name("other")
    fault = f"^{other}: takes more processor"
    with pytest.raises(InputError, match=fault), reading(file), reading(other):
        spend()


@pytest.mark.usefixtures("small", "state")
def test_what_is_not_counted_takes_any_time_and_memory(file):
    kept = []
    with reading(file):
        with not_counted():
            total = sum(range(10_000_000))
            kept.append(np.ones(1 << 24, np.uint8))
        assert total > 0


@pytest.mark.usefixtures("small", "state")
def test_other_threads_have_no_limit_of_their_own(file):
    done = []

    def work():
        with reading(file):
            np.empty(1 << 30, np.uint8)
            done.append(sum(range(10_000_000)))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert len(done) == 1


@pytest.mark.usefixtures("state")
@pytest.mark.parametrize("text", ["0", "-1", "nan", "inf", "much"])
def test_a_factor_that_is_no_positive_number(monkeypatch, file, text):
    monkeypatch.setenv("CNS_READING_BUDGET", text)
    fault = "CNS_READING_BUDGET: "
    with pytest.raises(InputError, match=fault), reading(file):
        pass


@pytest.mark.usefixtures("state")
def test_errors_of_the_reader_stay(file):
    with pytest.raises(KeyError), reading(file):
        raise KeyError
    with pytest.raises(InputError, match="of the reader"), reading(file):
        raise InputError("of the reader")
