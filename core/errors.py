"""The one exception a person is meant to read."""


class UserError(Exception):
    """Something that could not be done; ``str(error)`` is one clear sentence that says what and what to do."""
