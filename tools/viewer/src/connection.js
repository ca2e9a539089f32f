// Connection to the gateway by Foxglove's WebSocket protocol: channels by topic, services by name.
// Reconnects automatically, and reports why there is no connection.

const PROTOCOLS = ['foxglove.sdk.v1', 'foxglove.websocket.v1'];
const MESSAGE = 1, TIME = 2, SERVICE_RESPONSE = 3, PLAYBACK = 5, SERVICE_REQUEST = 2, PLAYBACK_CONTROL = 3;
const text = new TextDecoder();

export class Connection {
  /** Calls `told(state, sentence)` on changes; state: "connecting", "open" or "lost". */
  constructor(address, told) {
    this.address = address;
    this.told = told;
    this.handlers = new Map(); // topic → handler(message, channel)
    this.channels = new Map(); // id → channel
    this.services = new Map(); // name → id
    this.topics = new Map(); // subscription id → topic
    this.calls = new Map(); // call id → {resolve, reject}
    this.nextId = 1;
    this.wait = 500;
    this.bytes = 0;
    this.time = 0n;
    this.open();
  }

  open() {
    this.told('connecting', '');
    const socket = new WebSocket(this.address, PROTOCOLS);
    socket.binaryType = 'arraybuffer';
    socket.onopen = () => { this.wait = 500; this.told('open', ''); };
    socket.onmessage = (event) => this.receive(event.data);
    socket.onclose = (event) => this.lost(event);
    this.socket = socket;
  }

  async lost(event) {
    this.channels.clear();
    this.topics.clear();
    for (const call of this.calls.values()) call.reject(new Error('the connection was lost'));
    this.calls.clear();
    const pause = this.wait;
    this.wait = Math.min(8000, this.wait * 2);
    this.told('lost', await this.whyLost(event));
    setTimeout(() => this.open(), pause);
  }

  /** Asks the gateway by HTTP why the connection failed, because browsers hide why a WebSocket
      was refused. */
  async whyLost(event) {
    const host = new URL(this.address).host;
    try {
      const answer = await fetch('healthz', { cache: 'no-store', signal: AbortSignal.timeout(2000) });
      if (!answer.ok) return `The gateway at ${host} hangs: ${(await answer.text()).slice(0, 200)}`;
      if (event.code === 1006 && this.time === 0n) {
        return `The gateway at ${host} refuses this page: is the token behind the address (?token=…) right, and are there free places (limits.clients)?`;
      }
      return `The connection to ${host} was lost; it is tried again.`;
    } catch {
      return `There is no gateway at ${host}: does perdure-gateway run? It is tried again.`;
    }
  }

  /** Passes each message of the topic to `handler`: parsed JSON, or a DataView for other
      encodings. */
  on(topic, handler) {
    this.handlers.set(topic, handler);
    for (const channel of this.channels.values()) if (channel.topic === topic) this.subscribe([channel]);
  }

  off(topic) {
    this.handlers.delete(topic);
    for (const [id, name] of this.topics) {
      if (name !== topic) continue;
      this.topics.delete(id);
      this.say({ op: 'unsubscribe', subscriptionIds: [id] });
    }
  }

  subscribe(channels) {
    const subscriptions = channels.filter((c) => this.handlers.has(c.topic)).map((c) => {
      const id = this.nextId++;
      this.topics.set(id, c.topic);
      return { id, channelId: c.id };
    });
    if (subscriptions.length > 0) this.say({ op: 'subscribe', subscriptions });
  }

  say(message) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  /** Calls a service of the gateway; rejects with the gateway's error sentence. */
  call(name, request) {
    const service = this.services.get(name);
    if (service === undefined || this.socket.readyState !== WebSocket.OPEN) {
      return Promise.reject(new Error('the gateway is not connected'));
    }
    const call = this.nextId++;
    const payload = new TextEncoder().encode(JSON.stringify(request));
    const bytes = new Uint8Array(17 + payload.length), view = new DataView(bytes.buffer);
    view.setUint8(0, SERVICE_REQUEST);
    view.setUint32(1, service, true);
    view.setUint32(5, call, true);
    view.setUint32(9, 4, true);
    bytes.set(new TextEncoder().encode('json'), 13);
    bytes.set(payload, 17);
    this.socket.send(bytes);
    return new Promise((resolve, reject) => this.calls.set(call, { resolve, reject }));
  }

