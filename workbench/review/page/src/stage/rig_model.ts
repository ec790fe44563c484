/** A rig as the server sends it (glTF, metres), made ready to be drawn: its parts, its shapes, how normals turn. */
import { Box3, BufferAttribute, type BufferGeometry, Mesh, Vector3 } from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { getBytes } from "../api/client";
import { computeMorphNormals } from "./morph_normals";
import { SparseBlend } from "./sparse_blend";

/** A mesh of the rig. Geometry is shared by all views that show the rig. */
export interface RigPart {
  geometry: BufferGeometry;
  /** Names of the shapes that move it, in the order of its morph targets. */
  shapes: string[];
  hasColours: boolean;
  /** The same shapes for a processor to blend; made when first asked for. */
  blends: () => { position: SparseBlend; normal: SparseBlend };
}

export interface RigModel {
  name: string;
  parts: RigPart[];
  nVertices: number;
  /** What a person looks at, in m: what the shapes move, up to the crown, as wide as the skull; no shoulders. */
  head: Box3;
}

/** m that a shape has to move a vertex for it to be part of what people look at. */
const VISIBLE = 5e-3;
/** Heights of the moving part that the crown may lie above it, and what is added where it lies higher. */
const CROWN = 1;
const FOREHEAD = 0.28;
/** Heights of the moving part that a skull may be wider than it, to each side. */
const SKULL = 0.5;
/**
 * What nobody sees and a processor need not blend: 0.05 mm, about a tenth of a picture's point, and a normal's turn of
 * half a degree. Real rigs have many such traces of their making: on one of 11 248 vertices two thirds of all changes.
 */
const UNSEEN = { position: 5e-5, normal: 1e-2 };
/** Rigs that are kept; a session looks at one or two. */
const KEPT = 3;
const kept = new Map<string, Promise<RigModel>>();

/** Fetch a rig, once for all who show it. */
export function loadRig(name: string): Promise<RigModel> {
  const known = kept.get(name);
  if (known !== undefined) return known;
  const coming = getBytes("/api/rig", { rig: name }, { timeout: 120_000 }).then((bytes) => parseRig(name, bytes));
  kept.set(name, coming);
  // What failed is asked for again by whoever comes next.
  coming.catch(() => kept.delete(name));
  for (const oldest of kept.keys()) {
    if (kept.size <= KEPT) break;
    kept.delete(oldest);
  }
  return coming;
}

/** Read the bytes of a .glb file. */
export async function parseRig(name: string, bytes: ArrayBuffer): Promise<RigModel> {
  const parsed = await new GLTFLoader().parseAsync(bytes, "");
  const parts: RigPart[] = [];
  parsed.scene.updateMatrixWorld(true);
  parsed.scene.traverse((object) => {
    if (object instanceof Mesh) parts.push(makePart(object as Mesh<BufferGeometry>));
  });
  if (parts.length === 0) throw new Error(`The rig ${name} holds no mesh.`);
  const nVertices = parts.reduce((sum, part) => sum + part.geometry.getAttribute("position").count, 0);
  return { name, parts, nVertices, head: findHead(parts) };
}

function makePart(mesh: Mesh<BufferGeometry>): RigPart {
  const geometry = mesh.geometry;
  const targets = geometry.morphAttributes.position ?? [];
  const index = geometry.getIndex();
  if (targets.length > 0 && geometry.morphAttributes.normal === undefined && index !== null) {
    const positions = geometry.getAttribute("position").array;
    const changes = computeMorphNormals(positions, index.array, targets.map((one) => one.array));
    geometry.morphAttributes.normal = changes.map((change) => new BufferAttribute(change, 3));
  }
  if (geometry.getAttribute("normal") === undefined) geometry.computeVertexNormals();
  const names = mesh.morphTargetDictionary ?? {};
  const shapes = targets.map((_, number) => Object.keys(names).find((name) => names[name] === number) ?? "");
  let blends: ReturnType<RigPart["blends"]> | null = null;
  return {
    geometry,
    shapes,
    hasColours: geometry.getAttribute("color") !== undefined,
    blends: () => (blends ??= { position: makeBlend(geometry, "position"), normal: makeBlend(geometry, "normal") }),
  };
}

function makeBlend(geometry: BufferGeometry, name: "position" | "normal"): SparseBlend {
  const changes = geometry.morphAttributes[name] ?? [];
  const neutral = geometry.getAttribute(name).array as Float32Array;
  return new SparseBlend(neutral, changes.map((one) => one.array), UNSEEN[name]);
}

/**
 * The box of the head: what the shapes move, up to the crown and as wide as the skull. Around everything where no shape
 * moves anything.
 */
function findHead(parts: RigPart[]): Box3 {
  const face = new Box3();
  const everything = new Box3();
  const point = new Vector3();
  for (const { geometry } of parts) {
    const position = geometry.getAttribute("position");
    const targets = geometry.morphAttributes.position ?? [];
    for (let vertex = 0; vertex < position.count; vertex++) {
      point.fromBufferAttribute(position, vertex);
      everything.expandByPoint(point);
      const moves = targets.some(({ array }) => {
        const at = vertex * 3;
        return Math.abs(array[at]!) + Math.abs(array[at + 1]!) + Math.abs(array[at + 2]!) > VISIBLE;
      });
      if (moves) face.expandByPoint(point);
    }
  }
  if (face.isEmpty()) return everything;
  const height = face.max.y - face.min.y;
  // Raised hands or a hat would make the head small: then the forehead has to do.
  const crown = everything.max.y - face.max.y <= CROWN * height ? everything.max.y : face.max.y + FOREHEAD * height;
  const head = face.clone();
  head.max.y = crown;
  // Above the middle of the face stands the skull alone: no shoulders, no arms.
  const middle = (face.min.y + face.max.y) / 2;
  const reach = SKULL * height;
  for (const { geometry } of parts) {
    const position = geometry.getAttribute("position");
    for (let vertex = 0; vertex < position.count; vertex++) {
      point.fromBufferAttribute(position, vertex);
      const isBeside = point.x < face.min.x - reach || point.x > face.max.x + reach || point.z < face.min.z - 2 * reach;
      if (point.y >= middle && point.y <= crown && !isBeside) head.expandByPoint(point);
    }
  }
  return head;
}
