"""What goes wrong. Each exception's text is a sentence that says the mend."""


class Error(Exception):
    """Anything that Perdure refuses; the classes below are kinds of it."""


class UnknownTopic(Error, ValueError):
    """There is no such topic; the text lists those that there are."""


class Refused(Error, ValueError):
    """A value that no message may hold: wrong kind or shape, or out of its bounds.

    The text begins with the field, as ``detections[3].activations``.
    """


class Missing(Error, FileNotFoundError):
    """There is no such file."""


class Unusable(Error, ValueError):
    """A file or configuration is there, but is not what it has to be, or is of a newer version."""


class OtherVersion(Unusable):
    """Messages of another version of Perdure, which this one cannot read."""


class Unavailable(Error, OSError):
    """The bus cannot be opened, or something on it or on the disk does not answer."""


class Silence(Error, TimeoutError):
    """Nothing came within the time that was given."""
