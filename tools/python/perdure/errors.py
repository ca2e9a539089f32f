"""Exceptions. The text of each is a sentence that contains the fix."""


class Error(Exception):
    """Base class of the errors below."""


class UnknownTopic(Error, ValueError):
    """The topic does not exist; the text lists the existing ones."""


class Refused(Error, ValueError):
    """A value that is invalid in a message: wrong kind or shape, or out of its bounds.

    The text begins with the field, for example ``detections[3].activations``.
    """


class Missing(Error, FileNotFoundError):
    """The file does not exist."""


class Unusable(Error, ValueError):
    """A file or configuration exists, but is invalid or of a newer version."""


class OtherVersion(Unusable):
    """Messages of another version of Perdure, which this version cannot read."""


class Unavailable(Error, OSError):
    """The bus cannot be opened, or a process or the disk does not respond."""


class Silence(Error, TimeoutError):
    """No message arrived within the given time."""
