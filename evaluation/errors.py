"""The error that a user can mend."""


class InputError(Exception):
    """Input that cannot be used; the message is one line for the user.

    The message names the file (or argument), the field where there is one,
    and the fault. The command line prints it and exits with status 2.
    """
