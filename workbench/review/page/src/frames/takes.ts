/** What moves in one take: its weights and, on request, its markers, fetched as they are looked at. */
import { getFloats, type Query } from "../api/client";
import type { Scene } from "../api/messages";
import { ChunkedFrames, type Load } from "./chunks";

export interface TakeFrames {
  /** (n_frames, n_shapes), columns in the order of `scene.shapes`. */
  weights: ChunkedFrames;
  /** (n_frames, n_markers · 3), mm in the rig's space; NaN where a marker was not seen. Null where there are none. */
  markers: ChunkedFrames | null;
  close: () => void;
}

/** Open what a scene shows; null where it has nothing to show a face by. */
export function openFrames(scene: Scene): TakeFrames | null {
  if (scene.solve === null || scene.rig === null || scene.shapes.length === 0) return null;
  const query = { take: scene.take, solve: scene.solve };
  const open = (path: string, width: number) =>
    new ChunkedFrames({ frames: scene.frames, width, load: loader(path, query) });
  const weights = open("/api/weights", scene.shapes.length);
  const markers = scene.markers.length > 0 ? open("/api/markers", scene.markers.length * 3) : null;
  return {
    weights,
    markers,
    close: () => {
      weights.close();
      markers?.close();
    },
  };
}

/** The frame of one take at which as much time has passed as at a frame of another. */
export function sameMoment(frame: number, rate: number, other: { rate: number; frames: number }): number {
  const moment = rate === other.rate ? frame : Math.floor((frame / rate) * other.rate + 1e-6);
  return Math.min(Math.max(moment, 0), Math.max(other.frames - 1, 0));
}

function loader(path: string, query: Query): Load {
  return (first, count, signal) => getFloats(path, { ...query, first, count }, { signal });
}
