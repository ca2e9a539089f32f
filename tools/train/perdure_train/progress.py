"""Progress output: one updated line on a terminal, otherwise a line every half minute."""

import math
import sys
import time


class Progress:
    def __init__(self, what):
        self.what, self.started, self.last, self.first = what, time.time(), 0.0, None
        self.terminal = sys.stderr.isatty()

    def show(self, share, text=""):
        now = time.time()
        self.first = share if self.first is None else self.first
        if now - self.last < (0.2 if self.terminal else 30.0) and share < 1.0:
            return
        self.last = now
        done = int(30 * min(share, 1.0))
        gained = share - self.first
        left = (now - self.started) * (1 - share) / gained if gained > 0.002 else math.nan
        bar = "#" * done + "." * (30 - done)
        line = f"{self.what} [{bar}] {100 * share:5.1f} %  {text}  {left / 60:.0f} min left".replace("nan min left", "")
        end = "\n" if not self.terminal or share >= 1.0 else ""
        start = "\r\033[K" if self.terminal else ""
        sys.stderr.write(start + line + end)
        sys.stderr.flush()
