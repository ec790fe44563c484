import { beforeAll, describe, expect, it } from "vitest";
import { RigMesh } from "./rig_mesh";
import { parseRig } from "./rig_model";

// three asks for the window's name where a browser has it.
beforeAll(() => void Object.assign(globalThis, { self: globalThis }));

/** A .glb of one sheet of 3 by 2 vertices, and two shapes; by hand after the glTF 2.0 specification. */
function makeFile(names = ["jawOpen", "mouth/Smile é"], top = 0.2): ArrayBuffer {
  const neutral = Float32Array.of(0, 0, 0, 0.1, 0, 0, 0, 0.1, 0, 0.1, 0.1, 0, 0, top, 0, 0.1, top, 0);
  const normals = Float32Array.from({ length: 18 }, (_, i) => (i % 3 === 2 ? 1 : 0));
  const first = new Float32Array(18), second = new Float32Array(18);
  first.set([0, -0.02, 0, 0, -0.02, 0]);
  second.set([0, 0, 0.05], 6);
  second[17] = 1e-6;
  const corners = Uint16Array.of(0, 1, 2, 1, 3, 2, 2, 3, 4, 3, 5, 4);
  const pieces = [neutral, normals, first, second, corners];
  let length = 0;
  const views = pieces.map((piece) => {
    const view = { buffer: 0, byteOffset: length, byteLength: piece.byteLength };
    length += piece.byteLength;
    return view;
  });
  const bounds = { min: [-1, -1, -1], max: [1, 1, 1] };
  const vectors = (view: number) => ({ bufferView: view, componentType: 5126, count: 6, type: "VEC3", ...bounds });
  const indices = { bufferView: 4, componentType: 5123, count: 12, type: "SCALAR" };
  const json = JSON.stringify({
    asset: { version: "2.0" },
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0 }],
    meshes: [{
      primitives: [{ attributes: { POSITION: 0, NORMAL: 1 }, indices: 4, targets: [{ POSITION: 2 }, { POSITION: 3 }] }],
      extras: { targetNames: names },
    }],
    accessors: [...[0, 1, 2, 3].map(vectors), indices],
    bufferViews: views,
    buffers: [{ byteLength: length }],
  });
  const written = new TextEncoder().encode(json);
  const text = new Uint8Array(Math.ceil(written.length / 4) * 4).fill(32);
  text.set(written);
  const file = new Uint8Array(12 + 8 + text.length + 8 + length);
  const numbers = new DataView(file.buffer);
  [0x46546c67, 2, file.length, text.length, 0x4e4f534a].forEach((one, i) => numbers.setUint32(i * 4, one, true));
  file.set(text, 20);
  numbers.setUint32(20 + text.length, length, true);
  numbers.setUint32(24 + text.length, 0x004e4942, true);
  pieces.forEach((piece, i) => file.set(new Uint8Array(piece.buffer), 28 + text.length + views[i]!.byteOffset));
  return file.buffer;
}

describe("a rig's file", () => {
  it("is read with the names of its shapes, whatever they are", async () => {
    const rig = await parseRig("sheet", makeFile());
    expect(rig.nVertices).toBe(6);
    expect(rig.parts[0]!.shapes).toEqual(["jawOpen", "mouth/Smile é"]);
    expect(rig.parts[0]!.hasColours).toBe(false);
  });

  it("shows what moves, up to the crown", async () => {
    const { head } = await parseRig("sheet", makeFile());
    expect([head.min.y, head.max.x]).toEqual([0, Math.fround(0.1)]);
    expect(head.max.y).toBeCloseTo(0.2, 6);
  });

  it("leaves out a hat that is higher than the face", async () => {
    const { head } = await parseRig("sheet", makeFile(undefined, 0.5));
    expect(head.max.y).toBeCloseTo(0.128, 6);
  });

  it("turns normals with each shape", async () => {
    const [part] = (await parseRig("sheet", makeFile())).parts;
    const [slide, lift] = part!.geometry.morphAttributes.normal!;
    // Sliding within its plane turns nothing; lifting one corner does.
    expect(Math.max(...Array.from(slide!.array, Math.abs))).toBeLessThan(1e-6);
    expect(Math.max(...Array.from(lift!.array, Math.abs))).toBeGreaterThan(0.1);
  });

  it("is refused where there is nothing to show", async () => {
    await expect(parseRig("x", new ArrayBuffer(8))).rejects.toThrow();
  });
});

describe("a rig's mesh", () => {
  it.each([false, true])("takes weights by name, in any order (processor: %s)", async (isBlendedHere) => {
    const [part] = (await parseRig("sheet", makeFile())).parts;
    const mesh = new RigMesh(part!, isBlendedHere);
    mesh.matchShapes(["other", "mouth/Smile é", "jawOpen"]);
    mesh.setWeights(Float32Array.of(9, 0.5, 0.25));
    expect(mesh.weights).toEqual([0.25, 0.5]);
    if (isBlendedHere) {
      const position = mesh.mesh.geometry.getAttribute("position");
      expect(position.getY(0)).toBeCloseTo(-0.005, 6);
      expect(position.getZ(2)).toBeCloseTo(0.025, 6);
      expect(mesh.mesh.geometry.getAttribute("normal").getX(2)).not.toBe(0);
    } else {
      expect(mesh.mesh.morphTargetInfluences).toEqual([0.25, 0.5]);
    }
  });

  it("shows the neutral where weights are not known or not given", async () => {
    const [part] = (await parseRig("sheet", makeFile())).parts;
    const mesh = new RigMesh(part!, true);
    mesh.matchShapes(["jawOpen"]);
    mesh.setWeights(Float32Array.of(1));
    expect(mesh.weights).toEqual([1, 0]);
    mesh.setWeights(Float32Array.of(NaN));
    expect(mesh.weights).toEqual([0, 0]);
    expect(mesh.mesh.geometry.getAttribute("position").getY(0)).toBe(0);
    mesh.setWeights(Float32Array.of(1));
    mesh.setWeights(null);
    expect(mesh.weights).toEqual([0, 0]);
  });
});
