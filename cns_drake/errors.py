"""The error that a user can mend."""

from evaluation.errors import one_line


class InputError(Exception):
    """Input that cannot be used; the message is one line for the user.

    The message names the file (or argument), the field where there is one,
    and the fault. The command line prints it and exits with status 2.
    """

    def __init__(self, message: object):
        """Takes what to tell."""
        super().__init__(one_line(message))


def describe_validation_error(source, error) -> str:
    """Returns one line for the first fault that pydantic found.

    Args:
        source: the file or object that was validated.
        error: a `pydantic.ValidationError`.
    """
    fault = error.errors()[0]
    field = ".".join(str(part) for part in fault["loc"]) or "(top level)"
    # pydantic puts this before what our own validators say.
    message = fault["msg"].removeprefix("Value error, ")
    more = error.error_count() - 1
    tail = f" (and {more} more)" if more else ""
    return f"{source}: {field}: {message}{tail}"
