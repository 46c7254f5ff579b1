// Handles in a 3D scene: arrows along the world's axes move a body, rings about its own axes turn it.
import { THREE } from "nicegui-scene";

const COLOURS = [0xd55e00, 0x009e73, 0x0072b2]; // x, y, z
const AXES = [new THREE.Vector3(1, 0, 0), new THREE.Vector3(0, 1, 0), new THREE.Vector3(0, 0, 1)];
const THIN = 0.015, THICK = 0.08; // of the size: what is drawn, and what is grabbed
const EDGE_ON = 0.15; // cosine of the angle at which a ring is too narrow to be turned by its plane

export default class Gizmo {
  create_mesh(scene_id, size) {
    this.view = getElement(scene_id); // NiceGUI's
    this.size = size;
    this.handles = [];
    this.mesh = new THREE.Group();
    const arrows = new THREE.Group(), rings = new THREE.Group(), { mesh } = this;
    arrows.updateMatrixWorld = function (force) { // along the world's axes, however the body lies
      this.quaternion.copy(mesh.quaternion).invert();
      THREE.Group.prototype.updateMatrixWorld.call(this, force);
    };
    AXES.forEach((axis, k) => {
      const along = new THREE.Quaternion().setFromUnitVectors(AXES[1], axis), around = new THREE.Quaternion().setFromUnitVectors(AXES[2], axis);
      this.add(arrows, k, false, [new THREE.CylinderGeometry(THIN * size, THIN * size, size), new THREE.ConeGeometry(4 * THIN * size, 10 * THIN * size)],
        [axis.clone().multiplyScalar(size / 2), axis.clone().multiplyScalar(size)], along);
      this.add(rings, k, true, [new THREE.TorusGeometry(0.7 * size, THIN * size, 8, 64)], [new THREE.Vector3()], around);
    });
    this.mesh.add(arrows, rings);
    const { $el } = this.view; // its listeners come before those of the canvas, which turn the camera
    $el.addEventListener("pointerdown", (event) => this.take(event), { capture: true });
    $el.addEventListener("pointermove", (event) => this.follow(event), { capture: true });
    $el.addEventListener("pointerup", (event) => this.release(event), { capture: true });
    return this.mesh;
  }
  add(group, k, turns, geometries, places, quaternion) {
    const axis = AXES[k], material = new THREE.MeshBasicMaterial({ color: COLOURS[k], depthTest: false, transparent: true, opacity: 0.75 });
    const grabbed = turns ? new THREE.TorusGeometry(0.7 * this.size, THICK * this.size, 6, 32) : new THREE.CylinderGeometry(THICK * this.size, THICK * this.size, 0.75 * this.size);
    const unseen = new THREE.MeshBasicMaterial({ visible: false, side: THREE.DoubleSide });
    const parts = geometries.map((geometry, n) => [new THREE.Mesh(geometry, material), places[n]]);
    const grip = new THREE.Mesh(grabbed, unseen); // the arrow's from where the rings are no longer in the way
    for (const [part, place] of [...parts, [grip, turns ? places[0] : axis.clone().multiplyScalar(0.75 * this.size)]]) {
      part.position.copy(place);
      part.quaternion.copy(quaternion);
      part.renderOrder = 1;
      group.add(part);
    }
    grip.handle = { k, turns, material };
    this.handles.push(grip);
  }
  ray(event) {
    const { domElement } = this.view.renderer, box = domElement.getBoundingClientRect(), caster = new THREE.Raycaster();
    const at = new THREE.Vector2((2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height);
    caster.setFromCamera(at, this.view.camera);
    return caster;
  }
  under(event) {
    const hit = this.mesh.visible && this.mesh.parent && this.ray(event).intersectObjects(this.handles)[0];
    return hit ? hit.object.handle : null;
  }
  take(event) {
    const handle = event.button === 0 ? this.under(event) : null;
    if (!handle) return;
    event.stopPropagation();
    this.view.$el.setPointerCapture(event.pointerId);
    const turned = handle.turns ? this.mesh.quaternion : new THREE.Quaternion();
    const [axis, right] = [0, 1].map((n) => AXES[(handle.k + n) % 3].clone().applyQuaternion(turned));
    this.drag = { ...handle, axis, right, from: this.mesh.position.clone(), turned: this.mesh.quaternion.clone() };
    this.drag.edgeOn = Math.abs(axis.dot(this.ray(event).ray.direction)) < EDGE_ON;
    this.drag.start = this.measure(event);
  }
  measure(event) { // how far along the axis [m], or around it [rad]
    const { ray } = this.ray(event), { axis, right, from, turns, edgeOn } = this.drag, away = from.clone().sub(ray.origin);
    const cosine = axis.dot(ray.direction);
    if (!turns) return (cosine * away.dot(ray.direction) - axis.dot(away)) / Math.max(1 - cosine * cosine, 1e-3); // the point of the axis nearest to the ray
    if (edgeOn) { // seen from its edge it turns as a wheel does, by its rim
      const near = ray.origin.clone().addScaledVector(ray.direction, away.dot(ray.direction)).sub(from);
      return near.dot(axis.clone().cross(ray.direction)) / (-0.7 * this.size);
    }
    const at = ray.origin.clone().addScaledVector(ray.direction, away.dot(axis) / cosine).sub(from);
    return Math.atan2(at.dot(axis.clone().cross(right)), at.dot(right));
  }
  follow(event) {
    const { drag } = this;
    if (!drag) {
      const handle = event.buttons ? null : this.under(event);
      for (const grip of this.handles) grip.handle.material.opacity = grip.handle === handle ? 1 : 0.75;
      this.view.$el.style.cursor = handle ? "grab" : "";
      return;
    }
    event.stopPropagation();
    const by = this.measure(event) - drag.start;
    if (drag.turns) this.mesh.quaternion.copy(new THREE.Quaternion().setFromAxisAngle(drag.axis, by)).multiply(drag.turned);
    else this.mesh.position.copy(drag.from).addScaledVector(drag.axis, by);
    this.tell(false);
  }
  release(event) {
    if (!this.drag) return;
    event.stopPropagation();
    this.drag = null;
    this.tell(true);
  }
  tell(ended) {
    this.view.$emit("gizmo", { position: this.mesh.position.toArray(), quaternion: this.mesh.quaternion.toArray(), ended });
  }
}
