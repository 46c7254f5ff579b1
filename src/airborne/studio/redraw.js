// Draws a 3D scene when something in it has changed: NiceGUI draws 20 times a second, which busies a processor that must
// do without a graphics card. There a scene takes 100 ms, for which no picture is shown: it waits until nobody steps on.
// And fits the scene to its place, which NiceGUI does where the window changes, but not where a line comes above it.
import { THREE } from "nicegui-scene";

const SAME = 1e-6; // m, and of directions: a camera at rest drifts by rounding
const SLOW_MS = 80; // until the browser has drawn twice more: longer than four frames of a screen
const QUIET_MS = 150; // after the last frame: who steps on asks sooner for the next
const LEAST_SHARE = 0.05; // of the time in which it is drawn nonetheless, where frames follow one another

export default class Redraw {
  create_mesh(scene_id) {
    const place = getElement(scene_id), renderer = place?.renderer; // the scene is NiceGUI's; it is gone where the page was laid out anew
    if (!renderer) return new THREE.Group();
    new ResizeObserver(() => place.$el.clientHeight && place.resize()).observe(place.$el);
    const draw = renderer.render.bind(renderer);
    let drawn = [], took = 0, ended = -Infinity, stepped = -Infinity;
    const step = () => (stepped = performance.now());
    for (const name of ["airborne-frame", "airborne-shown"]) window.addEventListener(name, step);
    renderer.domElement.addEventListener("webglcontextrestored", () => (drawn = []));
    renderer.render = (scene, camera) => {
      const now = appearance(scene, camera, renderer.domElement);
      if (now.length === drawn.length && now.every((value, k) => !(Math.abs(value - drawn[k]) > SAME))) return;
      const begun = performance.now();
      if (took > SLOW_MS && begun - stepped < QUIET_MS && begun - ended < took / LEAST_SHARE) return;
      drawn = now;
      draw(scene, camera);
      requestAnimationFrame(() => requestAnimationFrame(() => { // what is drawn is put on a list, and waited for then
        ended = performance.now();
        took = ended - begun;
      }));
    };
    return new THREE.Group();
  }
}

function appearance(scene, camera, { width, height }) {
  scene.updateMatrixWorld();
  camera.updateMatrixWorld();
  const numbers = [width, height, ...camera.matrixWorld.elements, ...camera.projectionMatrix.elements];
  scene.traverseVisible(({ geometry, material, matrixWorld }) => {
    numbers.push(...matrixWorld.elements);
    if (geometry) numbers.push(geometry.id, geometry.attributes.position?.version);
    if (material) numbers.push(material.id, material.version, material.opacity, material.color?.getHex());
  });
  return numbers;
}
