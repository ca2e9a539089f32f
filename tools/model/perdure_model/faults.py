"""Error that ends an import: a sentence with the fix, and the exit status (64 wrong usage, 65
unusable data, 69 missing file, 74 not written, 78 wrong content)."""

import errno

USAGE, DATA, UNAVAILABLE, INPUT_OUTPUT, CONFIGURATION = 64, 65, 69, 74, 78


class Fault(Exception):
    def __init__(self, message, status=CONFIGURATION):
        super().__init__(message)
        self.status = status


def unwritten(name, error):
    """Returns the Fault for an OSError. An error without a number comes from numpy after an
    incomplete write."""
    why = error.strerror or "not all of it could be written"
    if error.errno in (None, errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO):
        return Fault(f"{name} cannot be written whole ({why}); free space, or give a folder on another disk",
                     INPUT_OUTPUT)
    return Fault(f"{name} cannot be written ({why}); give --out DIR", UNAVAILABLE)
