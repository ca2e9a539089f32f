"""A USB device at the end of a socket, for QEMU's usb-redir (usbredir protocol, version 0.7)."""
import select
import struct

HELLO, CONNECT, INTERFACES, ENDPOINTS = 0, 1, 4, 5
SET_CONFIGURATION, GET_CONFIGURATION, CONFIGURATION_STATUS = 6, 7, 8
SET_ALTERNATE, GET_ALTERNATE, ALTERNATE_STATUS = 9, 10, 11
CANCEL, CONTROL, BULK = 21, 100, 101
SUCCESS, CANCELLED, STALL = 0, 1, 4
HIGH_SPEED = 2
CAPABILITIES = 1 << 4 | 1 << 5 | 1 << 6  # stated packet sizes, 64-bit ids, 32-bit bulk lengths
CONTROL_HEAD, BULK_HEAD = '<BBBBHHH', '<BBHIHH'


class RedirectedDevice:
    """The protocol for one plugged device. A subclass has `identity` (class, subclass, protocol,
    vendor, product), `interfaces` [(number, class, subclass, protocol)] and `bulk_in` (address,
    interface, packet). It implements control(request_type, request, value, index, length, data),
    which returns bytes, or None for a stall."""

    def __init__(self, connection):
        self.connection = connection
        self.received = b''
        self.asked = []  # ids of bulk transfers that wait for data
        self.greeted = False
        hello = b'Perdure test camera'.ljust(64, b'\0') + struct.pack('<I', CAPABILITIES)
        connection.sendall(struct.pack('<III', HELLO, len(hello), 0) + hello)

    def send(self, kind, number, body):
        self.connection.sendall(struct.pack('<IIQ', kind, len(body), number) + body)

    def listen(self, longest_s):
        """Handles the messages of the next `longest_s` seconds; returns False if the peer has
        closed."""
        if not select.select([self.connection], [], [], longest_s)[0]:
            return True
        more = self.connection.recv(1 << 16)
        self.received += more
        while self.take():
            pass
        return bool(more)

    def take(self):
        form = '<IIQ' if self.greeted else '<III'  # the first message has a shorter id
        size = struct.calcsize(form)
        if len(self.received) < size:
            return False
        kind, length, number = struct.unpack_from(form, self.received)
        if len(self.received) < size + length:
            return False
        body = self.received[size:size + length]
        self.received = self.received[size + length:]
        self.greeted = True
        self.handle(kind, number, body)
        return True

    def handle(self, kind, number, body):
        if kind == HELLO:
            self.plug()
        elif kind == SET_CONFIGURATION:
            self.send(CONFIGURATION_STATUS, number, bytes([SUCCESS, body[0]]))
        elif kind == GET_CONFIGURATION:
            self.send(CONFIGURATION_STATUS, number, bytes([SUCCESS, 1]))
        elif kind == SET_ALTERNATE:
            self.send(ALTERNATE_STATUS, number, bytes([SUCCESS, body[0], body[1]]))
        elif kind == GET_ALTERNATE:
            self.send(ALTERNATE_STATUS, number, bytes([SUCCESS, body[0], 0]))
        elif kind == CANCEL and number in self.asked:
            self.asked.remove(number)
            self.give(number, b'', CANCELLED)
        elif kind == CONTROL:
            self.answer_control(number, body)
        elif kind == BULK:
            self.asked.append(number)

    def plug(self):
        """Reports the endpoints: 0 … 15 are outputs, 16 … 31 inputs; type 255 marks an unused
        one."""
        address, interface, packet = self.bulk_in
        place = 16 + (address & 15)
        types, at, sizes = bytearray([255] * 32), bytearray(32), [0] * 32
        types[0] = types[16] = 0
        sizes[0] = sizes[16] = 64
        types[place], at[place], sizes[place] = 2, interface, packet
        columns = [bytes(column).ljust(32, b'\0') for column in zip(*self.interfaces)]
        self.send(INTERFACES, 0, struct.pack('<I', len(self.interfaces)) + b''.join(columns))
        self.send(ENDPOINTS, 0, bytes(types) + bytes(32) + bytes(at) + struct.pack('<32H', *sizes))
        self.send(CONNECT, 0, struct.pack('<BBBBHH', HIGH_SPEED, *self.identity))

    def answer_control(self, number, body):
        endpoint, request, kind, _, value, index, length = struct.unpack_from(CONTROL_HEAD, body)
        data = body[struct.calcsize(CONTROL_HEAD):]
        answer = self.control(kind, request, value, index, data)
        inwards = bool(kind & 0x80)
        out = (answer or b'')[:length] if inwards else b''
        head = struct.pack(CONTROL_HEAD, endpoint, request, kind, STALL if answer is None else SUCCESS, value, index,
                           len(out) if inwards else length)
        self.send(CONTROL, number, head + out)

    def give(self, number, data, status=SUCCESS):
        head = struct.pack('<BBHIH', self.bulk_in[0], status, len(data) & 0xffff, 0, len(data) >> 16)
        self.send(BULK, number, head + data)
