"""When interrupts strike, and how they end a process."""

import os
import signal

import pytest

from cns_drake.interrupts import interrupt_on_termination, uninterrupted


@pytest.fixture
def handlers():
    before = signal.getsignal(signal.SIGTERM)
    yield
    signal.signal(signal.SIGTERM, before)


def interrupt_and_go_on(number, done):
    with uninterrupted():
        os.kill(os.getpid(), number)
        done.append("all of it")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interrupts_wait(handlers, number):
    interrupt_on_termination()
    done = []
    with pytest.raises(KeyboardInterrupt):
        interrupt_and_go_on(number, done)
    assert done
    with pytest.raises(KeyboardInterrupt):
        os.kill(os.getpid(), number)


def test_interrupts_wait_for_the_outermost_block(handlers):
    done = []

    def interrupt_within():
        with uninterrupted():
            interrupt_and_go_on(signal.SIGINT, done)
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


def test_a_second_termination_does_not_interrupt_the_closing(handlers):
    interrupt_on_termination(once=True)
    with pytest.raises(KeyboardInterrupt):
        os.kill(os.getpid(), signal.SIGTERM)
    os.kill(os.getpid(), signal.SIGTERM)
