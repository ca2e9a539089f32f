// Rotates, moves and zooms the view about a point, with z up, by mouse, touch and keys.
import * as THREE from './vendor/three.module.js';

export class Orbit {
  constructor(camera, element, onMoved) {
    this.camera = camera;
    this.element = element;
    this.onMoved = onMoved;
    this.target = new THREE.Vector3();
    this.distance = 28;
    this.azimuth = Math.PI; // angle of the camera about the target
    this.polar = 1.02; // angle from the vertical
    this.pointers = new Map();
    this.travelled = 0;
    element.addEventListener('pointerdown', (e) => this.down(e));
    element.addEventListener('pointermove', (e) => this.move(e));
    for (const end of ['pointerup', 'pointercancel']) element.addEventListener(end, (e) => this.pointers.delete(e.pointerId));
    element.addEventListener('wheel', (e) => { e.preventDefault(); this.zoom(Math.exp(0.0012 * e.deltaY)); }, { passive: false });
    element.addEventListener('contextmenu', (e) => e.preventDefault());
    element.addEventListener('keydown', (e) => this.key(e));
  }

  down(e) {
    this.element.setPointerCapture(e.pointerId);
    this.pointers.set(e.pointerId, { x: e.clientX, y: e.clientY, button: e.button });
    if (this.pointers.size === 1) this.travelled = 0;
  }

  move(e) {
    const before = this.pointers.get(e.pointerId);
    if (!before) return;
    const dx = e.clientX - before.x, dy = e.clientY - before.y;
    const spread = () => {
      const [a, b] = [...this.pointers.values()];
      return Math.hypot(a.x - b.x, a.y - b.y);
    };
    const pinch = this.pointers.size === 2, from = pinch ? spread() : 0;
    before.x = e.clientX;
    before.y = e.clientY;
    this.travelled += Math.abs(dx) + Math.abs(dy);
    if (pinch) {
      this.zoom(from / Math.max(1, spread()));
      this.shift(dx / 2, dy / 2);
    } else if (before.button === 2 || before.button === 1 || e.shiftKey) {
      this.shift(dx, dy);
    } else {
      this.turn(-0.006 * dx, -0.006 * dy);
    }
  }

  key(e) {
    const step = { ArrowLeft: [-0.08, 0], ArrowRight: [0.08, 0] }[e.key];
    if (step) this.turn(...step);
    else if (e.key === '+' || e.key === '=') this.zoom(0.87);
    else if (e.key === '-') this.zoom(1.15);
    else return;
    e.preventDefault();
  }

  turn(azimuth, polar) {
    this.azimuth += azimuth;
    this.polar = Math.min(1.54, Math.max(0.02, this.polar + polar));
    this.onMoved();
  }

  zoom(factor) {
    this.distance = Math.min(800, Math.max(1.5, this.distance * factor));
    this.onMoved();
  }

  shift(dx, dy) {
    const scale = (1.2 * this.distance) / this.element.clientHeight;
    const c = Math.cos(this.azimuth), s = Math.sin(this.azimuth);
    // Moves to the right and forward, on the ground.
    this.target.x += scale * (dx * s - dy * c);
    this.target.y += scale * (-dx * c - dy * s);
    this.onMoved(true);
  }

  apply() {
    const flat = this.distance * Math.sin(this.polar);
    this.camera.position.set(
      this.target.x + flat * Math.cos(this.azimuth),
      this.target.y + flat * Math.sin(this.azimuth),
      this.target.z + this.distance * Math.cos(this.polar),
    );
    this.camera.lookAt(this.target);
  }
}
