"""The error that a user can mend."""

# One error for both packages: the evaluation knows nothing of this one.
from evaluation.errors import InputError

__all__ = ["InputError", "describe_validation_error"]


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
