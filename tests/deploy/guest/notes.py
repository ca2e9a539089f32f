"""Reads the files that a guest left in its folder."""
import re
import statistics

MS = 1_000_000
SECOND = 1000 * MS
FOREVER = 1 << 62
NOT_CAPTURE = ('v4l_id', 'v4l2-ctl', '(udev-worker)')  # other programs that open a video node


class Frame:
    def __init__(self, words):
        self.source, self.sequence, self.stamp, self.given, self.number, self.heard = map(int, words)


class Sample:
    def __init__(self, words):
        self.source, self.sequence, self.stamp, self.heard = map(int, words[:4])
        self.gyro, self.accel = [float(w) for w in words[4:7]], [float(w) for w in words[7:]]


class Health:
    def __init__(self, line):
        head, self.message = line.split('|', 1)
        words = head.split()
        self.process = words[0]
        self.state, self.frames_in, self.frames_out, self.dropped, self.heard = map(int, words[1:6])
        self.reasons = {k: int(v) for k, v in (w.split('=') for w in words[6:])}

    def count(self, *reasons):
        return sum(self.reasons.get(r, 0) for r in reasons)


class Run:
    """Times in nanoseconds of the guest's CLOCK_MONOTONIC. Stamps use the wall clock of
    capture's start."""

    def __init__(self, folder):
        self.folder = folder
        self.camera_log = (folder / 'camera.log').read_text()
        self.frames, self.samples, self.odometry, self.health, self.clocks = [], [], [], [], []
        for line in self.read('notes').splitlines():
            kind, _, rest = line.partition(' ')
            words = rest.split()
            try:
                if kind == 'frame':
                    self.frames.append(Frame(words))
                elif kind == 'imu':
                    self.samples.append(Sample(words))
                elif kind == 'odometry':
                    self.odometry.append([int(w) for w in words])
                elif kind == 'health':
                    self.health.append(Health(rest))
                elif kind == 'clocks':
                    self.clocks.append([int(w) for w in words])
            except ValueError:
                continue  # the last line may be incomplete
        self.marks = {}
        for line in self.read('marks').splitlines():
            name, at = line.split()
            self.marks[name] = int(float(at) * SECOND)
        self.end = self.marks.get('end', self.clocks[-1][0] if self.clocks else 0)
        self.wall = int(statistics.median(ahead for _, ahead in self.clocks)) if self.clocks else 0
        self.plugs, self.unplugs, self.triggers, self.opened, self.streamed = [], [], [], [], []
        self.read_trace()
        self.image_stamps = self.stamps_of_the_kernel()
        self.kernel_added, self.kernel_removed, self.udev_added, self.udev_removed = [], [], [], []
        self.read_udev()
        self.nodes = len(re.findall(r'/dev/(?:video|media)\d+$', self.read('facts'), re.M))

    def read_trace(self):
        of_event = {'plugged': self.plugs, 'unplugged': self.unplugs, 'triggered': self.triggers, 'opened': self.opened,
                    'streamed': self.streamed}
        for line in self.read('trace').splitlines():
            found = re.match(r'\s*(.*)-\d+\s.*\s(\d+)\.(\d{6}): (\w+): ', line)
            if found and found[4] in of_event and not (found[4] == 'opened' and found[1] in NOT_CAPTURE):
                of_event[found[4]].append(int(found[2]) * SECOND + int(found[3]) * 1000)

    def read_udev(self):
        """Reads when the kernel made or removed a node, and when udev reported it to listeners
        such as libcamera; the permissions are set by then. For removals only the media device
        counts, because libcamera listens to it."""
        for line in self.read('udev_events').splitlines():
            found = re.match(r'(KERNEL|UDEV) *\[(\d+)\.(\d{6})\] (add|remove) .*\((media|video4linux)\)', line)
            if not found or (found[4] == 'remove' and found[5] != 'media'):
                continue
            events = {'KERNEL add': self.kernel_added, 'KERNEL remove': self.kernel_removed, 'UDEV add': self.udev_added,
                      'UDEV remove': self.udev_removed}[f'{found[1]} {found[4]}']
            events.append(int(found[2]) * SECOND + int(found[3]) * 1000)

    def read(self, name):
        path = self.folder / 'share' / name
        return path.read_text(errors='replace') if path.exists() else ''

    def stamps_of_the_kernel(self):
        """Stamps of v4l2_dqbuf. `timestamp` is in microseconds or nanoseconds; the kernel does
        not state the unit."""
        return [int(t) for t in re.findall(r'v4l2_dqbuf: .*?timestamp = (\d+)', self.read('trace'))]

    def between(self, things, start, end, at=lambda t: t.heard):
        return [t for t in things if self.marks.get(start, 0) <= at(t) <= self.marks.get(end, FOREVER)]

    def health_of(self, process, start='booted', end='done'):
        return [h for h in self.between(self.health, start, end) if h.process == process]

    def sent_before(self, command):
        """Returns the number of images that the camera had sent at the first command of this
        kind."""
        found = re.search(rf'^told {command}.*\nsent (\d+)$', self.camera_log, re.M)
        return int(found[1]) if found else None
