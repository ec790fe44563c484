import { Box3, PerspectiveCamera, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { LENS, lookFrom, placeCamera, readCamera } from "./viewpoint";

const face = new Box3(new Vector3(-0.07, -0.11, -0.02), new Vector3(0.08, 0.1, 0.09));

function makeCamera(aspect: number): PerspectiveCamera {
  return new PerspectiveCamera(LENS, aspect, 0.01, 10);
}

describe("a viewpoint", () => {
  it.each([0.4, 1, 2.5])("shows the whole face from every side, in a picture of aspect %s", (aspect) => {
    for (const side of ["front", "left", "right"] as const) {
      const camera = makeCamera(aspect);
      placeCamera(camera, face, lookFrom(side));
      camera.updateMatrixWorld(true);
      const seen = new Box3();
      for (const x of [face.min.x, face.max.x]) {
        for (const y of [face.min.y, face.max.y]) seen.expandByPoint(new Vector3(x, y, 0.04).project(camera));
      }
      expect(Math.max(-seen.min.x, -seen.min.y, seen.max.x, seen.max.y)).toBeLessThan(1);
      if (side === "front") expect(Math.max(seen.max.x, seen.max.y)).toBeGreaterThan(0.6);
    }
  });

  it("has the signer's left side where +X is", () => {
    const camera = makeCamera(1);
    placeCamera(camera, face, lookFrom("left"));
    expect(camera.position.x).toBeGreaterThan(0.2);
    placeCamera(camera, face, lookFrom("right"));
    expect(camera.position.x).toBeLessThan(-0.2);
  });

  it("is read as it was placed, and carries over to a face of another size", () => {
    const direction = new Vector3(0.3, 0.4, 0.5).normalize();
    const view = { direction, distance: 0.6, shift: new Vector3(0.1, -0.4, 0.2) };
    const other = new Box3(new Vector3(1, 1, 1), new Vector3(3, 5, 2));
    for (const [box, aspect] of [[face, 1.7], [other, 0.5]] as const) {
      const camera = makeCamera(aspect);
      const target = placeCamera(camera, box, view);
      const read = readCamera(camera, box, target);
      expect(read.distance).toBeCloseTo(view.distance, 9);
      expect(read.direction.distanceTo(view.direction)).toBeLessThan(1e-9);
      expect(read.shift.distanceTo(view.shift)).toBeLessThan(1e-9);
    }
  });
});
