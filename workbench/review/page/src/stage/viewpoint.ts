/** From where a face is looked at: as a direction and sizes relative to the face, so that faces can share one. */
import { Box3, type PerspectiveCamera, Vector3 } from "three";

export type Side = "front" | "left" | "right";

/** Degrees from top to bottom of the picture: long enough a lens that a face keeps its proportions. */
export const LENS = 22;
/** The face fills this much of the picture's height or width, whichever is tighter. */
const FILLED = 0.92;

export interface Viewpoint {
  /** Towards the camera, of length 1; +X is the subject's left, +Y up, +Z out of the face. */
  direction: Vector3;
  /** Of the camera, in distances at which the whole face is seen. */
  distance: number;
  /** Where it looks, from the middle of the face, in half heights of the face. */
  shift: Vector3;
}

/** The signer from the front, or from the signer's left or right side (three quarters: both eyes stay in sight). */
export function lookFrom(side: Side): Viewpoint {
  const angle = side === "front" ? 0 : side === "left" ? 1 : -1;
  return {
    direction: new Vector3(Math.sin(angle), 0.06, Math.cos(angle)).normalize(),
    distance: 1,
    shift: new Vector3(),
  };
}

/** The distance at which a face is seen whole in a picture of this width per height. */
function fitDistance(face: Box3, aspect: number): number {
  const size = face.getSize(new Vector3());
  const half = Math.tan((LENS * Math.PI) / 360);
  // Sideways a head is as deep as it is wide, so one width serves all sides.
  const needed = Math.max(size.y, Math.max(size.x, size.z) / Math.max(aspect, 0.01));
  return needed / FILLED / 2 / half + size.z / 2;
}

/** Put the camera at a viewpoint; returns where it looks. */
export function placeCamera(camera: PerspectiveCamera, face: Box3, view: Viewpoint): Vector3 {
  const target = face.getCenter(new Vector3()).addScaledVector(view.shift, halfHeight(face));
  const distance = view.distance * fitDistance(face, camera.aspect);
  camera.position.copy(target).addScaledVector(view.direction, distance);
  camera.near = Math.max(distance / 100, 1e-4);
  camera.far = distance * 10 + halfHeight(face) * 20;
  camera.lookAt(target);
  camera.updateProjectionMatrix();
  return target;
}

/** Read a camera's viewpoint: the opposite of placeCamera. */
export function readCamera(camera: PerspectiveCamera, face: Box3, target: Vector3): Viewpoint {
  const away = camera.position.clone().sub(target);
  return {
    direction: away.clone().normalize(),
    distance: away.length() / fitDistance(face, camera.aspect),
    shift: target.clone().sub(face.getCenter(new Vector3())).divideScalar(halfHeight(face)),
  };
}

function halfHeight(face: Box3): number {
  return Math.max((face.max.y - face.min.y) / 2, 1e-6);
}
