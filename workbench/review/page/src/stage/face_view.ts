/**
 * One face on one canvas: the rig, its weights, its markers, and the camera that people turn.
 *
 * It is drawn only when something changed, and at most once per picture.
 */
import { type Box3, DirectionalLight, HemisphereLight, PerspectiveCamera, Scene, WebGLRenderer } from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { MarkerCloud } from "./marker_cloud";
import { RigMesh } from "./rig_mesh";
import type { RigModel } from "./rig_model";
import { isSoftwareDrawn } from "./software_drawing";
import { LENS, lookFrom, placeCamera, readCamera, type Viewpoint } from "./viewpoint";

/** Pictures finer than this cost more than eyes can see. */
const MOST_PIXELS_PER_POINT = 2;

export class FaceView {
  /** Called where the person turned the view by hand. */
  onTurned: () => void = () => undefined;
  /** How often it was drawn, and how long the page worked on the last picture, ms. For tests. */
  drawn = 0;
  milliseconds = 0;

  readonly #canvas: HTMLCanvasElement;
  readonly #renderer: WebGLRenderer;
  readonly #scene = new Scene();
  readonly #camera = new PerspectiveCamera(LENS, 1, 0.01, 10);
  readonly #controls: OrbitControls;
  readonly #resizes: ResizeObserver;
  readonly #isSoftware = isSoftwareDrawn();
  #parts: RigMesh[] = [];
  #face: Box3 | null = null;
  #view: Viewpoint = lookFrom("front");
  #shapes: string[] = [];
  #cloud: MarkerCloud | null = null;
  #waiting = false;
  #closed = false;

  /** Throws where the browser cannot draw in three dimensions. */
  constructor(canvas: HTMLCanvasElement) {
    this.#canvas = canvas;
    const isSoftware = this.#isSoftware;
    this.#renderer = new WebGLRenderer({
      canvas, antialias: !isSoftware, alpha: true, powerPreference: "high-performance",
    });
    this.#renderer.setPixelRatio(isSoftware ? 1 : Math.min(window.devicePixelRatio, MOST_PIXELS_PER_POINT));
    this.#scene.add(new HemisphereLight(0xffffff, 0x8d8f96, 1.5));
    // Light from above and from one side models the face; the camera carries it, so that no side is in the dark.
    const key = new DirectionalLight(0xffffff, 1.9);
    key.position.set(-0.6, 0.9, 0.6);
    this.#camera.add(key, key.target);
    key.target.position.set(0, 0, -1);
    this.#scene.add(this.#camera);
    this.#controls = new OrbitControls(this.#camera, canvas);
    this.#controls.enableDamping = false;
    this.#controls.rotateSpeed = 0.8;
    this.#controls.addEventListener("change", this.#turn);
    canvas.addEventListener("dblclick", this.#reset);
    canvas.addEventListener("webglcontextrestored", this.invalidate);
    document.addEventListener("visibilitychange", this.invalidate);
    this.#resizes = new ResizeObserver(() => this.#resize());
    this.#resizes.observe(canvas);
    this.#resize();
  }

  /** Show another rig; null for none. */
  setRig(rig: RigModel | null): void {
    for (const part of this.#parts) {
      this.#scene.remove(part.mesh);
      part.dispose();
    }
    this.#parts = (rig?.parts ?? []).map((part) => new RigMesh(part, this.#isSoftware));
    for (const part of this.#parts) this.#scene.add(part.mesh);
    this.#face = rig?.head ?? null;
    for (const part of this.#parts) part.matchShapes(this.#shapes);
    this.#place();
  }

  /** Say which shapes the columns of the weights are. */
  setShapes(shapes: string[]): void {
    this.#shapes = shapes;
    for (const part of this.#parts) part.matchShapes(shapes);
    this.invalidate();
  }

  /** Show the weights of a frame; the neutral where a weight is not known (NaN), or for null. */
  setWeights(values: Float32Array | null): void {
    const started = performance.now();
    for (const part of this.#parts) part.setWeights(values);
    this.milliseconds = performance.now() - started;
    this.invalidate();
  }

  /** Show markers (n_markers · 3, mm); null for none. */
  setMarkers(values: Float32Array | null): void {
    const nMarkers = values === null ? 0 : values.length / 3;
    if (values === null) {
      if (this.#cloud === null) return;
      this.#cloud.show(null);
    } else {
      if (this.#cloud === null || this.#cloud.capacity !== nMarkers) {
        this.#dropCloud();
        this.#cloud = new MarkerCloud(nMarkers);
        this.#scene.add(this.#cloud.mesh);
      }
      this.#cloud.show(values);
    }
    this.invalidate();
  }

  /** How many markers are shown. */
  get markers(): number {
    return this.#cloud?.count ?? 0;
  }

  /** The weights that are on the face now, by shape. */
  get weights(): Record<string, number> {
    const found: Record<string, number> = {};
    for (const { shapes, weights } of this.#parts) shapes.forEach((shape, number) => (found[shape] = weights[number]!));
    return found;
  }

  get view(): Viewpoint {
    return this.#view;
  }

  set view(view: Viewpoint) {
    this.#view = view;
    this.#place();
  }

  /** Draw before the next picture. */
  readonly invalidate = (): void => {
    if (this.#waiting || this.#closed) return;
    this.#waiting = true;
    // After whatever else changes now, but still for this very picture.
    queueMicrotask(() => {
      this.#waiting = false;
      if (!this.#closed && !document.hidden) this.#draw();
    });
  };

  dispose(): void {
    this.#closed = true;
    this.#resizes.disconnect();
    this.#controls.dispose();
    this.#canvas.removeEventListener("dblclick", this.#reset);
    this.#canvas.removeEventListener("webglcontextrestored", this.invalidate);
    document.removeEventListener("visibilitychange", this.invalidate);
    this.setRig(null);
    this.#dropCloud();
    this.#renderer.dispose();
    // A browser grants some sixteen contexts, and takes them back late.
    this.#renderer.forceContextLoss();
  }

  #draw(): void {
    const started = performance.now();
    this.#renderer.render(this.#scene, this.#camera);
    this.milliseconds += performance.now() - started;
    this.drawn += 1;
  }

  #resize(): void {
    const width = this.#canvas.clientWidth, height = this.#canvas.clientHeight;
    if (width === 0 || height === 0) return;
    this.#renderer.setSize(width, height, false);
    this.#camera.aspect = width / height;
    this.#place();
  }

  #place(): void {
    const face = this.#face;
    if (face !== null) {
      // Asked first, so that putting the camera in place does not count as turning it by hand.
      this.#controls.removeEventListener("change", this.#turn);
      const target = placeCamera(this.#camera, face, this.#view);
      const fit = this.#camera.position.distanceTo(target) / this.#view.distance;
      this.#controls.minDistance = fit * 0.15;
      this.#controls.maxDistance = fit * 4;
      this.#controls.target.copy(target);
      this.#controls.update();
      this.#controls.addEventListener("change", this.#turn);
    }
    this.invalidate();
  }

  readonly #turn = (): void => {
    if (this.#face !== null) this.#view = readCamera(this.#camera, this.#face, this.#controls.target);
    this.invalidate();
    this.onTurned();
  };

  readonly #reset = (): void => {
    this.view = lookFrom("front");
    this.onTurned();
  };

  #dropCloud(): void {
    if (this.#cloud === null) return;
    this.#scene.remove(this.#cloud.mesh);
    this.#cloud.dispose();
    this.#cloud = null;
  }
}
