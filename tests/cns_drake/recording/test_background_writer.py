"""The thread keeps the order, and its errors reach the caller."""

import threading

import pytest

from cns_drake.recording import BackgroundWriter


def feed(write, count):
    """Hands over the numbers up to `count`; returns the number accepted."""
    taken = 0
    try:
        with BackgroundWriter(write) as writer:
            for k in range(count):
                writer.write(k)
                taken = k + 1
    except OSError:
        pass
    return taken


def test_everything_is_written_in_order_and_elsewhere():
    written = []
    threads = set()

    def write(*message):
        written.append(message)
        threads.add(threading.current_thread())

    with BackgroundWriter(write) as writer:
        for k in range(500):
            writer.write("topic", k)
    assert written == [("topic", k) for k in range(500)]
    assert threading.current_thread() not in threads


def test_few_messages_wait():
    handed = 0
    lags = []

    def write(k):
        lags.append(handed - k)

    with BackgroundWriter(write) as writer:
        for k in range(3000):
            writer.write(k)
            handed = k + 1
    assert max(lags) <= 10


def test_small_messages_go_with_the_next_large_one():
    written = []
    has_large = threading.Event()

    def write(data):
        written.append(data)
        if len(data) > 1000:
            has_large.set()

    small = [bytes([k]) for k in range(70)]
    with BackgroundWriter(write) as writer:
        # As many numbers are handed over without waiting.
        for data in small:
            writer.write(data)
        writer.write(bytes(5000))
        writer.write(b"last")
        assert has_large.wait(10.0)
    assert written == [*small, bytes(5000), b"last"]


def test_an_error_is_raised_at_the_latest_on_leaving():
    def write(k):
        raise OSError(f"disk full at {k}")

    with (
        pytest.raises(OSError, match="disk full at 0"),
        BackgroundWriter(write) as writer,
    ):
        writer.write(0)


def test_after_an_error_nothing_more_is_written_or_taken():
    written = []

    def write(k):
        if k == 3:
            raise OSError("disk full")
        written.append(k)

    taken = feed(write, 1_000_000)
    assert written == [0, 1, 2]
    # A few were queued when the error occurred.
    assert 3 <= taken < 1_000_000


def test_an_error_outside_ends_the_thread():
    threads = threading.active_count()
    written = []

    def fail():
        with BackgroundWriter(written.append) as writer:
            writer.write(0)
            raise KeyError

    with pytest.raises(KeyError):
        fail()
    assert threading.active_count() == threads
    assert written in ([], [0])
