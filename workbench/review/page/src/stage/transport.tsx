/** The bar that plays: start, step, play, end, speed, loop, and where in the take one is. */
import { useComputed, useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { SPEEDS } from "../clock/clock";
import { parsePlace } from "../clock/times";
import { describeKeys, perform } from "../keyboard/bindings";
import { clock, scene } from "../state/state";
import { say } from "../words";
import { formatTime } from "../words/numbers";
import { BackIcon, EndIcon, ForwardIcon, LoopIcon, PauseIcon, PlayIcon, StartIcon } from "./icons";
import "./stage.css";

const SPEED_NAMES: Record<number, string> = { 0.25: "¼", 0.5: "½", 1: "1", 2: "2", 4: "4" };

export function Transport() {
  const isOpen = scene.value !== null;
  const isPlaying = clock.playing.value;
  const loop = clock.loop.value;
  return (
    <div class="transport" role="group" aria-label={say("transport.region")}>
      <div class="transport-buttons">
        <Push name={say("transport.start")} command="move.start" isOff={!isOpen} onClick={() => clock.seek(0)}>
          <StartIcon />
        </Push>
        <Push name={say("transport.back")} command="move.back" isOff={!isOpen} onClick={() => clock.step(-1)}>
          <BackIcon />
        </Push>
        <Push name={say(isPlaying ? "transport.pause" : "transport.play")} command="play.toggle" isOff={!isOpen} isMain
          onClick={() => clock.toggle()}>
          {isPlaying ? <PauseIcon /> : <PlayIcon />}
        </Push>
        <Push name={say("transport.forward")} command="move.forward" isOff={!isOpen} onClick={() => clock.step(1)}>
          <ForwardIcon />
        </Push>
        <Push name={say("transport.end")} command="move.end" isOff={!isOpen} onClick={() => clock.seek(Infinity)}>
          <EndIcon />
        </Push>
        <Push name={say(loop === null ? "transport.loop" : "transport.unloop")} command="play.loop" isOff={!isOpen}
          isPressed={loop !== null}
          onClick={() => (clock.loop.value === null ? perform("play.loop") : clock.setLoop(null))}>
          <LoopIcon />
        </Push>
      </div>
      <div class="button-group" role="group" aria-label={say("transport.speed")}>
        {SPEEDS.map((speed) => (
          <button key={speed} type="button" class="button button-small transport-speed"
            aria-pressed={clock.speed.value === speed}
            aria-label={say("transport.speed-is", { speed })} title={say("transport.speed-is", { speed })}
            onClick={() => clock.setSpeed(speed)}>
            {SPEED_NAMES[speed]}×
          </button>
        ))}
      </div>
      {isOpen && <Place />}
    </div>
  );
}

/** Where one is: time and frame. The text follows the clock by itself, without the bar being made anew. */
function Place() {
  const time = useComputed(() => formatTime(clock.frame.value, clock.rate));
  const typed = useSignal<string | null>(null);
  const isWrong = useSignal(false);
  const place = useComputed(() => typed.value ?? String(clock.frame.value));
  const { frames, seconds } = scene.value!;
  const go = (text: string) => {
    const frame = parsePlace(text, clock.rate);
    isWrong.value = frame === null;
    if (frame === null) return false;
    clock.seek(frame);
    typed.value = null;
    return true;
  };
  return (
    <div class="transport-place">
      <span class="transport-time" title={say("transport.time")}>
        <span>{time}</span> <span class="soft">/ {formatTime(seconds, 1)}</span>
      </span>
      <input
        class="input transport-frame"
        inputMode="numeric"
        autocomplete="off"
        aria-label={say("transport.place")}
        aria-invalid={isWrong.value}
        title={say("transport.place")}
        value={place}
        onInput={(event) => {
          typed.value = event.currentTarget.value;
          isWrong.value = false;
        }}
        onFocus={(event) => event.currentTarget.select()}
        onKeyDown={(event) => {
          if (event.key === "Enter" && go(event.currentTarget.value)) event.currentTarget.blur();
          if (event.key === "Escape") {
            typed.value = null;
            event.currentTarget.blur();
          }
        }}
        onBlur={() => {
          typed.value = null;
          isWrong.value = false;
        }}
      />
      <span class="soft small number">{say("transport.of", { frames })}</span>
    </div>
  );
}

interface PushProps {
  name: string;
  command: string;
  isOff: boolean;
  isMain?: boolean;
  isPressed?: boolean;
  onClick: () => void;
  children: ComponentChildren;
}

function Push(props: PushProps) {
  const keys = describeKeys(props.command);
  const look = props.isMain ? "button-primary transport-play" : "button-quiet";
  return (
    <button type="button" class={`button button-icon ${look}`} aria-label={props.name}
      title={keys === "" ? props.name : `${props.name} (${keys})`} disabled={props.isOff} aria-pressed={props.isPressed}
      onClick={props.onClick}>
      {props.children}
    </button>
  );
}
