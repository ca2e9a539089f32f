"""A line that rewrites itself on a terminal; elsewhere a line every half minute."""

import sys
import time


class Progress:
    def __init__(self, what):
        self.what, self.started, self.last = what, time.time(), 0.0
        self.terminal = sys.stderr.isatty()

    def show(self, share, text=""):
        now = time.time()
        if now - self.last < (0.2 if self.terminal else 30.0) and share < 1.0:
            return
        self.last = now
        done = int(30 * min(share, 1.0))
        left = (now - self.started) * (1 - share) / max(share, 1e-6) if share > 0.002 else 0.0
        bar = "#" * done + "." * (30 - done)
        line = f"{self.what} [{bar}] {100 * share:5.1f} %  {text}  {left / 60:.0f} min left"
        end = "\n" if not self.terminal or share >= 1.0 else ""
        start = "\r\033[K" if self.terminal else ""
        sys.stderr.write(start + line + end)
        sys.stderr.flush()
