// Draws a 3D scene when something in it has changed: NiceGUI draws 20 times a second, which busies a processor that must
// do without a graphics card.
import { THREE } from "nicegui-scene";

const SAME = 1e-6; // m, and of directions: a camera at rest drifts by rounding

export default class Redraw {
  create_mesh(scene_id) {
    const { renderer } = getElement(scene_id), draw = renderer.render.bind(renderer); // the scene is NiceGUI's
    let drawn = [];
    renderer.domElement.addEventListener("webglcontextrestored", () => (drawn = []));
    renderer.render = (scene, camera) => {
      const now = appearance(scene, camera, renderer.domElement);
      if (now.length === drawn.length && now.every((value, k) => !(Math.abs(value - drawn[k]) > SAME))) return;
      drawn = now;
      draw(scene, camera);
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
