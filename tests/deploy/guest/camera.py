#!/usr/bin/env python3
"""A UVC camera for QEMU's usb-redir. usage: camera.py SOCKET COMMANDS

It shows a fixed scene. Each frame contains its number, which continues over all plugs: 32 squares
in the first rows, lowest bit first. Other programs write one command into the file COMMANDS; the
camera removes the file:
  unplug SECONDS | truncate FRAMES (sends half of each) | silent SECONDS
It prints one line for each action: `told COMMAND`, `sent N` (the last number so far), `started N`,
`set CONTROL VALUE`."""
import os
import random
import socket
import struct
import sys
import time

import uvc
from usb_redirect import RedirectedDevice

SQUARE = 8


def scene(width, height):
    """Grey rectangles, the same in each run: they have corners that vio can track."""
    dice = random.Random(7)
    grey = [[128] * width for _ in range(height)]
    for _ in range(400):
        x, y, shade = dice.randrange(width), dice.randrange(height), dice.randrange(256)
        w, h = dice.randrange(5, 40), dice.randrange(5, 40)
        for row in grey[y:y + h]:
            row[x:x + w] = [shade] * len(row[x:x + w])
    return b''.join(bytes((value, 128)) for row in grey for value in row)  # YUYV without colour


def numbered(picture, width, number):
    bits = [number >> i & 1 for i in range(width // SQUARE if width < 32 * SQUARE else 32)]
    row = b''.join(bytes((224 if bit else 32, 128)) * SQUARE for bit in bits)
    image = bytearray(picture)
    for y in range(SQUARE):
        image[2 * width * y:2 * width * y + len(row)] = row
    return bytes(image)


class Camera(RedirectedDevice):
    identity = (0xef, 2, 1, 0x1d6b, 0x0102)
    interfaces = [(0, 14, 1, 0), (1, 14, 2, 0)]
    bulk_in = (0x81, 1, 512)
    pictures = {size: scene(*size) for size in uvc.SIZES}
    sent = 0  # the number of the last frame; it continues after a new plug

    def __init__(self, connection):
        super().__init__(connection)
        self.controls = uvc.controls()
        self.probe = self.committed = uvc.stream_settings(1, 0)
        self.pending, self.toggle, self.truncate = [], 0, 0
        self.streaming = False
        self.next = self.silent_until = 0.0

    def control(self, kind, request, value, index, data):
        if kind == 0x80 and request == 6:
            return {1: uvc.DEVICE, 2: uvc.configuration()}.get(value >> 8) or (
                uvc.text(value & 255) if value >> 8 == 3 and value & 255 <= len(uvc.TEXTS) else None)
        if kind == 0x80 and request == 0:
            return b'\0\0'
        if kind == 2 and request == 1:  # the endpoint is cleared: a stream ends or is about to begin
            self.stop()
        if kind in (0, 1, 2):
            return b''
        if kind & 0x7f != 0x21:
            return None
        if index & 255 == 1:
            return self.stream_control(request, value >> 8, data)
        known = self.controls.get((index >> 8, value >> 8))
        if known and request == uvc.SET:
            known.value = int.from_bytes(data, 'little')
            print('set', known.name, known.value, flush=True)
            return b''
        return known.get(request) if known else None

    def stream_control(self, request, selector, data):
        if request == uvc.SET:
            self.probe = uvc.stream_settings(data[3], struct.unpack_from('<I', data, 4)[0])
            if selector == uvc.COMMIT:
                self.committed = self.probe
                self.start()
            return b''
        if request == uvc.GET_LEN:
            return uvc.word(len(self.probe))
        if request == uvc.GET_INFO:
            return b'\3'
        return self.committed if selector == uvc.COMMIT else self.probe

    def start(self):
        self.streaming, self.pending, self.next = True, [], time.monotonic()
        print('started', Camera.sent, flush=True)

    def stop(self):
        if self.streaming:
            print('sent', Camera.sent, flush=True)
        self.streaming, self.pending = False, []

    def expose(self):
        """Makes a frame if one is due; skips it while the host is still busy with the previous
        one."""
        now = time.monotonic()
        if not self.streaming or now < self.next or now < self.silent_until:
            return
        frame, interval = struct.unpack_from('<BI', self.committed, 3)
        self.next = max(self.next + interval * 1e-7, now - .1)
        if self.pending or not self.asked:
            return
        Camera.sent += 1
        self.toggle ^= 1
        size = uvc.SIZES[frame - 1]
        image = numbered(self.pictures[size], size[0], Camera.sent)
        if self.truncate:
            self.truncate -= 1
            image = image[:len(image) // 2]
        step = uvc.PAYLOAD - 2
        parts = [image[at:at + step] for at in range(0, len(image), step)]
        self.pending = [bytes([2, 0x80 | self.toggle | (2 if i + 1 == len(parts) else 0)]) + part
                        for i, part in enumerate(parts)]

    def run(self, commands):
        """Runs until an unplug command and returns its duration in s, or None if the guest has
        gone."""
        while self.listen(.004):
            self.expose()
            while self.asked and self.pending:
                self.give(self.asked.pop(0), self.pending.pop(0))
            words = command(commands)
            if words:
                print(f'told {" ".join(words)}\nsent {Camera.sent}', flush=True)
            if words[:1] == ['unplug']:
                self.stop()
                return float(words[1])
            if words[:1] == ['truncate']:
                self.truncate = int(words[1])
            if words[:1] == ['silent']:
                self.silent_until = time.monotonic() + float(words[1])
        return None


def command(path):
    if not os.path.exists(path):
        return []
    with open(path, encoding='ascii') as file:
        words = file.read().split()
    if len(words) == 2:  # otherwise the writer has not finished
        os.unlink(path)
        return words
    return []


def main():
    path, commands = sys.argv[1:]
    if os.path.exists(path):
        os.unlink(path)
    listener = socket.socket(socket.AF_UNIX)
    listener.bind(path)
    listener.listen(1)
    while True:
        connection, _ = listener.accept()
        try:
            away = Camera(connection).run(commands)
        except (BrokenPipeError, ConnectionResetError):
            away = None
        connection.close()
        print('sent', Camera.sent, flush=True)
        if away is None:
            return
        time.sleep(away)


main()
