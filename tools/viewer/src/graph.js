// Draws the graph of the map in three dimensions, in M: anchors, trajectory and loops.
import * as THREE from './vendor/three.module.js';
import { LOOPS, lookOfLoop } from './words.js';

const ANCHOR = '#8fb8de', UNKNOWN = '#8c8c8c', WAY = '#7094b8', NEAR_PX = 8, STEPS = 8;

/** Returns an arch from a to b, because a straight line could lie on the trajectory. */
function arch(a, b) {
  const height = 1 + 0.15 * a.distanceTo(b), points = [];
  for (let i = 0; i <= STEPS; ++i) {
    const t = i / STEPS, p = a.clone().lerp(b, t);
    p.z += 4 * t * (1 - t) * height;
    points.push(p);
  }
  return points;
}

const segmentsOf = (points) => points.slice(1).flatMap((p, i) => [points[i], p]);

/** Returns the distance in pixels from point `at` to the line between a and b. */
function pixelsFrom(at, a, b) {
  const dx = b.x - a.x, dy = b.y - a.y;
  const t = Math.min(1, Math.max(0, ((at.x - a.x) * dx + (at.y - a.y) * dy) / Math.max(1e-9, dx * dx + dy * dy)));
  return Math.hypot(at.x - a.x - t * dx, at.y - a.y - t * dy);
}

export class Graph {
  /** `map`: the three.js group that has the pose of M. */
  constructor(map) {
    this.group = new THREE.Group();
    map.add(this.group);
    this.anchors = new Map(); // id → anchor, with its position
    this.loops = new Map(); // id → loop, with the points of its line
    this.way = this.line(WAY, 0.7, false);
    this.lines = Object.fromEntries(Object.entries(LOOPS).map(([look, { colour, dashed }]) => [look, this.line(colour, 0.95, dashed)]));
    this.chosenLine = this.line('#ffffff', 1, false);
    this.chosenLine.renderOrder = 6; // drawn after the line of its loop
    this.chosenLine.material.depthTest = false;
    this.ball = new THREE.SphereGeometry(0.3, 12, 8);
    this.ballMaterial = new THREE.MeshBasicMaterial({ fog: false });
    this.balls = null;
    this.ring = new THREE.Mesh(new THREE.RingGeometry(0.96, 1, 48), new THREE.MeshBasicMaterial({ color: '#ffffff', side: THREE.DoubleSide, fog: false }));
    this.ring.visible = false;
    this.group.add(this.ring);
  }

  line(color, opacity, dashed) {
    const look = { color, opacity, transparent: true, fog: false };
    const material = dashed ? new THREE.LineDashedMaterial({ ...look, dashSize: 0.7, gapSize: 0.45 }) : new THREE.LineBasicMaterial(look);
    const line = new THREE.LineSegments(new THREE.BufferGeometry(), material);
    line.frustumCulled = false;
    this.group.add(line);
    return line;
  }

  static put(line, points) {
    line.geometry.dispose();
    line.geometry = new THREE.BufferGeometry().setFromPoints(points);
    if (line.material.isLineDashedMaterial) line.computeLineDistances();
  }

  /** Processes a message of /map/graph. */
  set(message) {
    this.anchors = new Map(message.anchors.map((a) => [a.id, { ...a, place: new THREE.Vector3().fromArray(a.at) }]));
    this.loops = new Map();
    const way = [], of = Object.fromEntries(Object.keys(LOOPS).map((look) => [look, []]));
    for (const anchor of this.anchors.values()) {
      const before = this.anchors.get(anchor.previous);
      if (before) way.push(before.place, anchor.place);
    }
    for (const loop of message.loops) {
      const a = this.anchors.get(loop.a), b = this.anchors.get(loop.b);
      if (!a || !b) continue;
      const points = arch(a.place, b.place);
      this.loops.set(loop.id, { ...loop, points });
      of[lookOfLoop(loop)].push(...segmentsOf(points));
    }
    Graph.put(this.way, way);
    for (const [look, line] of Object.entries(this.lines)) Graph.put(line, of[look]);
    this.setBalls();
    this.choose(this.chosen);
  }

  setBalls() {
    if (this.balls) {
      this.balls.removeFromParent();
      this.balls.dispose();
    }
    this.balls = new THREE.InstancedMesh(this.ball, this.ballMaterial, Math.max(1, this.anchors.size));
    this.balls.frustumCulled = false;
    this.balls.count = this.anchors.size;
    const at = new THREE.Matrix4(), known = new THREE.Color(ANCHOR), unknown = new THREE.Color(UNKNOWN);
    let i = 0;
    for (const anchor of this.anchors.values()) {
      this.balls.setColorAt(i, anchor.sigma.length ? known : unknown);
      this.balls.setMatrixAt(i++, at.makeTranslation(anchor.place));
    }
    this.group.add(this.balls);
  }

  /** Selects {kind: "anchor" | "loop", id}, or nothing. An anchor has a circle whose radius is
      2σ, the larger of x and y; grey if σ is unknown. */
  choose(part) {
    const anchor = part?.kind === 'anchor' ? this.anchors.get(part.id) : undefined;
    const loop = part?.kind === 'loop' ? this.loops.get(part.id) : undefined;
    this.chosen = anchor || loop ? part : undefined;
    this.ring.visible = Boolean(anchor);
    if (anchor) {
      this.ring.position.copy(anchor.place);
      const [x = 0, y = 0] = anchor.sigma;
      this.ring.scale.setScalar(Math.max(0.6, 2 * Math.max(x, y)));
      this.ring.material.color.set(anchor.sigma.length ? '#ffffff' : UNKNOWN);
    }
    Graph.put(this.chosenLine, loop ? segmentsOf(loop.points) : []);
  }

  place(part) {
    const local = part.kind === 'anchor' ? this.anchors.get(part.id)?.place : this.loops.get(part.id)?.points[STEPS / 2];
    return local && this.group.localToWorld(local.clone());
  }

  /** Returns the part within a few pixels of the screen position `at`, and its distance from the
      camera. Anchors have priority over loops. */
  pick(at, camera, width, height) {
    const inverse = new THREE.Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse).multiply(this.group.matrixWorld);
    const shown = (p) => {
      const q = p.clone().applyMatrix4(inverse);
      return { x: (q.x + 1) * width / 2, y: (1 - q.y) * height / 2, behind: q.z > 1 };
    };
    let best;
    const offer = (kind, id, pixels, place) => {
      if (pixels <= NEAR_PX && !(best?.pixels <= pixels)) best = { kind, id, pixels, distance: this.group.localToWorld(place.clone()).distanceTo(camera.position) };
    };
    for (const { id, place } of this.anchors.values()) {
      const p = shown(place);
      if (!p.behind) offer('anchor', id, Math.max(0, Math.hypot(p.x - at.x, p.y - at.y) - 3), place);
    }
    for (const { id, points } of this.loops.values()) {
      const line = points.map(shown);
      for (let i = 1; i < line.length; ++i) if (!line[i].behind && !line[i - 1].behind) offer('loop', id, pixelsFrom(at, line[i - 1], line[i]) + 1, points[i]);
    }
    return best;
  }
}
