"""The error that a user can mend."""

_LONGEST = 2000


class InputError(Exception):
    """Input that cannot be used; the message is one line for the user.

    The message names the file (or argument), the field where there is one,
    and the fault. The command line prints it and exits with status 2.

    Attributes:
        exit_status: of a command that ends with it.
    """

    exit_status = 2

    def __init__(self, message: object):
        """Takes what to tell; see `one_line`."""
        super().__init__(one_line(message))


class FailedJobsError(InputError):
    """Some jobs of many could not be done; the message names them all.

    As everything else was done, the exit status is another one.
    """

    exit_status = 1


def one_line(message: object) -> str:
    """Returns a message as one printable line of bounded length.

    What it quotes of a file may hold anything: line breaks, and what steers
    a terminal.
    """
    text = "".join(c if c.isprintable() else " " for c in str(message))
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]} ..."
