/** What a person chose: applied to the page, kept at the server. */
import { batch } from "@preact/signals";
import { put } from "../api/client";
import type { Settings } from "../api/messages";
import { language } from "../words";
import { tellError } from "./notices";
import { hasSound, session, shownCurves, showMarkers, showVideo } from "./state";

/** Show what was chosen. */
export function applySettings(settings: Settings): void {
  if (settings.language === "en" || settings.language === "fr") language.value = settings.language;
  if (typeof settings["markers"] === "boolean") showMarkers.value = settings["markers"];
  if (typeof settings["video"] === "boolean") showVideo.value = settings["video"];
  if (typeof settings["sound"] === "boolean") hasSound.value = settings["sound"];
  const curves = settings["curves"];
  if (Array.isArray(curves) && curves.every((one) => typeof one === "string")) shownCurves.value = curves;
}

let settingsTurn = 0;

/** Keep what the person chose: at once on this page, a moment later at the server (quick changes go together). */
export async function saveSettings(change: Settings): Promise<void> {
  const now = session.value;
  batch(() => {
    if (now !== null) session.value = { ...now, settings: { ...now.settings, ...change } };
    applySettings(change);
  });
  if (now === null) return;
  const turn = (settingsTurn += 1);
  await new Promise((resolve) => setTimeout(resolve, 400));
  const person = session.value;
  if (turn !== settingsTurn || person === null) return;
  try {
    await put<Settings>("/api/settings", person.settings);
  } catch (error) {
    tellError(error);
  }
}
