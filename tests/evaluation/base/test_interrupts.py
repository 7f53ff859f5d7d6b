"""Interrupts at different moments, and how they end a process."""

import os
import signal
import threading

from helpers.internal.signal_handlers import handlers_kept
import pytest

from evaluation.base import interrupts_wait, uninterrupted


@pytest.fixture
def handlers():
    with handlers_kept():
        yield


def test_interrupts_wait_for_the_outermost_block(handlers):
    done = []

    def interrupt_within():
        with uninterrupted():
            with uninterrupted():
                os.kill(os.getpid(), signal.SIGINT)
                done.append("all of it")
            done.append("the rest")

    with pytest.raises(KeyboardInterrupt):
        interrupt_within()
    assert len(done) == 2


def test_an_exception_gives_way_to_the_interrupt(handlers):
    def interrupt_and_fail():
        with uninterrupted():
            os.kill(os.getpid(), signal.SIGINT)
            raise ImportError

    with pytest.raises(KeyboardInterrupt):
        interrupt_and_fail()


def test_a_second_interrupt_strikes_at_once_and_a_third_does_not(handlers):
    done = []

    def work():
        with interrupts_wait() as strike:
            os.kill(os.getpid(), signal.SIGINT)
            done.append("goes on")
            try:
                os.kill(os.getpid(), signal.SIGINT)
                done.append("never")
            finally:
                os.kill(os.getpid(), signal.SIGINT)
                strike()
                done.append("closes")

    with pytest.raises(KeyboardInterrupt):
        work()
    assert done == ["goes on", "closes"]


def test_an_interrupt_that_found_no_place_strikes_at_the_end(handlers):
    done = []

    def work():
        with interrupts_wait():
            os.kill(os.getpid(), signal.SIGINT)
            done.append("all of it")

    with pytest.raises(KeyboardInterrupt):
        work()
    assert done


def test_ignored_signals_stay_ignored(handlers):
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    with interrupts_wait() as strike:
        os.kill(os.getpid(), signal.SIGTERM)
        strike()
    assert signal.getsignal(signal.SIGTERM) == signal.SIG_IGN


def test_other_threads_have_no_signals_to_wait_for():
    done = []

    def work():
        with interrupts_wait() as strike:
            strike()
            done.append("all of it")

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert done
