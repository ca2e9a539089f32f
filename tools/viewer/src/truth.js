// The truth of a simulated drive in the shown W: true objects, the true path, and errors against σ.
import * as THREE from './vendor/three.module.js';
import { outline } from './things.js';
import { TRUE_COLOUR } from './words.js';

const NEAR_M = 3; // limit of `perdure evaluate consistency`
const SHOWN_M = 150; // distance up to which objects are drawn

/** Returns the rotation about z that aligns the attitude of `from` with that of `to`; poses are
    [x, y, z, qx, qy, qz, qw]. */
function yawBetween(from, to) {
  const [, , , ax, ay, az, aw] = to, [x, y, z, w] = [-from[3], -from[4], -from[5], from[6]];
  return 2 * Math.atan2(aw * z + ax * y - ay * x + az * w, aw * w - ax * x - ay * y - az * z);
}

/** Returns the value [x, y, z, …] of rows [time, …] at a time, between its neighbours. */
function between(rows, time) {
  const next = rows.findIndex((row) => row[0] >= time), i = next < 0 ? rows.length - 1 : Math.max(1, next), [a, b] = [rows[i - 1], rows[i]];
  if (!a || !b) return rows[0].slice(1);
  const share = Math.min(1, Math.max(0, (time - a[0]) / (b[0] - a[0])));
  return a.slice(1).map((v, k) => v + share * (b[k + 1] - v));
}

const distance = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);

export class Truth {
  /** Fetches the truth; null if the gateway has none. */
  static async load() {
    const data = await fetch('truth.json').then((answer) => (answer.ok ? answer.json() : null)).catch(() => null);
    document.querySelector('[data-key=u]').hidden = !data;
    return data && new Truth(data);
  }

  constructor({ path, objects }) {
    Object.assign(this, { path, objects, yaw: 0, at: [0, 0, 0] });
    const line = new THREE.LineBasicMaterial({ color: TRUE_COLOUR });
    this.boxes = new THREE.LineSegments(new THREE.BufferGeometry(), line);
    this.line = new THREE.Line(new THREE.BufferGeometry(), line);
    this.boxes.frustumCulled = this.line.frustumCulled = false;
    this.group = new THREE.Group().add(this.boxes, this.line);
  }

  toggle(model, world) {
    model.truth = model.truth ? undefined : this;
    document.querySelector('#legend [data-truth]').hidden = !model.truth;
    if (!world) return Boolean(model.truth);
    this.group.visible = Boolean(model.truth);
    world.scene.add(this.group);
    world.dirty = true;
    this.show(model, world);
    return this.group.visible;
  }

  /** Aligns the truth, and draws the path and the objects near the vehicle. */
  show(model, world) {
    if (!model.frame || (model.time === this.time && model.start === this.start)) return;
    this.align(model.start);
    this.time = model.time;
    const near = this.present(model.time).filter(({ c }) => Math.hypot(c[0] - model.frame.body[0], c[1] - model.frame.body[1]) < SHOWN_M);
    const edges = near.flatMap((o) => [...outline(o.size, false).applyMatrix4(new THREE.Matrix4().makeRotationZ(o.yaw).setPosition(...o.c)).attributes.position.array]);
    this.draw(this.boxes, edges);
    this.draw(this.line, this.path.flatMap(([, ...p]) => this.toW(p)));
    if (world) world.dirty = true;
  }

  draw(lines, points) {
    lines.geometry.dispose();
    lines.geometry = new THREE.BufferGeometry().setAttribute('position', new THREE.Float32BufferAttribute(points, 3));
  }

  /** Aligns position and yaw by the first pose of a W that the page received: {world, time, body}. */
  align(start) {
    if (!start || start === this.start) return;
    this.start = start;
    const there = between(this.path, start.time);
    this.yaw = yawBetween(there, start.body);
    this.at = [0, 0, 0];
    const turned = this.toW(there);
    this.at = this.at.map((_, i) => start.body[i] - turned[i]);
  }

  toW([x, y, z]) {
    const c = Math.cos(this.yaw), s = Math.sin(this.yaw);
    return [c * x - s * y + this.at[0], s * x + c * y + this.at[1], z + this.at[2]];
  }

  body(time) { return this.toW(between(this.path, time)); }

  place(object, time) {
    const [, ...last] = object.keys.findLast((key) => key[0] <= time) ?? object.keys[0];
    return { c: this.toW(object.moves ? between(object.keys, time) : last), yaw: last[3] + this.yaw };
  }

  /** Returns the objects that are present at a time, with their places in W. */
  present(time) {
    return this.objects.filter((o) => o.from <= time && time < o.until).map((o) => ({ ...o, ...this.place(o, time) }));
  }

  /** Returns the nearest true object of the same class within 3 m; undefined: there is none. */
  partner(o, time) {
    const near = this.present(time).filter((t) => t.class === o.class && distance(t.c, o.c) <= NEAR_M);
    return near.sort((a, b) => distance(a.c, o.c) - distance(b.c, o.c))[0];
  }

  /** Returns [[time, error, σ], …] of samples [[time, position, σ], …]. */
  errors(samples, at) {
    return samples.map(([time, p, sigma]) => [time, distance(p, at(time)), sigma >= 0 ? sigma : NaN]);
  }

  errorsOfBody(samples) {
    return this.errors(samples.map((s) => [s[0], s[3], s[4]]), (time) => this.body(time));
  }

  /** Returns the errors of an object over its history; undefined if it has no partner. */
  errorsOf(o, model) {
    const partner = model.objects.has(o.id) && this.partner(o, model.time);
    return partner ? this.errors((model.history.get(o.id) ?? []).map((s) => [s[0], s[5], s[6]]), (time) => this.place(partner, time).c) : undefined;
  }
}

/** Returns the last of errors as words. */
export function wordsOfError(errors) {
  const [, error, sigma] = errors?.at(-1) ?? [];
  return error === undefined ? '–' : `${error.toFixed(2)} m, σ ${Number.isFinite(sigma) ? `${sigma.toFixed(2)} m` : '?'}`;
}
