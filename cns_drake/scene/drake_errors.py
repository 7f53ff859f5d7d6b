"""Collects Drake's messages about files that it cannot read."""

from collections.abc import Iterator
import contextlib
import logging

# Besides Drake's own errors, these are errors of the C++ library, for invalid
# or too large numbers. A failed condition in Drake raises
# SystemExit.
PARSER_ERRORS = (
    RuntimeError,
    ValueError,
    LookupError,
    OverflowError,
    SystemExit,
)


@contextlib.contextmanager
def collected_errors() -> Iterator[list[str]]:
    """Context manager that collects the errors that Drake logs.

    The context variable is the list of error messages, which are not printed.
    Drake's warnings are printed at the end of the `with` block, except after an
    exception, because a command prints only one line for an error.
    """
    errors: list[str] = []
    records: list[logging.LogRecord] = []
    logger = logging.getLogger("drake")
    collector = _Collector(errors, records)
    propagate = logger.propagate
    logger.addHandler(collector)
    logger.propagate = False
    try:
        yield errors
    finally:
        logger.removeHandler(collector)
        logger.propagate = propagate
    for record in records:
        logger.handle(record)


class _Collector(logging.Handler):
    """Sorts records into the messages of errors, and all others."""

    def __init__(self, errors: list[str], others: list[logging.LogRecord]):
        super().__init__()
        self._errors = errors
        self._others = others

    def emit(self, record: logging.LogRecord) -> None:
        if record.levelno >= logging.ERROR:
            self._errors.append(record.getMessage())
        else:
            self._others.append(record)
