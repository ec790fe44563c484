/**
 * How the normals of a face turn with each of its shapes, so that its shading follows what it does.
 *
 * A rig's file holds displacements only. For each shape the normals of the displaced mesh are computed once, and their
 * difference from the neutral's is blended like the displacements: exact for one shape, close for several, and free
 * while playing. A shape moves a part of the face, so only the triangles that it touches are computed.
 */

/** Displacements below this, m, do not turn anything. */
const STILL = 1e-7;

/**
 * Return the change of the unit normals for each shape.
 *
 * @param positions (n_vertices · 3) of the neutral
 * @param corners (n_triangles · 3) vertices
 * @param shapes displacements of each shape, (n_vertices · 3)
 * @returns for each shape (n_vertices · 3), zero where nothing turns; area-weighted normals, and zero at a vertex
 *   whose triangles have no area
 */
export function computeMorphNormals(
  positions: ArrayLike<number>, corners: ArrayLike<number>, shapes: readonly ArrayLike<number>[],
): Float32Array[] {
  const nVertices = positions.length / 3;
  const nTriangles = Math.floor(corners.length / 3);
  const points = Float64Array.from(positions);
  const areas = new Float64Array(nTriangles * 3);
  const sums = new Float64Array(nVertices * 3);
  const normal = new Float64Array(3);
  for (let triangle = 0; triangle < nTriangles; triangle++) {
    computeArea(points, corners, triangle, normal);
    areas.set(normal, triangle * 3);
    for (let corner = 0; corner < 3; corner++) addTo(sums, corners[triangle * 3 + corner]!, normal);
  }
  const { starts, triangles } = findTriangles(nVertices, corners, nTriangles);
  const touched = new Uint8Array(nTriangles);
  const turned = new Uint8Array(nVertices);
  const moved = Float64Array.from(points);
  const newSums = Float64Array.from(sums);
  return shapes.map((shape) => {
    const change = new Float32Array(nVertices * 3);
    const movedVertices: number[] = [];
    const touchedTriangles: number[] = [];
    const turnedVertices: number[] = [];
    for (let vertex = 0; vertex < nVertices; vertex++) {
      const at = vertex * 3;
      const x = shape[at]!, y = shape[at + 1]!, z = shape[at + 2]!;
      if (Math.abs(x) <= STILL && Math.abs(y) <= STILL && Math.abs(z) <= STILL) continue;
      movedVertices.push(vertex);
      moved[at] = points[at]! + x;
      moved[at + 1] = points[at + 1]! + y;
      moved[at + 2] = points[at + 2]! + z;
      for (let i = starts[vertex]!; i < starts[vertex + 1]!; i++) {
        const triangle = triangles[i]!;
        if (touched[triangle] === 0) {
          touched[triangle] = 1;
          touchedTriangles.push(triangle);
        }
      }
    }
    for (const triangle of touchedTriangles) {
      computeArea(moved, corners, triangle, normal);
      for (let axis = 0; axis < 3; axis++) normal[axis]! -= areas[triangle * 3 + axis]!;
      for (let corner = 0; corner < 3; corner++) {
        const vertex = corners[triangle * 3 + corner]!;
        addTo(newSums, vertex, normal);
        if (turned[vertex] === 0) {
          turned[vertex] = 1;
          turnedVertices.push(vertex);
        }
      }
      touched[triangle] = 0;
    }
    for (const vertex of turnedVertices) {
      writeTurn(newSums, sums, vertex, change);
      turned[vertex] = 0;
      for (let i = vertex * 3; i < vertex * 3 + 3; i++) newSums[i] = sums[i]!;
    }
    for (const vertex of movedVertices) {
      for (let i = vertex * 3; i < vertex * 3 + 3; i++) moved[i] = points[i]!;
    }
    return change;
  });
}

/** Write twice the area of a triangle along its normal. */
function computeArea(points: Float64Array, corners: ArrayLike<number>, triangle: number, into: Float64Array): void {
  const a = corners[triangle * 3]! * 3, b = corners[triangle * 3 + 1]! * 3, c = corners[triangle * 3 + 2]! * 3;
  const ux = points[b]! - points[a]!, uy = points[b + 1]! - points[a + 1]!, uz = points[b + 2]! - points[a + 2]!;
  const vx = points[c]! - points[a]!, vy = points[c + 1]! - points[a + 1]!, vz = points[c + 2]! - points[a + 2]!;
  into[0] = uy * vz - uz * vy;
  into[1] = uz * vx - ux * vz;
  into[2] = ux * vy - uy * vx;
}

function addTo(sums: Float64Array, vertex: number, what: Float64Array): void {
  const at = vertex * 3;
  sums[at]! += what[0]!;
  sums[at + 1]! += what[1]!;
  sums[at + 2]! += what[2]!;
}

/** Write the difference of two directions, each of length 1. */
function writeTurn(now: Float64Array, before: Float64Array, vertex: number, change: Float32Array): void {
  const at = vertex * 3;
  const length = Math.hypot(now[at]!, now[at + 1]!, now[at + 2]!);
  const lengthBefore = Math.hypot(before[at]!, before[at + 1]!, before[at + 2]!);
  if (length === 0 || lengthBefore === 0) return;
  for (let i = at; i < at + 3; i++) change[i] = now[i]! / length - before[i]! / lengthBefore;
}

/** The triangles of each vertex: those of vertex v are triangles[starts[v]] to before triangles[starts[v + 1]]. */
function findTriangles(nVertices: number, corners: ArrayLike<number>, nTriangles: number) {
  const starts = new Uint32Array(nVertices + 1);
  for (let i = 0; i < nTriangles * 3; i++) starts[corners[i]! + 1]! += 1;
  for (let vertex = 0; vertex < nVertices; vertex++) starts[vertex + 1]! += starts[vertex]!;
  const filled = starts.slice(0, nVertices);
  const triangles = new Uint32Array(nTriangles * 3);
  for (let i = 0; i < nTriangles * 3; i++) {
    const vertex = corners[i]!;
    triangles[filled[vertex]!] = Math.floor(i / 3);
    filled[vertex]! += 1;
  }
  return { starts, triangles };
}
