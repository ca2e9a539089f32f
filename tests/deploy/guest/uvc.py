"""Descriptors and controls of a USB Video Class 1.0 camera: YUYV over a bulk endpoint, exposure
and gain."""
import struct

SIZES = [(320, 240), (160, 120)]
INTERVALS = [333333, 666666, 1000000]  # in units of 100 ns, shortest first
DEFAULT_INTERVAL = 1000000
PAYLOAD = 16384
YUY2 = bytes.fromhex('5955593200001000800000aa00389b71')
CAMERA, PROCESSING, OUT = 1, 2, 3
SET, GET_CUR, GET_MIN, GET_MAX, GET_RES, GET_LEN, GET_INFO, GET_DEF = 1, 0x81, 0x82, 0x83, 0x84, 0x85, 0x86, 0x87
PROBE, COMMIT = 1, 2


def descriptor(kind, *fields):
    body = b''.join(f if isinstance(f, bytes) else bytes([f]) for f in fields)
    return bytes([len(body) + 2, kind]) + body


def word(value):
    return struct.pack('<H', value)


def double_word(value):
    return struct.pack('<I', value)


def frame_descriptor(index, width, height):
    size = width * height * 2
    rates = [size * 8 * 10_000_000 // interval for interval in (max(INTERVALS), min(INTERVALS))]
    return descriptor(0x24, 5, index, 0, word(width), word(height), *map(double_word, rates), double_word(size),
                      double_word(DEFAULT_INTERVAL), len(INTERVALS), *map(double_word, INTERVALS))


def control_interface():
    units = (descriptor(0x24, 2, CAMERA, word(0x201), 0, 0, word(0), word(0), word(0), 3, 0x0a, 0, 0) +
             descriptor(0x24, 5, PROCESSING, CAMERA, word(0), 2, word(0x201), 0) +
             descriptor(0x24, 3, OUT, word(0x101), 0, PROCESSING, 0))
    return descriptor(0x24, 1, word(0x100), word(13 + len(units)), double_word(48_000_000), 1, 1) + units


def streaming_interface():
    formats = (descriptor(0x24, 4, 1, len(SIZES), YUY2, 16, 1, 0, 0, 0, 0) +
               b''.join(frame_descriptor(i + 1, *size) for i, size in enumerate(SIZES)))
    return descriptor(0x24, 1, 1, word(14 + len(formats)), 0x81, 0, OUT, 0, 0, 0, 1, 0) + formats


def configuration():
    body = (descriptor(11, 0, 2, 14, 3, 0, 2) + descriptor(4, 0, 0, 0, 14, 1, 0, 2) + control_interface() +
            descriptor(4, 1, 0, 1, 14, 2, 0, 2) + streaming_interface() + descriptor(5, 0x81, 2, word(512), 0))
    return descriptor(2, word(9 + len(body)), 2, 1, 0, 0x80, 50) + body


DEVICE = descriptor(1, word(0x200), 0xef, 2, 1, 64, word(0x1d6b), word(0x0102), word(0x100), 1, 2, 3, 1)
TEXTS = ['Perdure', 'Camera of the test', '1']


def text(index):
    return descriptor(3, word(0x409)) if index == 0 else descriptor(3, TEXTS[index - 1].encode('utf-16-le'))


class Control:
    def __init__(self, name, size, least, most, step, default):
        self.name, self.size = name, size
        self.least, self.most, self.step, self.default, self.value = least, most, step, default, default

    def get(self, request):
        values = {GET_CUR: self.value, GET_MIN: self.least, GET_MAX: self.most, GET_RES: self.step,
                  GET_DEF: self.default}
        if request == GET_INFO:
            return b'\3'
        if request == GET_LEN:
            return word(self.size)
        return values[request].to_bytes(self.size, 'little') if request in values else None


def controls():
    """Returns the controls by unit and selector."""
    return {(CAMERA, 2): Control('exposure_mode', 1, 1, 8, 9, 8),
            (CAMERA, 4): Control('exposure_100us', 4, 1, 5000, 1, 156),
            (PROCESSING, 2): Control('brightness', 2, 0, 255, 1, 128),
            (PROCESSING, 4): Control('gain', 2, 0, 100, 1, 16)}


def stream_settings(frame, interval):
    """Returns the camera's answer to a probe."""
    frame = frame if 1 <= frame <= len(SIZES) else 1
    width, height = SIZES[frame - 1]
    best = min(INTERVALS, key=lambda have: abs(have - interval)) if interval else DEFAULT_INTERVAL
    return struct.pack('<HBBIHHHHHII', 1, 1, frame, best, 0, 0, 0, 0, 0, width * height * 2, PAYLOAD)
