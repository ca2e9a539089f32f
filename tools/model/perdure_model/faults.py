"""What ends an import: a sentence with the mend, and the exit status (64 usage, 69 missing, 78 wrong)."""

USAGE, UNAVAILABLE, CONFIGURATION = 64, 69, 78


class Fault(Exception):
    def __init__(self, message, status=CONFIGURATION):
        super().__init__(message)
        self.status = status
