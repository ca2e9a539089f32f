// Shapes of the classes, generated from the simulator's meshes (meshes/*.glb): in a box of 1 × 1 ×
// 1 about the origin, x forward, z up. COLOR_0 is the brightness of a part relative to the body.
import * as THREE from './vendor/three.module.js';

const NAMES = { car: 'car', van: 'van', truck: 'van', bus: 'van', toy: 'car', person: 'person', bicycle: 'bicycle',
  cyclist: 'bicycle', motorcycle: 'bicycle', chair: 'chair', 'dining table': 'table', monitor: 'monitor', couch: 'couch' };
const loaded = new Map(); // name → geometry, or a promise of it

/** Reads the single mesh of a binary glTF from our exporter. */
function readGlb(buffer) {
  const view = new DataView(buffer);
  if (view.getUint32(0, true) !== 0x46546c67) throw new Error('this is no binary glTF');
  const length = view.getUint32(12, true);
  const json = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 20, length)));
  const begin = 20 + length + 8;
  const array = (index) => {
    const accessor = json.accessors[index], part = json.bufferViews[accessor.bufferView];
    const at = begin + part.byteOffset + (accessor.byteOffset ?? 0);
    const width = { SCALAR: 1, VEC3: 3 }[accessor.type];
    const Type = { 5126: Float32Array, 5125: Uint32Array, 5123: Uint16Array }[accessor.componentType];
    return new THREE.BufferAttribute(new Type(buffer.slice(at, at + accessor.count * width * Type.BYTES_PER_ELEMENT)), width);
  };
  const primitive = json.meshes[0].primitives[0];
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', array(primitive.attributes.POSITION));
  geometry.setAttribute('normal', array(primitive.attributes.NORMAL));
  geometry.setAttribute('color', array(primitive.attributes.COLOR_0));
  geometry.setIndex(array(primitive.indices));
  return geometry;
}

/** Calls `ready(geometry)` at once or after loading; never if the class has no shape. */
export function shapeOf(className, ready) {
  const name = NAMES[className];
  if (!name) return;
  if (!loaded.has(name)) {
    loaded.set(name, fetch(`meshes/${name}.glb`)
      .then((answer) => (answer.ok ? answer.arrayBuffer() : Promise.reject(new Error(answer.status))))
      .then((buffer) => { const geometry = readGlb(buffer); loaded.set(name, geometry); return geometry; })
      .catch((error) => { console.warn(`no shape of ${name}: ${error.message}`); return null; }));
  }
  const found = loaded.get(name);
  if (found instanceof Promise) found.then((geometry) => geometry && ready(geometry));
  else if (found) ready(found);
}
