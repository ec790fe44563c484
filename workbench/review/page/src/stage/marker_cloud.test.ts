import { Matrix4, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { MarkerCloud } from "./marker_cloud";

describe("MarkerCloud", () => {
  it("puts markers given in mm where the face is in m, and leaves out what was not seen", () => {
    const cloud = new MarkerCloud(3);
    cloud.show(Float32Array.of(10, 20, 30, NaN, NaN, NaN, -5, 0, 100));
    expect(cloud.count).toBe(2);
    const place = new Matrix4();
    cloud.mesh.getMatrixAt(1, place);
    const point = new Vector3().setFromMatrixPosition(place);
    expect(point.distanceTo(new Vector3(-0.005, 0, 0.1))).toBeLessThan(1e-7);
    cloud.show(null);
    expect(cloud.count).toBe(0);
    expect(cloud.mesh.visible).toBe(false);
  });
});
