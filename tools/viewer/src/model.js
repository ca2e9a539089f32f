// The state of the page: the newest data, and the objects' history since the page was opened.

const RATE_MS = 5000, SAMPLE_S = 0.2, SAMPLES = 1500; // five minutes of samples

export class Model {
  constructor() {
    this.objects = new Map(); // id → object, of the working set
    this.remembered = new Map(); // id → object, on the map, in M
    this.mapFrame = null; // the newest perdure.MapFrame
    this.graph = null; // the newest perdure.MapGraph
    this.history = new Map(); // id → [[time, r, p, visible fraction, largest σ, position, σ], …]
    this.drive = []; // [[time, speed, latency, position, σ], …]
    this.cpu = new Map(); // process → [[time, share of a core], …]
    this.chosen = 0;
    this.start = undefined; // the first pose of the shown W: {world, time, body}
    this.truth = undefined; // Truth of a simulated drive, while it is shown
    this.frame = null; // the shown perdure.Objects without its objects
    this.past = undefined; // of live data: the earlier time that is shown
    this.health = null;
    this.heardAt = 0; // performance.now() of the newest objects
    this.origin = 0; // start of a recording on the sensor clock
    this.arrivals = []; // arrival times of the last seconds
  }

  /** Takes new objects. Returns whether they belong to another W, or to a restarted recording. */
  takeObjects(message, now) {
    const time = timeOf(message), world = worldOf(message);
    const another = this.newest !== undefined && (world !== this.newestWorld || time < this.newest - 2);
    if (another) this.jumped();
    if (this.start?.world !== world) this.start = { world, time, body: message.body };
    this.newest = time;
    this.newestWorld = world;
    if (this.heardAt > 0) this.live = true; // not for the first message, which may be old
    this.heardAt = now;
    this.arrivals.push(now);
    while (this.arrivals[0] < now - RATE_MS) this.arrivals.shift();
    for (const o of message.objects) this.remember(o, time);
    this.measure(message, time);
    if (another) this.past = undefined;
    if (this.past === undefined) this.show(message);
    return another;
  }

  /** Shows objects, also those of an earlier time. */
  show({ objects, ...frame }) {
    this.world = worldOf(frame);
    this.time = timeOf(frame);
    this.frame = frame;
    this.objects = new Map(objects.map((o) => [o.id, o]));
  }

  /** Stores the speed, from the positions of the last half second, and the latency. */
  measure({ body, latency_ms: latency, body_sigma: sigma }, time) {
    const last = this.drive.at(-1);
    if (!body || (last && time - last[0] < SAMPLE_S)) return;
    const from = this.drive.at(-3) ?? last;
    const speed = from ? Math.hypot(...from[3].map((x, i) => body[i] - x)) / (time - from[0]) : NaN;
    this.drive.push([time, speed, latency >= 0 ? latency : NaN, body.slice(0, 3), sigma]);
    if (this.drive.length > SAMPLES) this.drive.shift();
  }

  takeHealth(health) {
    this.health = health;
    for (const { process, cpu } of this.newest === undefined ? [] : health.services) {
      const samples = this.cpu.get(process) ?? [];
      if (!(cpu >= 0) || samples.at(-1)?.[0] >= this.newest) continue;
      samples.push([this.newest, cpu]);
      if (samples.length > SAMPLES) samples.shift();
      this.cpu.set(process, samples);
    }
  }

  remember(o, time) {
    let samples = this.history.get(o.id);
    if (!samples) this.history.set(o.id, (samples = []));
    const last = samples.at(-1);
    if (last && time - last[0] < SAMPLE_S && time >= last[0]) return;
    samples.push([time, o.r, o.p, o.fraction, Math.sqrt(Math.max(0, o.cov[0], o.cov[3], o.cov[5])), o.c, Math.sqrt(o.cov[0] + o.cov[3] + o.cov[5])]);
    if (samples.length > SAMPLES) samples.shift();
  }

  /** Clears the data after a jump to another position of a recording. */
  jumped() {
    this.history.clear();
    this.cpu.clear();
    this.drive = [];
  }

  takeMap(message) {
    this.remembered = new Map([...(this.answer?.objects ?? []), ...message.objects.map((o) => [o.id, o])]);
    this.elsewhere = message.elsewhere;
  }

  /** Stores the map's answer to a query. The list shows its objects until the search changes. */
  takeAnswer(objects, note) {
    this.answer = { objects: objects && new Map(objects.map((o) => [o.id, o])), note };
    if (!objects) return; // the map did not answer
    for (const [id, o] of this.answer.objects) this.remembered.set(id, o);
  }

