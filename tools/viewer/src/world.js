// Draws the map in three dimensions: ground, trajectory, vehicle, points, and objects with names.
import * as THREE from './vendor/three.module.js';
import { Graph } from './graph.js';
import { Orbit } from './orbit.js';
import { roundUp } from './plots.js';
import { Thing } from './things.js';
import { colourOf, colourOfAge, looksLike } from './words.js';

const MOST_LABELS = 40, MOST_MARKS = 100, SLOW_MS = 120, ANSWERED_MS = 150;

export class World {
  /** Calls `onPick(id)` on selection of an object (0: none), `onPart({kind, id})` of the graph. */
  constructor(canvas, labels, onPick, onPart) {
    this.canvas = canvas;
    this.labels = labels;
    this.toolbar = document.getElementById('tools'); // labels of objects avoid this toolbar
    [this.compass, this.scaleBar] = document.getElementById('scale').children;
    this.onPick = onPick;
    this.onPart = onPart;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, powerPreference: 'low-power' });
    this.renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    this.scene = new THREE.Scene();
    this.scene.background = new THREE.Color('#0c1117');
    this.scene.fog = new THREE.Fog('#0c1117', 60, 190);
    this.camera = new THREE.PerspectiveCamera(50, 1, 0.1, 2000);
    this.camera.up.set(0, 0, 1);
    this.things = new Map();
    this.remembered = new Map();
    this.names = new Map(); // id → element
    this.shows = { ellipsoids: true, points: true, map: true, graph: true, seen: false };
    this.follow = true;
    this.chosen = 0;
    this.dirty = true;
    this.drawn = this.slow = this.took = this.restsUntil = 0;
    this.light();
    this.addGround();
    this.addVehicle();
    this.addLines();
    this.map = new THREE.Group(); // has the pose of M in W
    this.graph = new Graph(this.map);
    this.marks = new THREE.Group();
    this.scene.add(this.map, this.marks);
    this.orbit = new Orbit(this.camera, canvas, (shifted) => {
      this.dirty = true;
      if (shifted) this.setFollow(false);
    });
    canvas.addEventListener('click', (e) => this.pick(e));
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    this.resize();
  }

  light() {
    this.scene.add(new THREE.HemisphereLight('#dfeaff', '#39424c', 1.7));
    const sun = new THREE.DirectionalLight('#fff4e0', 1.9);
    sun.position.set(-30, 20, 60);
    this.scene.add(sun);
  }

  addGround() {
    // Lines are in short pieces, because some browsers draw lines incorrectly that pass behind the
    // camera.
    const half = 150, step = 5, points = [];
    for (let a = -half; a <= half; a += step) {
      for (let b = -half; b < half; b += step) points.push(a, b, 0, a, b + step, 0, b, a, 0, b + step, a, 0);
    }
    const lines = new THREE.BufferGeometry();
    lines.setAttribute('position', new THREE.Float32BufferAttribute(points, 3));
    this.grid = new THREE.LineSegments(lines, new THREE.LineBasicMaterial({ color: '#2d3d4d', depthWrite: false }));
    const plane = new THREE.Mesh(new THREE.PlaneGeometry(2 * half, 2 * half), new THREE.MeshBasicMaterial({ color: '#121b24', depthWrite: false }));
    plane.renderOrder = -2; // drawn before the lines, which lie in this plane
    this.grid.renderOrder = -1;
    this.grid.add(plane);
    this.scene.add(this.grid);
    this.ground = null;
  }

  addVehicle() {
    this.vehicle = new THREE.Group();
    const shape = new THREE.Shape([new THREE.Vector2(1.3, 0), new THREE.Vector2(-0.9, 0.8), new THREE.Vector2(-0.45, 0), new THREE.Vector2(-0.9, -0.8)]);
    const arrow = new THREE.Mesh(new THREE.ExtrudeGeometry(shape, { depth: 0.25, bevelEnabled: false }), new THREE.MeshStandardMaterial({ color: '#ffffff', emissive: '#5aa9ff', emissiveIntensity: 0.5 }));
    arrow.position.z = -0.1;
    this.vehicle.add(arrow);
    const sight = new THREE.Shape([new THREE.Vector2(0, 0), new THREE.Vector2(26, 15), new THREE.Vector2(29, 0), new THREE.Vector2(26, -15)]);
    this.sight = new THREE.Mesh(new THREE.ShapeGeometry(sight), new THREE.MeshBasicMaterial({ color: '#4aa3ff', transparent: true, opacity: 0.06, depthWrite: false, side: THREE.DoubleSide }));
    this.vehicle.add(this.sight);
    this.vehicle.visible = false;
    this.scene.add(this.vehicle);
  }

  addLines() {
    this.way = new THREE.Line(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: '#4aa3ff' }));
    this.way.frustumCulled = false;
    this.points = new THREE.Points(new THREE.BufferGeometry(), new THREE.PointsMaterial({ size: 2.5, sizeAttenuation: false, vertexColors: true }));
    this.points.frustumCulled = false;
    this.blocker = new THREE.Line(new THREE.BufferGeometry(), new THREE.LineDashedMaterial({ color: '#ffd98a', dashSize: 0.4, gapSize: 0.3, depthTest: false }));
    this.blocker.frustumCulled = false;
    this.scene.add(this.way, this.points, this.blocker);
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.dirty = true; // at once, because the canvas is empty now
    this.restsUntil = 0;
  }

  setFollow(on) {
    this.follow = on;
    this.onFollow?.(on);
    this.dirty = true;
  }

  toggle(what) {
    this.shows[what] = !this.shows[what];
    this.applyShows();
    return this.shows[what];
  }

  applyShows() {
    this.points.visible = this.shows.points;
    this.graph.group.visible = this.shows.graph;
    for (const thing of this.things.values()) thing.ellipsoid.visible = this.shows.ellipsoids;
    for (const thing of this.remembered.values()) thing.group.visible = this.shows.map;
    if (this.seen) this.seen.visible = this.shows.seen;
    if (!this.shows.seen) this.tintByAge();
    this.dirty = true;
  }

  /** Processes a message of /map/seen: cells of the ground, by the age of their last view. */
  setSeen(message, time) {
    this.seen?.removeFromParent();
    this.seen?.dispose();
    const side = 0.94 * message.cell_m, { cells } = message;
    this.seen = new THREE.InstancedMesh(new THREE.PlaneGeometry(side, side), new THREE.MeshBasicMaterial({ transparent: true, opacity: 0.3, depthWrite: false }), Math.max(1, cells.length));
    this.seen.frustumCulled = false;
    this.seen.count = cells.length;
    const at = new THREE.Matrix4(), colour = new THREE.Color();
    cells.forEach(([x, y, age], i) => {
      this.seen.setMatrixAt(i, at.makeTranslation(x, y, message.ground_m + 0.02));
      this.seen.setColorAt(i, colour.set(colourOfAge(age)));
    });
    this.scene.add(this.seen);
    this.tintByAge(time);
    this.applyShows();
  }

  /** Gives the objects the colour of the time since their last detection; without `time`, that of
      their class. */
  tintByAge(time) {
    for (const things of [this.things, this.remembered]) {
      for (const thing of things.values()) thing.tint(time === undefined ? undefined : colourOfAge(time - thing.object.last_s));
    }
  }

  fromAbove() {
    this.orbit.polar = this.orbit.polar < 0.1 ? 1.02 : 0.02;
    if (this.orbit.polar < 0.1) this.orbit.distance = Math.max(this.orbit.distance, 60);
    this.dirty = true;
  }

  setObjects(model) {
    const up = new THREE.Vector3().fromArray(model.frame.up);
    if (this.shownWorld !== model.world) {
      this.shownWorld = model.world;
      this.way.geometry.setFromPoints([]);
      for (const mark of [...this.marks.children]) {
        if (mark.userData.world === model.world) mark.visible = true;
        else this.marks.remove(mark);
      }
      this.heading = null;
    }
    this.sync(this.things, model.objects, false, up);
    this.syncRemembered(model);
    this.setBody(model.frame.body);
    this.setGround(model.objects);
    this.showBlocker();
    this.dirty = true;
  }

  syncRemembered(model) {
    const only = new Map([...model.remembered].filter(([id, o]) => !model.objects.has(id) && !o.elsewhere));
    this.sync(this.remembered, only, true, new THREE.Vector3(0, 0, 1));
    this.setMapFrame(model.T_MW());
  }

  /** Sets the pose of M in W. When a loop is closed, the map moves and the working set stays. */
  setMapFrame([x, y, z, ...q]) {
    this.map.quaternion.fromArray(q).invert();
    this.map.position.set(-x, -y, -z).applyQuaternion(this.map.quaternion);
    this.map.updateMatrixWorld();
    this.dirty = true;
  }

  /** Adds a pole where a loop was closed or retracted, or the session was localised.
      `world` is the W of `at`, because events may arrive before the first objects of their W. */
  addMark(at, colour, world) {
    const pole = new THREE.Mesh(new THREE.CylinderGeometry(0.05, 0.05, 3, 8).rotateX(Math.PI / 2), new THREE.MeshBasicMaterial({ color: colour }));
    const ring = new THREE.Mesh(new THREE.TorusGeometry(0.7, 0.06, 6, 32), pole.material);
    const mark = new THREE.Group().add(pole, ring);
    pole.position.z = 1.5;
    mark.position.fromArray(at);
    mark.userData.world = world;
    mark.visible = this.shownWorld === undefined || this.shownWorld === world;
    if (this.ground !== null) mark.position.z = this.ground;
    this.marks.add(mark);
    if (this.marks.children.length > MOST_MARKS) this.marks.remove(this.marks.children[0]);
    this.dirty = true;
  }

  setGraph(message) {
    this.graph.set(message);
    this.dirty = true;
  }

  choosePart(part) {
    this.graph.choose(part);
    this.dirty = true;
  }

  lookAtPlace(at) {
    this.setFollow(false);
    this.orbit.target.fromArray(at);
    this.dirty = true;
  }

  sync(things, objects, remembered, up) {
    for (const [id, thing] of things) {
      if (objects.has(id)) continue;
      thing.group.removeFromParent();
      thing.ellipsoid.removeFromParent();
      thing.dispose();
      things.delete(id);
    }
    for (const [id, object] of objects) {
      let thing = things.get(id);
      if (!thing) {
        things.set(id, (thing = new Thing(object, remembered)));
        thing.group.userData.id = id;
        (remembered ? this.map : this.scene).add(thing.group);
        if (!remembered) this.scene.add(thing.ellipsoid);
        thing.ellipsoid.visible = this.shows.ellipsoids;
        if (remembered) thing.group.visible = this.shows.map;
        thing.choose(id === this.chosen);
      } else if (!remembered || thing.object !== object) {
        thing.update(object, up);
      }
    }
  }

  setBody([x, y, z, qx, qy, qz, qw]) {
    this.vehicle.visible = true;
    this.vehicle.position.set(x, y, z);
    this.vehicle.quaternion.set(qx, qy, qz, qw);
    const ahead = new THREE.Vector3(1, 0, 0).applyQuaternion(this.vehicle.quaternion);
    const heading = Math.atan2(ahead.y, ahead.x);
    if (this.follow) {
      // Places the target ahead of the vehicle and rotates it with the vehicle.
      const turned = this.heading === null || this.heading === undefined ? 0 : Math.atan2(Math.sin(heading - this.heading), Math.cos(heading - this.heading));
      if (this.heading === null || this.heading === undefined) this.orbit.azimuth = heading + Math.PI;
      else this.orbit.azimuth += turned;
      this.orbit.target.set(x + 7 * Math.cos(heading), y + 7 * Math.sin(heading), z);
    }
    this.heading = heading;
    this.sight.position.z = 0;
  }

  /** Sets the ground to the typical height of the objects. */
  setGround(objects) {
    const feet = [...objects.values()].filter((o) => o.confirmed).map((o) => o.c[2] - o.size[2] / 2).sort((a, b) => a - b);
    const z = feet.length > 0 ? feet[feet.length >> 1] : this.vehicle.position.z - 1.2;
    this.ground = this.ground === null || Math.abs(z - this.ground) > 3 ? z : this.ground + 0.05 * (z - this.ground);
    const step = 5;
    this.grid.position.set(step * Math.round(this.vehicle.position.x / step), step * Math.round(this.vehicle.position.y / step), this.ground);
  }

  setWay(poses) {
    this.way.geometry.dispose();
    this.way.geometry = new THREE.BufferGeometry().setFromPoints(poses.map((p) => new THREE.Vector3(p.position.x, p.position.y, p.position.z)));
    this.dirty = true;
  }

  setPoints(cloud) {
    const bytes = Uint8Array.from(atob(cloud.data), (c) => c.charCodeAt(0));
    const values = new Float32Array(bytes.buffer), n = values.length / 4;
    const positions = new Float32Array(3 * n), colours = new Float32Array(3 * n), colour = new THREE.Color();
    for (let i = 0; i < n; ++i) {
      positions.set(values.subarray(4 * i, 4 * i + 3), 3 * i);
      // More accurate points are brighter.
      const known = 1 / (1 + 2 * values[4 * i + 3]);
      colour.setHSL(0.42, 0.55, 0.18 + 0.5 * known).toArray(colours, 3 * i);
    }
    this.points.geometry.dispose();
    this.points.geometry = new THREE.BufferGeometry();
    this.points.geometry.setAttribute('position', new THREE.BufferAttribute(positions, 3));
    this.points.geometry.setAttribute('color', new THREE.BufferAttribute(colours, 3));
    this.dirty = true;
  }

  thing(id) {
    return this.things.get(id) ?? this.remembered.get(id);
  }

  choose(id) {
    this.thing(this.chosen)?.choose(false);
    this.chosen = id;
    this.thing(id)?.choose(true);
    this.showBlocker();
    this.dirty = true;
    // If drawing is slow, pending updates are processed before the next picture.
    if (this.took >= SLOW_MS) this.restsUntil = Math.max(this.restsUntil, performance.now() + ANSWERED_MS);
  }

  /** Shows a line from the selected object to its occluder. */
  showBlocker() {
    const thing = this.things.get(this.chosen), by = thing && this.things.get(thing.object.blocked_by);
    this.blocker.visible = Boolean(by);
    if (!by) return;
    this.blocker.geometry.dispose();
    this.blocker.geometry = new THREE.BufferGeometry().setFromPoints([thing.group.position, by.group.position]);
    this.blocker.computeLineDistances();
  }

  lookAt(id) {
    const thing = this.thing(id);
    if (!thing) return;
    this.setFollow(false);
    thing.group.getWorldPosition(this.orbit.target);
    this.orbit.distance = Math.min(this.orbit.distance, 5 * Math.max(...thing.object.size) + 6);
    this.dirty = true;
  }

  /** Selects an object by its box, even if occluded, because touch is inexact. */
  pick(e) {
    if (this.orbit.travelled > 6) return;
    const box = this.canvas.getBoundingClientRect();
    const at = new THREE.Vector2(((e.clientX - box.left) / box.width) * 2 - 1, 1 - ((e.clientY - box.top) / box.height) * 2);
    const ray = new THREE.Raycaster();
    ray.setFromCamera(at, this.camera);
    let best = { distance: Infinity, id: 0 };
    for (const things of [this.things, this.shows.map ? this.remembered : new Map()]) {
      for (const [id, thing] of things) {
        const inverse = thing.group.matrixWorld.clone().invert();
        const local = ray.ray.clone().applyMatrix4(inverse);
        const half = new THREE.Vector3().fromArray(thing.object.size).multiplyScalar(0.5);
        const hit = local.intersectBox(new THREE.Box3(half.clone().negate(), half), new THREE.Vector3());
        if (!hit) continue;
        const distance = hit.applyMatrix4(thing.group.matrixWorld).distanceTo(ray.ray.origin);
        if (distance < best.distance) best = { distance, id };
      }
    }
    const pixel = { x: e.clientX - box.left, y: e.clientY - box.top };
    const part = this.shows.graph ? this.graph.pick(pixel, this.camera, box.width, box.height) : undefined;
    if (part && part.distance < best.distance) this.onPart({ kind: part.kind, id: part.id });
    else this.onPick(best.id);
  }

  /** Draws if something has changed. Must be called for each animation frame. */
  draw() {
    const now = performance.now();
    this.keepPace(now);
    if (!this.dirty || now < this.restsUntil) return;
    this.dirty = false;
    this.orbit.apply();
    this.renderer.render(this.scene, this.camera);
    this.drawNames();
    this.drawScale();
    this.drewAt = now;
    ++this.drawn;
  }

  /** If drawing is slow, uses larger pixels, and leaves half of the time to lists and clicks. */
  keepPace(now) {
    if (this.drewAt === undefined) return;
    const took = now - this.drewAt; // time until the next frame
    this.drewAt = undefined;
    this.took = took;
    if (took < SLOW_MS) {
      this.slow = Math.max(0, this.slow - 1);
      return;
    }
    this.restsUntil = now + Math.min(took, 500);
    const ratio = this.renderer.getPixelRatio();
    if (++this.slow < 6 || ratio <= 0.5) return;
    this.slow = 0;
    this.renderer.setPixelRatio(Math.max(0.5, 0.7 * ratio));
    this.resize();
  }

  /** Takes the transform from W to east, north and up; undefined: not known. */
  setEarth(transform) {
    const { z, w } = transform?.rotation ?? {};
    const north = transform && 2 * Math.atan2(z, w) + Math.PI / 2; // yaw in W
    if (north === this.north) return;
    if ((north === undefined) !== (this.north === undefined)) {
      const name = north === undefined ? 'x of M' : 'N';
      const words = north === undefined ? 'Direction of x of the map M. North is shown if the drive has satellite positions.' : 'North';
      this.compass.querySelector('text').textContent = name;
      this.compass.querySelector('title').textContent = words;
      this.compass.setAttribute('aria-label', words);
    }
    this.north = north;
    this.dirty = true;
  }

  /** Shows the length of a bar at the target of the view, and the direction of north or of x of M. */
  drawScale() {
    const metres = 2 * this.orbit.distance * Math.tan((Math.PI * this.camera.fov) / 360), perPixel = metres / this.canvas.clientHeight;
    const length = roundUp(60 * perPixel), words = `${length} m`;
    this.scaleBar.style.width = `${(length / perPixel).toFixed(0)}px`;
    if (this.scaleBar.textContent !== words) this.scaleBar.textContent = words;
    const x = new THREE.Vector3(1, 0, 0).applyQuaternion(this.map.quaternion), yaw = this.north ?? Math.atan2(x.y, x.x);
    const turn = this.orbit.azimuth + Math.PI - yaw; // clockwise from the view's forward direction
    this.compass.querySelector('path').setAttribute('transform', `rotate(${((180 * turn) / Math.PI).toFixed(0)})`);
  }

  drawNames() {
    const { clientWidth: width, clientHeight: height } = this.canvas, at = new THREE.Vector3();
    const candidates = [];
    const chosen = this.remembered.get(this.chosen);
    for (const [id, thing] of [...this.things, ...(chosen ? [[this.chosen, chosen]] : [])]) {
      const o = thing.object;
      if (!o.confirmed && id !== this.chosen) continue;
      thing.group.getWorldPosition(at);
      at.z += o.size[2] / 2 + 0.25;
      const distance = at.distanceTo(this.camera.position);
      at.project(this.camera);
      if (at.z > 1 || Math.abs(at.x) > 1.05 || Math.abs(at.y) > 1.05) continue;
      const near = id === this.chosen ? -1 : distance + (looksLike(o) === 'away' ? 40 : 0);
      if (near > 130) continue;
      candidates.push({ id, o, near, x: (at.x + 1) * width / 2, y: (1 - at.y) * height / 2 });
    }
    candidates.sort((a, b) => a.near - b.near);
    const tools = this.toolbar.getBoundingClientRect(), view = this.canvas.getBoundingClientRect();
    const bar = { l: tools.left - view.left, r: tools.right - view.left, t: tools.top - view.top, b: tools.bottom - view.top };
    const placed = [bar], shown = new Set();
    for (const one of candidates) {
      if (shown.size >= MOST_LABELS) break;
      const w = 7 * (one.o.class.length + String(one.id).length + 1) + 14;
      const box = { l: one.x - w / 2, r: one.x + w / 2, t: one.y - 20, b: one.y };
      if (placed.some((p) => p.l < box.r && p.r > box.l && p.t < box.b && p.b > box.t)) continue;
      placed.push(box);
      shown.add(one.id);
      this.placeName(one, box);
    }
    for (const [id, element] of this.names) {
      if (shown.has(id)) continue;
      element.remove();
      this.names.delete(id);
    }
  }

  placeName({ id, o }, box) {
    let element = this.names.get(id);
    if (!element) {
      this.names.set(id, (element = document.createElement('span')));
      this.labels.append(element);
    }
    const words = `${o.class} ${id}`, look = `${looksLike(o)}${id === this.chosen ? ' chosen' : ''}`;
    if (element.textContent !== words) element.textContent = words;
    if (element.className !== look) element.className = look;
    element.style.setProperty('--c', colourOf(o.class));
    element.style.transform = `translate(${box.l.toFixed(1)}px, ${box.t.toFixed(1)}px)`;
  }
}
