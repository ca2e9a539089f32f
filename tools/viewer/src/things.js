// Draws one object in the 3D map: its shape or box, its outline and its ellipsoid.
import * as THREE from './vendor/three.module.js';
import { shapeOf } from './meshes.js';
import { colourOf, isHidden, isInSight } from './words.js';

const BOX = new THREE.BoxGeometry(1, 1, 1);
BOX.setAttribute('color', new THREE.BufferAttribute(new Float32Array(3 * BOX.attributes.position.count).fill(1), 3));
const SPHERE = new THREE.SphereGeometry(1, 20, 12);
const UP = new THREE.Vector3(0, 0, 1), PALE = new THREE.Color('#c4d0dc');

/** Returns the edges of a box. Dashes are about 0.3 m long, whatever the length of the edge. */
export function outline(size, dashed) {
  const [l, w, h] = size.map((s) => s / 2);
  const corner = (i) => new THREE.Vector3(i & 1 ? l : -l, i & 2 ? w : -w, i & 4 ? h : -h);
  const edges = [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]]
    .map(([a, b]) => [corner(a), corner(b)]);
  edges.push([new THREE.Vector3(0, 0, -h), new THREE.Vector3(l, 0, -h)]); // front of the object
  const points = [];
  for (const [a, b] of edges) {
    const strokes = dashed ? Math.min(30, Math.max(2, Math.round(a.distanceTo(b) / 0.32))) : 1;
    const unit = 1 / (2 * strokes - 1);
    for (let i = 0; i < strokes; ++i) {
      points.push(a.clone().lerp(b, 2 * i * unit), a.clone().lerp(b, (2 * i + 1) * unit));
    }
  }
  return new THREE.BufferGeometry().setFromPoints(points);
}

/** Returns axes (a rotation) and variances of a symmetric matrix [xx xy xz yy yz zz], by
    Jacobi. */
export function eigenOf([xx, xy, xz, yy, yz, zz]) {
  const a = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], v = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
  for (let sweep = 0; sweep < 12; ++sweep) {
    for (const [p, q] of [[0, 1], [0, 2], [1, 2]]) {
      if (Math.abs(a[p][q]) < 1e-14) continue;
      const theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
      const t = Math.sign(theta || 1) / (Math.abs(theta) + Math.hypot(theta, 1));
      const c = 1 / Math.hypot(t, 1), s = t * c;
      for (let k = 0; k < 3; ++k) [a[k][p], a[k][q]] = [c * a[k][p] - s * a[k][q], s * a[k][p] + c * a[k][q]];
      for (let k = 0; k < 3; ++k) [a[p][k], a[q][k]] = [c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]];
      for (let k = 0; k < 3; ++k) [v[k][p], v[k][q]] = [c * v[k][p] - s * v[k][q], s * v[k][p] + c * v[k][q]];
    }
  }
  const column = (i) => new THREE.Vector3(v[0][i], v[1][i], v[2][i]);
  const axes = new THREE.Matrix4().makeBasis(column(0), column(1), column(2));
  if (axes.determinant() < 0) axes.makeBasis(column(0).negate(), column(1), column(2));
  return { axes, variances: [a[0][0], a[1][1], a[2][2]].map((x) => Math.max(0, x)) };
}

export class Thing {
  constructor(object, remembered) {
    this.group = new THREE.Group();
    this.remembered = remembered;
    this.material = new THREE.MeshStandardMaterial({ vertexColors: true, roughness: 0.65, metalness: 0.05, transparent: true });
    this.body = new THREE.Mesh(BOX, this.material);
    this.lineMaterial = new THREE.LineBasicMaterial({ transparent: true });
    this.lines = new THREE.LineSegments(new THREE.BufferGeometry(), this.lineMaterial);
    this.ellipsoid = new THREE.Mesh(SPHERE, new THREE.MeshBasicMaterial({ color: 0xffffff, transparent: true, opacity: 0.16, depthWrite: false }));
    this.group.add(this.body, this.lines);
    this.outlined = '';
    this.update(object, UP);
  }

  update(object, up) {
    this.object = object;
    if (this.className !== object.class) {
      this.className = object.class;
      this.colour = new THREE.Color(colourOf(object.class));
      if (this.remembered) this.colour.lerp(PALE, 0.45);
      this.body.geometry = BOX;
      shapeOf(object.class, (geometry) => { if (this.className === object.class) this.body.geometry = geometry; });
    }
    const q = new THREE.Quaternion().setFromUnitVectors(UP, up);
    q.multiply(new THREE.Quaternion().setFromAxisAngle(UP, object.yaw));
    this.group.position.fromArray(object.c);
    this.group.quaternion.copy(q);
    this.body.scale.fromArray(object.size);
    this.look();
    this.setEllipsoid(object);
  }

  look() {
    const o = this.object, hidden = !this.remembered && isHidden(o), seen = !this.remembered && isInSight(o);
    const known = Math.max(0.25, o.r) * (o.confirmed ? 1 : 0.5);
    const dashed = hidden || Boolean(this.remembered && o.provisional);
    this.body.visible = !hidden;
    this.material.opacity = seen ? Math.min(1, 0.35 + 0.65 * known) : (this.remembered ? 0.14 : 0.28) * known;
    this.material.depthWrite = seen;
    this.material.color.copy(this.tinted ?? this.colour);
    this.material.emissive.copy(this.chosen ? this.colour : new THREE.Color(0)).multiplyScalar(0.45);
    // An occluded object is drawn over its occluder.
    this.lineMaterial.depthTest = !hidden;
    this.lines.renderOrder = hidden ? 5 : 1;
    this.lineMaterial.color.copy(this.tinted ?? (hidden ? new THREE.Color('#ffd98a') : this.colour)).lerp(new THREE.Color('#ffffff'), this.chosen ? 0.7 : 0.15);
    this.lineMaterial.opacity = this.chosen ? 1 : hidden ? 0.95 : seen ? 0.55 * known : this.remembered ? 0.4 : 0.5;
    const wanted = `${dashed}/${o.size.map((s) => s.toFixed(2)).join()}`;
    if (wanted === this.outlined) return;
    this.outlined = wanted;
    this.lines.geometry.dispose();
    this.lines.geometry = outline(o.size, dashed);
  }

  setEllipsoid(object) {
    const { axes, variances } = eigenOf(object.cov);
    this.ellipsoid.position.fromArray(object.c);
    this.ellipsoid.quaternion.setFromRotationMatrix(axes);
    this.ellipsoid.scale.fromArray(variances.map((x) => Math.min(20, Math.max(0.01, 2 * Math.sqrt(x)))));
    // An ellipsoid larger than its object must not hide the surroundings.
    const size = Math.max(...object.size) / 2, axis = Math.max(...this.ellipsoid.scale.toArray());
    this.ellipsoid.material.opacity = 0.16 * Math.min(1, Math.max(0.25, size / axis));
  }

  /** Replaces the colour of the class; undefined: not any more. */
  tint(colour) {
    this.tinted = colour && new THREE.Color(colour);
    this.look();
  }

  choose(chosen) {
    this.chosen = chosen;
    this.look();
  }

  dispose() {
    this.material.dispose();
    this.lineMaterial.dispose();
    this.lines.geometry.dispose();
    this.ellipsoid.material.dispose();
  }
}
