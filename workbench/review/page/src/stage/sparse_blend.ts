/**
 * A mesh's numbers (positions, normals) as the neutral plus a weighted sum of shapes, computed by the processor.
 *
 * Where there is no graphics card the blend costs it many times what it costs here, because here only the vertices that
 * a shape moves, and only the shapes that act, are looked at.
 */
export class SparseBlend {
  readonly #neutral: Float32Array;
  readonly #shapes: { vertices: Uint32Array; changes: Float32Array }[];

  /**
   * @param neutral (n_vertices · 3)
   * @param shapes the change that each shape makes, (n_vertices · 3)
   * @param least changes of a vertex that are at most as long as this are left out
   */
  constructor(neutral: Float32Array, shapes: readonly ArrayLike<number>[], least = 0) {
    this.#neutral = neutral;
    this.#shapes = shapes.map((shape) => {
      const vertices: number[] = [];
      const changes: number[] = [];
      for (let at = 0; at < neutral.length; at += 3) {
        const x = shape[at]!, y = shape[at + 1]!, z = shape[at + 2]!;
        if (x * x + y * y + z * z <= least * least) continue;
        vertices.push(at / 3);
        changes.push(x, y, z);
      }
      return { vertices: Uint32Array.from(vertices), changes: Float32Array.from(changes) };
    });
  }

  /** Write the blend (n_vertices · 3); there is one weight for each shape. */
  write(weights: ArrayLike<number>, into: Float32Array): void {
    into.set(this.#neutral);
    for (let shape = 0; shape < this.#shapes.length; shape++) {
      const weight = weights[shape]!;
      if (weight === 0) continue;
      const { vertices, changes } = this.#shapes[shape]!;
      for (let i = 0, from = 0; i < vertices.length; i++, from += 3) {
        const to = vertices[i]! * 3;
        into[to] = into[to]! + weight * changes[from]!;
        into[to + 1] = into[to + 1]! + weight * changes[from + 1]!;
        into[to + 2] = into[to + 2]! + weight * changes[from + 2]!;
      }
    }
  }
}