  /** T_MW as [x y z qx qy qz qw] if it belongs to the displayed W; otherwise the identity. */
  T_MW() {
    const f = this.mapFrame;
    return f && this.world === `${f.world}/${f.epoch}` ? f.T_MW : [0, 0, 0, 0, 0, 0, 1];
  }

  /** Returns an object's centre in W, converted from M for objects only on the map; null: unknown. */
  placeInW(o) {
    if (o.elsewhere) return null;
    if (o.memory === undefined) return o.c; // an object of the working set
    const [x, y, z, a, b, c, w] = this.T_MW();
    return turned([-a, -b, -c, w], [o.c[0] - x, o.c[1] - y, o.c[2] - z]);
  }

  bodyInM() {
    const [x, y, z, a, b, c, w] = this.T_MW();
    const p = turned([a, b, c, w], (this.frame?.body ?? [0, 0, 0]).slice(0, 3));
    return [p[0] + x, p[1] + y, p[2] + z];
  }

  /** Returns whether the object may be one of the earlier map, because the session is not yet
      localised in that map. */
  isProvisional(id) {
    return this.remembered.get(id)?.provisional ?? false;
  }

  find(id) {
    return this.objects.get(id) ?? this.remembered.get(id);
  }

  /** Returns the rate of object messages in Hz, averaged over seconds, because a busy page
      receives several at once. */
  rate(now) {
    if (this.arrivals.length < 3 || now - this.heardAt > 2000) return 0;
    return (1000 * (this.arrivals.length - 1)) / Math.max(1, this.arrivals.at(-1) - this.arrivals[0]);
  }

  /** Call it after the page itself was busy: limits the silence to 1 s, as messages may wait. */
  stoodStill(now) {
    if (this.heardAt > 0) this.heardAt = Math.max(this.heardAt, now - 1000);
  }

  silentFor(now) {
    return this.heardAt > 0 ? (now - this.heardAt) / 1000 : Infinity;
  }
}

export const timeOf = ({ timestamp }) => timestamp.sec + 1e-9 * timestamp.nsec;
const worldOf = ({ world, epoch }) => `${world}/${epoch}`;

/** Rotates a vector by a quaternion [x y z w]. */
function turned([a, b, c, w], [x, y, z]) {
  const u = 2 * (b * z - c * y), v = 2 * (c * x - a * z), t = 2 * (a * y - b * x);
  return [x + w * u + b * t - c * v, y + w * v + c * u - a * t, z + w * t + a * v - b * u];
}

/** Returns the state to display, and the current fault as a sentence; "" if there is none. */
export function troubleOf(model, connection, now) {
  if (connection.state === 'lost') return ['lost', connection.sentence];
  if (connection.state !== 'open') return ['connecting', ''];
  const services = (model.health?.services ?? []).filter((s) => s.process !== 'gateway');
  const silent = model.silentFor(now);
  if (connection.playback) return ['played', ''];
  if (!model.health) return ['connecting', ''];
  const heard = services.filter((s) => s.age_s < 2.5);
  const capture = heard.find((s) => s.process === 'capture');
  if (heard.length === 0 && silent > 2) {
    return ['stale', 'No data from any service: do they run, with the same bus.domain, bus.interface and bus.vehicle as the gateway? (perdure status)'];
  }
  // A new client receives the last `objects` once, even if they are old.
  const last = silent > 2 || !model.live;
  if (last && capture?.message === 'end of drive') return ['stale', 'The drive has ended: this is the last state.'];
  if (silent > 2) {
    const bad = services.filter((s) => s.age_s >= 2.5).map((s) => `${s.process} has been silent for ${Math.round(s.age_s)} s`);
    const said = heard.filter((s) => s.state !== 'ok' && s.message).map((s) => `${s.process}: ${s.message}`);
    const why = [...bad, ...said].slice(0, 3).join('; ');
    const since = silent === Infinity ? 'No objects since this page was opened' : `No objects for ${Math.round(silent)} s`;
    const playing = heard.length === 0 ? ' A played recording ends like this.' : '';
    return ['stale', `${since}${why ? ` (${why})` : ''}.${playing || (why ? '' : ' Is semantic_filter running, and does odometry come?')}`];
  }
  const gone = services.filter((s) => s.age_s >= 2.5);
  if (gone.length > 0) return ['degraded', `${gone.map((s) => s.process).join(', ')}: silent for ${Math.round(Math.max(...gone.map((s) => s.age_s)))} s; it is stopped, hangs, or is gone.`];
  const degraded = heard.filter((s) => s.state !== 'ok' && s.message);
  if (degraded.length > 0) {
    const more = degraded.length > 2 ? `; ${degraded.length - 2} more: see Services` : '';
    return ['degraded', degraded.slice(0, 2).map((s) => `${s.process} is ${s.state}: ${s.message}`).join('; ') + more];
  }
  return ['live', ''];
}
