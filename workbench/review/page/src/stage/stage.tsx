/** The stage: the take's face, a second one beside it, the reference video, and what chooses between them. */
import { useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { useEffect } from "preact/hooks";
import { describeKeys, perform } from "../keyboard/bindings";
import { CloseIcon } from "../shell/icons";
import { Command } from "../shell/pieces";
import { showBeside } from "../state/actions";
import { beside, corpus, scene, showMarkers, showVideo } from "../state/state";
import { say, type WordKey } from "../words";
import { besideScene, followBeside, listChoices, readChoice, writeChoice } from "./beside";
import { FacePane } from "./face_pane";
import { FartherIcon, FrontIcon, LeftSideIcon, NearerIcon, RightSideIcon } from "./icons";
import { look, registerViews, zoom } from "./shared_view";
import "./stage.css";
import { VideoPane } from "./video_pane";

registerViews();

export function Stage() {
  const shown = scene.value;
  const videoIndex = useSignal(0);
  useEffect(followBeside, []);
  if (shown === null) {
    return <div class="stage"><p class="stage-says">{say("stage.no-take")}</p></div>;
  }
  const hasFace = shown.solve !== null && shown.rig !== null;
  const video = shown.videos.find((one) => one.index === videoIndex.value) ?? shown.videos[0];
  const second = besideScene.value;
  return (
    <div class="stage">
      <Tools video={video?.index ?? 0} onVideo={(index) => (videoIndex.value = index)} />
      <div class="stage-panes">
        {hasFace ? <FacePane key="first" scene={shown} /> : <Missing />}
        {beside.value !== null && (
          second !== null && "scene" in second && second.scene.solve !== null
            ? <FacePane key="second" scene={second.scene} isBeside><CloseBeside /></FacePane>
            : (
              <figure class="stage-pane" key="second-missing">
                <figcaption class="stage-caption">
                  <span class="elide">{beside.value.take}</span>
                  <CloseBeside />
                </figcaption>
                <p class="stage-says">
                  {second === null && say("stage.loading-face")}
                  {second !== null && ("reason" in second ? second.reason : say("stage.no-weights"))}
                </p>
              </figure>
            )
        )}
        {video !== undefined && showVideo.value && (
          <VideoPane key={`video-${video.index}`} take={shown.take} video={video} />
        )}
      </div>
    </div>
  );
}

/** Where a take has no weights: why, and what to do about it. */
function Missing() {
  const problem = scene.value?.problem;
  return (
    <figure class="stage-pane">
      <div class="stage-says">
        <p>{problem?.message ?? say("stage.no-weights")}</p>
        {problem?.command && <p>{say("stage.run")} <Command text={problem.command} /></p>}
      </div>
    </figure>
  );
}

function CloseBeside() {
  return (
    <button type="button" class="button button-quiet button-icon button-small" aria-label={say("stage.beside-close")}
      title={say("stage.beside-close")} onClick={() => showBeside(null)}>
      <CloseIcon />
    </button>
  );
}

function Tools(props: { video: number; onVideo: (index: number) => void }) {
  const shown = scene.value!;
  const choices = listChoices(shown, corpus.value?.takes ?? []);
  const hasMarkers = shown.markers.length > 0;
  const chosen = beside.value === null ? "" : writeChoice(beside.value.take, beside.value.solve);
  const isListed = [...choices.solves, ...choices.takes].some((one) => one.value === chosen);
  return (
    <div class="stage-tools" role="group" aria-label={say("stage.tools")}>
      <div class="button-group">
        <Tool name="stage.right" command="view.right" onClick={() => look("right")}><RightSideIcon /></Tool>
        <Tool name="stage.front" command="view.front" hint={say("stage.turn-hint")} onClick={() => look("front")}>
          <FrontIcon />
        </Tool>
        <Tool name="stage.left" command="view.left" onClick={() => look("left")}><LeftSideIcon /></Tool>
      </div>
      <div class="button-group">
        <Tool name="stage.farther" onClick={() => zoom(1.25)}><FartherIcon /></Tool>
        <Tool name="stage.nearer" onClick={() => zoom(0.8)}><NearerIcon /></Tool>
      </div>
      <button type="button" class="button button-small" disabled={!hasMarkers}
        aria-pressed={hasMarkers && showMarkers.value}
        title={hasMarkers ? withKeys(say("stage.markers"), "view.markers") : say("stage.no-markers")}
        onClick={() => perform("view.markers")}>
        {say("stage.markers")}
      </button>
      <label class="stage-choice">
        <span>{say("stage.beside")}</span>
        <select class="select" aria-label={say("stage.beside-name")}
          title={withKeys(say("stage.beside-name"), "view.beside")}
          value={chosen} onChange={(event) => showBeside(readChoice(event.currentTarget.value))}>
          <option value="">{say("stage.beside-none")}</option>
          {chosen !== "" && !isListed && <option value={chosen}>{beside.value!.solve ?? beside.value!.take}</option>}
          {choices.solves.length > 0 && (
            <optgroup label={say("stage.beside-solves")}>
              {choices.solves.map((one) => <option key={one.value} value={one.value}>{one.name}</option>)}
            </optgroup>
          )}
          {choices.takes.length > 0 && (
            <optgroup label={say("stage.beside-takes")}>
              {choices.takes.map((one) => <option key={one.value} value={one.value}>{one.name}</option>)}
            </optgroup>
          )}
        </select>
      </label>
      {shown.videos.length > 0 && (
        <button type="button" class="button button-small" aria-pressed={showVideo.value}
          title={withKeys(say("stage.video"), "view.video")} onClick={() => perform("view.video")}>
          {say("stage.video")}
        </button>
      )}
      {shown.videos.length > 1 && showVideo.value && (
        <select class="select" aria-label={say("stage.video-which")} value={String(props.video)}
          onChange={(event) => props.onVideo(Number(event.currentTarget.value))}>
          {shown.videos.map((one) => <option key={one.index} value={String(one.index)}>{one.name}</option>)}
        </select>
      )}
    </div>
  );
}

interface ToolProps {
  name: WordKey;
  command?: string;
  /** What else can be done about it, by mouse. */
  hint?: string;
  onClick: () => void;
  children: ComponentChildren;
}

function Tool(props: ToolProps) {
  const name = say(props.name);
  const title = props.command === undefined ? name : withKeys(name, props.command);
  return (
    <button type="button" class="button button-icon button-small" aria-label={name}
      title={props.hint === undefined ? title : `${title}\n${props.hint}`} onClick={props.onClick}>
      {props.children}
    </button>
  );
}

/** What a button does, with the keys that do the same. */
function withKeys(name: string, command: string): string {
  const keys = describeKeys(command);
  return keys === "" ? name : `${name} (${keys})`;
}
