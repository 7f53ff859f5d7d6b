"""Errors of a user: what a command adds to the message of a function."""

import pytest

from evaluation.base import InputError, errors_at_option


@pytest.mark.parametrize(
    ("message", "shown"),
    [
        ("name: no method 'x'", "--method: no method 'x'"),
        ("solid: name: missing", "solid: name: missing"),
        ("name", "name"),
    ],
)
def test_a_message_that_begins_with_the_argument_names_the_option(
    message, shown
):
    with (
        pytest.raises(InputError) as caught,
        errors_at_option("--method", "name"),
    ):
        raise InputError(message)
    assert str(caught.value) == shown
