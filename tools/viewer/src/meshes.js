// Shapes of the classes, generated from the simulator's meshes (meshes/*.json). A shape fills a box of
// 1 × 1 × 1 about the origin, x forward, z up. Its colours are the brightness relative to the body.
import * as THREE from './vendor/three.module.js';

const NAMES = { car: 'car', van: 'van', truck: 'van', bus: 'van', toy: 'car', person: 'person', bicycle: 'bicycle',
  cyclist: 'bicycle', motorcycle: 'bicycle', chair: 'chair', 'dining table': 'table', monitor: 'monitor', couch: 'couch' };
const loaded = new Map(); // name → geometry, or a promise of it

/** Calls `ready(geometry)` at once or after loading. Does not call it for classes without shape. */
export function shapeOf(className, ready) {
  const name = NAMES[className];
  if (!name) return;
  if (!loaded.has(name)) {
    loaded.set(name, new THREE.BufferGeometryLoader().loadAsync(`meshes/${name}.json`)
      .then((geometry) => { loaded.set(name, geometry); return geometry; })
      .catch((error) => { console.warn(`no shape of ${name}: ${error.message}`); return null; }));
  }
  const found = loaded.get(name);
  if (found instanceof Promise) found.then((geometry) => geometry && ready(geometry));
  else if (found) ready(found);
}
