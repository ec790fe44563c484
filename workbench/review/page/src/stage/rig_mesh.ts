/**
 * One part of a rig as it is drawn, with the weights that are on it.
 *
 * The graphics card blends the shapes; where there is none the processor does, see sparse_blend.ts.
 */
import { BufferAttribute, BufferGeometry, Color, DoubleSide, DynamicDrawUsage, Mesh, MeshLambertMaterial } from "three";
import type { RigPart } from "./rig_model";

/** Linear light, of the skin where a rig brings no colours. */
const SKIN = new Color(0.7, 0.46, 0.34);

export class RigMesh {
  readonly mesh: Mesh<BufferGeometry, MeshLambertMaterial>;
  readonly shapes: string[];
  /** A weight for each shape. */
  readonly weights: number[];
  readonly #part: RigPart;
  readonly #isBlendedHere: boolean;
  /** For each shape its column of the weights that are given; -1 where they have none. */
  readonly #columns: Int16Array;

  constructor(part: RigPart, isBlendedHere: boolean) {
    const material = new MeshLambertMaterial({ vertexColors: part.hasColours, side: DoubleSide });
    if (!part.hasColours) material.color.copy(SKIN);
    this.#part = part;
    this.#isBlendedHere = isBlendedHere;
    this.mesh = new Mesh(isBlendedHere ? copyNeutral(part.geometry) : part.geometry, material);
    // Its bounds are those of the neutral, and a face alone on its stage is never out of sight.
    this.mesh.frustumCulled = false;
    this.shapes = part.shapes;
    this.weights = this.mesh.morphTargetInfluences ?? part.shapes.map(() => 0);
    this.#columns = new Int16Array(part.shapes.length).fill(-1);
  }

  /** Say which shapes the columns of the weights are. */
  matchShapes(names: readonly string[]): void {
    this.shapes.forEach((shape, number) => (this.#columns[number] = names.indexOf(shape)));
  }

  /** Put weights on; what is not known (NaN, or null for all) counts as 0. */
  setWeights(values: Float32Array | null): void {
    let isChanged = false;
    for (let shape = 0; shape < this.#columns.length; shape++) {
      const column = this.#columns[shape]!;
      const given = column < 0 || values === null ? 0 : values[column]!;
      const weight = Number.isFinite(given) ? given : 0;
      isChanged ||= weight !== this.weights[shape];
      this.weights[shape] = weight;
    }
    if (!isChanged || !this.#isBlendedHere) return;
    const blends = this.#part.blends();
    for (const [name, blend] of [["position", blends.position], ["normal", blends.normal]] as const) {
      const attribute = this.mesh.geometry.getAttribute(name) as BufferAttribute;
      blend.write(this.weights, attribute.array as Float32Array);
      attribute.needsUpdate = true;
    }
  }

  dispose(): void {
    // Frees what the graphics card holds of it; another face that shows the rig sends it there again.
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }
}

/** The mesh without its shapes, with positions and normals that can be written anew. */
function copyNeutral(geometry: BufferGeometry): BufferGeometry {
  const copy = new BufferGeometry();
  copy.setIndex(geometry.getIndex());
  for (const name of ["position", "normal"] as const) {
    const values = (geometry.getAttribute(name).array as Float32Array).slice();
    copy.setAttribute(name, new BufferAttribute(values, 3).setUsage(DynamicDrawUsage));
  }
  const colours = geometry.getAttribute("color");
  if (colours !== undefined) copy.setAttribute("color", colours);
  return copy;
}
