"""Measures the steps from a plug to the next image on the bus, and capture's share of them."""
import statistics

from notes import SECOND

LIMIT = 3 * SECOND


class Comeback:
    """The end of each step after one plug; None if the next unplug came first."""

    def __init__(self, run, plug, following):
        def first(times, after):
            return next((t for t in times if after is not None and after <= t < self.until), None)
        self.plug, self.until, self.unplugged_again = plug, following or run.end, following is not None
        def all_nodes(times):
            of = [t for t in times if plug <= t < self.until]
            return of[-1] if len(of) == run.nodes else None
        # The first image after a plug is published after all reports of udev about the nodes.
        image = next((f for f in run.frames if plug <= f.stamp - run.wall and f.heard < self.until), None)
        self.made, self.told = all_nodes(run.kernel_added), all_nodes(run.udev_added)
        self.opened = first(run.opened, self.told)
        self.streams = first(run.streamed, plug)
        self.taken, self.heard = (image.stamp - run.wall, image.heard) if image else (None, None)

    def own(self):
        """Returns the time from udev's report to the bus, or the time without success; None if
        the plug cannot be judged."""
        if self.told is None:
            return None
        if self.heard is not None:
            return self.heard - self.told
        vain = self.until - self.told
        return vain if vain > LIMIT or not self.unplugged_again else None


STEPS = [('plug → the kernel has made all nodes', 'plug', 'made'),
         ('kernel → udev has told of all nodes', 'made', 'told'),
         ('udev → capture opens a node', 'told', 'opened'),
         ('opens → the stream starts', 'opened', 'streams'),
         ('stream → the driver has an image', 'streams', 'taken'),
         ('image → heard on the bus', 'taken', 'heard'),
         ("udev → heard: capture's own", 'told', 'heard'),
         ('plug → heard: all of it', 'plug', 'heard')]


def comebacks(run):
    begin, end = run.marks.get('all_counted', 0), run.end
    plugs = [p for p in run.plugs if begin <= p < end]
    return [Comeback(run, plug, min((u for u in run.unplugs if plug < u < end), default=None)) for plug in plugs]


def row(name, spans):
    if not spans:
        return f'{name:38} none'
    spans = sorted(s / SECOND for s in spans)
    figures = [spans[0], statistics.median(spans), spans[int(.95 * (len(spans) - 1))], spans[-1]]
    return f'{name:38} {len(spans):4} ' + ' '.join(f'{figure:7.2f}' for figure in figures)


def table(run, of):
    """Returns one line for each step: the count, and least, median, 95 % and largest time in s."""
    lines = [f'{"step":38} {"n":>4} ' + ' '.join(f'{head:>7}' for head in ('least', 'middle', '95 %', 'most'))]
    removed = [t for t in run.kernel_removed if run.marks.get('all_counted', 0) <= t < run.end]
    lines.append(row('unplug → the kernel removes the nodes', [t - max(u for u in run.unplugs if u <= t) for t in removed]))
    lines.append(row('kernel → udev has told of that', [told - t for t, told in zip(run.kernel_removed, run.udev_removed) if t in removed]))
    for name, begin, end in STEPS:
        pairs = [(getattr(c, begin), getattr(c, end)) for c in of]
        lines.append(row(name, [b - a for a, b in pairs if a is not None and b is not None]))
    return lines
