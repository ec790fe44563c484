/** Markers over a face: small spheres where the cameras saw them, in the space of the rig. */
import { DynamicDrawUsage, InstancedMesh, Matrix4, MeshBasicMaterial, SphereGeometry } from "three";

/** Of a sphere, m: about what is glued on. */
const RADIUS = 0.0018;
const METRES = 1e-3;
/** Dark blue: seen on every skin, also by those who see few colours. */
const COLOUR = 0x0b4f8a;

export class MarkerCloud {
  readonly mesh: InstancedMesh;
  readonly #place = new Matrix4();
  /** Of how many markers, seen or not. */
  readonly capacity: number;

  constructor(nMarkers: number) {
    const material = new MeshBasicMaterial({ color: COLOUR });
    this.capacity = nMarkers;
    this.mesh = new InstancedMesh(new SphereGeometry(RADIUS, 10, 8), material, Math.max(1, nMarkers));
    this.mesh.instanceMatrix.setUsage(DynamicDrawUsage);
    // Spheres move; a bounding volume of where they were would hide them.
    this.mesh.frustumCulled = false;
    this.mesh.count = 0;
  }

  /** How many are seen. */
  get count(): number {
    return this.mesh.count;
  }

  /** Show markers (n_markers · 3, mm); those that were not seen (NaN) are left out. Null hides all. */
  show(positions: Float32Array | null): void {
    let seen = 0;
    if (positions !== null) {
      for (let marker = 0; marker < this.capacity; marker++) {
        const x = positions[marker * 3]!, y = positions[marker * 3 + 1]!, z = positions[marker * 3 + 2]!;
        if (!Number.isFinite(x + y + z)) continue;
        this.#place.makeTranslation(x * METRES, y * METRES, z * METRES);
        this.mesh.setMatrixAt(seen, this.#place);
        seen += 1;
      }
    }
    this.mesh.count = seen;
    this.mesh.visible = seen > 0;
    this.mesh.instanceMatrix.needsUpdate = true;
  }

  dispose(): void {
    this.mesh.geometry.dispose();
    (this.mesh.material as MeshBasicMaterial).dispose();
    this.mesh.dispose();
  }
}
