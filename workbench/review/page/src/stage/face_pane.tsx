/** One face of the stage: follows the clock, says what it shows and what it is waiting for. */
import { effect, useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { useEffect, useRef } from "preact/hooks";
import type { Scene } from "../api/messages";
import type { ChunkedFrames } from "../frames/chunks";
import { openFrames, sameMoment } from "../frames/takes";
import { Spinner } from "../shell/pieces";
import { beside, clock, showMarkers } from "../state/state";
import { say } from "../words";
import { FaceView } from "./face_view";
import { addFace } from "./faces";
import { loadRig } from "./rig_model";
import { viewpoint } from "./shared_view";

interface Props {
  scene: Scene;
  /** Whether it is the second face, beside the take's own. */
  isBeside?: boolean;
  /** Buttons of the pane. */
  children?: ComponentChildren;
}

export function FacePane({ scene, isBeside = false, children }: Props) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const view = useSignal<FaceView | null>(null);
  const canDraw = useSignal(true);
  const rig = useSignal<{ state: "coming" | "here" } | { state: "failed"; reason: string }>({ state: "coming" });
  const attempt = useSignal(0);
  /** Of the frame that is looked at. */
  const standing = useSignal<"shown" | "coming" | "not-known">("shown");
  const failure = useSignal<string | null>(null);
  const shown = useRef({ scene, frame: -1 });
  shown.current.scene = scene;

  useEffect(() => {
    let made: FaceView;
    try {
      made = new FaceView(canvas.current!);
    } catch {
      canDraw.value = false;
      return;
    }
    view.value = made;
    made.onTurned = () => (viewpoint.value = made.view);
    const stop = effect(() => {
      if (made.view !== viewpoint.value) made.view = viewpoint.value;
    });
    const forget = addFace({
      get take() { return shown.current.scene.take; },
      get solve() { return shown.current.scene.solve; },
      get rig() { return shown.current.scene.rig; },
      get frame() { return shown.current.frame; },
      get weights() { return made.weights; },
      get markers() { return made.markers; },
      get drawn() { return made.drawn; },
      get milliseconds() { return made.milliseconds; },
    });
    return () => {
      forget();
      stop();
      view.value = null;
      made.dispose();
    };
  }, []);

  useEffect(() => {
    if (view.value === null || scene.rig === null) return;
    const drawing = view.value;
    let isWanted = true;
    rig.value = { state: "coming" };
    loadRig(scene.rig).then(
      (model) => {
        if (!isWanted) return;
        drawing.setRig(model);
        rig.value = { state: "here" };
      },
      (error: unknown) => {
        if (isWanted) rig.value = { state: "failed", reason: error instanceof Error ? error.message : String(error) };
      },
    );
    return () => {
      isWanted = false;
    };
  }, [view.value, scene.rig, attempt.value]);

  const shapes = scene.shapes.join("\n");
  useEffect(() => {
    const drawing = view.value;
    const frames = openFrames(scene);
    if (drawing === null || frames === null) return;
    drawing.setShapes(scene.shapes);
    const stop = effect(() => {
      const frame = sameMoment(clock.frame.value, clock.rate, scene);
      const pace = clock.playing.value ? scene.rate * clock.speed.value : 0;
      const row = look(frames.weights, frame, pace);
      const isKnown = row === null || row.values.some((value) => !Number.isNaN(value));
      standing.value = row === null || row.frame !== frame ? "coming" : isKnown ? "shown" : "not-known";
      failure.value = frames.weights.failure.value;
      const withMarkers = showMarkers.value && frames.markers !== null;
      const markers = withMarkers ? look(frames.markers!, frame, pace) : null;
      if (rig.value.state !== "here") return;
      // What is on the face stays until the right frame is there: no picture of another moment in between.
      if (row !== null && row.frame !== frame && shown.current.frame >= 0) return;
      drawing.setWeights(row?.values ?? null);
      shown.current.frame = row?.frame ?? -1;
      // Markers of another moment would not sit on this face.
      drawing.setMarkers(markers !== null && markers.frame === row?.frame ? markers.values : null);
    });
    return () => {
      stop();
      frames.close();
      shown.current.frame = -1;
    };
  }, [view.value, scene.take, scene.solve, scene.rate, scene.frames, shapes, scene.markers.length]);

  const name = say(isBeside ? "stage.face-beside" : "stage.face", { take: scene.take });
  return (
    <figure class="stage-pane">
      <canvas ref={canvas} class="stage-canvas" role="img" aria-label={name} />
      <figcaption class="stage-caption">
        <span class="elide" title={describe(scene)}>{describe(scene)}</span>
        {scene.simulated && <span class="badge">{say("stage.simulated")}</span>}
        {children}
      </figcaption>
      {!canDraw.value && <p class="stage-says">{say("stage.no-3d")}</p>}
      {canDraw.value && rig.value.state === "coming" && (
        <p class="stage-says"><Spinner /> {say("stage.loading-face")}</p>
      )}
      {rig.value.state === "failed" && (
        <div class="stage-says">
          <p>{say("stage.failed-rig", { reason: rig.value.reason })}</p>
          <button type="button" class="button" onClick={() => (attempt.value += 1)}>{say("stage.again")}</button>
        </div>
      )}
      {failure.value !== null
        ? <p class="stage-note" role="status">{say("stage.failed", { reason: failure.value })}</p>
        : standing.value !== "shown" && rig.value.state === "here" && (
          <p class={`stage-note stage-${standing.value}`}>
            {say(standing.value === "coming" ? "stage.loading-frames" : "stage.not-known")}
          </p>
        )}
    </figure>
  );
}

/** What there is of a frame; what is missing around it is fetched. */
function look(source: ChunkedFrames, frame: number, pace: number) {
  source.want(frame, pace);
  void source.version.value;
  return source.at(frame);
}

/** What a face is; beside another one, what the two most often differ by comes first. */
function describe(scene: Scene): string {
  const { take, signer, protocol, solve } = scene;
  const parts = beside.value === null ? [take, signer, protocol, solve] : [solve, take, signer, protocol];
  return parts.filter((one) => one !== null && one !== "").join(" · ");
}
