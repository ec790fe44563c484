/** The reference video of a take, in step with the clock. */
import { effect, useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { addressOf } from "../api/client";
import type { Scene } from "../api/messages";
import { saveSettings } from "../state/actions";
import { clock, hasSound } from "../state/state";
import { say } from "../words";
import { followClock } from "./video_sync";

type Problem = "refused" | "lost" | null;

export function VideoPane({ take, video }: { take: string; video: Scene["videos"][number] }) {
  const element = useRef<HTMLVideoElement>(null);
  const hasPicture = useSignal(true);
  const problem = useSignal<Problem>(null);

  useEffect(() => {
    const shown = element.current;
    if (shown === null) return;
    problem.value = null;
    let jump = -1, asked = -Infinity, took = 0;
    const follow = () => {
      const isJump = clock.jumps.value !== jump;
      const step = followClock(
        {
          seconds: clock.frame.value / clock.rate + video.offset,
          playing: clock.playing.value,
          speed: clock.speed.value,
          jumped: isJump,
        },
        {
          current: shown.currentTime,
          duration: shown.duration,
          rate: video.rate,
          seeking: shown.seeking,
          sinceSeek: performance.now() - asked,
          seekTook: took,
        },
      );
      hasPicture.value = step.hasPicture;
      if (shown.playbackRate !== clock.speed.value) shown.playbackRate = clock.speed.value;
      if (step.seek !== null) {
        shown.currentTime = step.seek;
        asked = performance.now();
      }
      if (!shown.seeking || step.seek !== null) jump = clock.jumps.value;
      // A browser may refuse to play, or be stopped before it has begun; the next frame asks again.
      if (step.play && shown.paused) shown.play().catch(() => undefined);
      else if (!step.play && !shown.paused) shown.pause();
    };
    const arrive = () => {
      took = (performance.now() - asked) / 1000;
      follow();
    };
    const fail = () => {
      const isLost = shown.error?.code === MediaError.MEDIA_ERR_NETWORK;
      problem.value = isLost ? "lost" : "refused";
    };
    shown.addEventListener("seeked", arrive);
    shown.addEventListener("loadedmetadata", follow);
    shown.addEventListener("error", fail);
    const stop = effect(follow);
    return () => {
      stop();
      shown.removeEventListener("seeked", arrive);
      shown.removeEventListener("loadedmetadata", follow);
      shown.removeEventListener("error", fail);
      shown.pause();
    };
  }, [take, video.index, video.offset, video.rate]);

  const name = video.name;
  return (
    <figure class="stage-pane">
      {video.problem === null && (
        <video
          ref={element}
          class={`stage-video ${hasPicture.value && problem.value === null ? "" : "stage-no-picture"}`}
          src={addressOf("/api/video", { take, index: video.index })}
          muted={!hasSound.value}
          playsInline
          preload="auto"
          aria-label={say("stage.video-name", { name })}
        />
      )}
      <figcaption class="stage-caption">
        <span class="elide" title={name}>{name}</span>
        {video.problem === null && problem.value === null && (
          <button type="button" class="button button-small button-quiet" aria-pressed={hasSound.value}
            onClick={() => void saveSettings({ sound: !hasSound.value })}>
            {say(hasSound.value ? "stage.sound-on" : "stage.sound-off")}
          </button>
        )}
      </figcaption>
      {video.problem !== null && <p class="stage-says">{video.problem}</p>}
      {problem.value !== null && (
        <p class="stage-says">{say(problem.value === "lost" ? "stage.video-lost" : "stage.video-refused", { name })}</p>
      )}
      {problem.value === null && !hasPicture.value && <p class="stage-says">{say("stage.no-picture")}</p>}
    </figure>
  );
}