  receive(data) {
    if (typeof data === 'string') return this.receiveText(JSON.parse(data));
    const view = new DataView(data);
    this.bytes += data.byteLength;
    const opcode = view.getUint8(0);
    if (opcode === MESSAGE) this.receiveMessage(view, data);
    if (opcode === TIME) this.time = view.getBigUint64(1, true);
    if (opcode === PLAYBACK) this.receivePlayback(view);
    if (opcode === SERVICE_RESPONSE) {
      const call = this.take(view.getUint32(5, true));
      const begin = 13 + view.getUint32(9, true);
      call?.resolve(JSON.parse(text.decode(new Uint8Array(data, begin))));
    }
    return undefined;
  }

  receivePlayback(view) {
    const status = ['playing', 'paused', 'buffering', 'ended'][view.getUint8(1)];
    this.playback = { status, time: 1e-9 * Number(view.getBigUint64(2, true)), speed: view.getFloat32(10, true) };
    if (view.getUint8(14)) this.onSeek?.();
  }

  /** Controls a recording: play or pause, speed, and optionally a new position (s). */
  control(play, speed, seek) {
    const id = new TextEncoder().encode(`p${this.nextId++}`), bytes = new Uint8Array(19 + id.length), view = new DataView(bytes.buffer);
    view.setUint8(0, PLAYBACK_CONTROL);
    view.setUint8(1, play ? 0 : 1);
    view.setFloat32(2, speed, true);
    view.setUint8(6, seek === undefined ? 0 : 1);
    view.setBigUint64(7, BigInt(Math.round(1e9 * (seek ?? 0))), true);
    view.setUint32(15, id.length, true);
    bytes.set(id, 19);
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(bytes);
  }

  receiveMessage(view, data) {
    const topic = this.topics.get(view.getUint32(1, true));
    const handler = this.handlers.get(topic);
    if (!handler) return;
    const json = [...this.channels.values()].find((c) => c.topic === topic)?.encoding === 'json';
    handler(json ? JSON.parse(text.decode(new Uint8Array(data, 13))) : new DataView(data, 13));
  }

  receiveText(message) {
    if (message.op === 'serverInfo') {
      this.session = message.sessionId;
      this.range = message.dataStartTime && { first: seconds(message.dataStartTime), last: seconds(message.dataEndTime) };
      this.playback = undefined;
    }
    if (message.op === 'advertise') {
      for (const channel of message.channels) this.channels.set(channel.id, channel);
      this.subscribe(message.channels);
    }
    if (message.op === 'advertiseServices') {
      for (const service of message.services) this.services.set(service.name, service.id);
    }
    if (message.op === 'serviceCallFailure') this.take(message.callId)?.reject(new Error(message.message));
    if (message.op === 'status' && message.level > 0) this.onStatus?.(message.message);
  }

  take(call) {
    const found = this.calls.get(call);
    this.calls.delete(call);
    return found;
  }
}

/** Returns the time (s) of foxglove::CompressedImage in CDR. */
export const timeOfImage = (view) => view.getUint32(4, true) + 1e-9 * view.getUint32(8, true);

/** Returns the JPEG of foxglove::CompressedImage in CDR, after its time and frame_id. */
export function bytesOfImage(view) {
  const lengthAt = (at) => ((at + 3) & ~3) + 4; // after the encapsulation, a string and its padding
  const at = lengthAt(16 + view.getUint32(12, true));
  return new Uint8Array(view.buffer, view.byteOffset + at, view.getUint32(at - 4, true));
}

export const seconds = (stamp) => stamp.sec + 1e-9 * stamp.nsec;
