/** The second face: chosen once, it comes back with every take that has one to show. */
import type { Scene } from "../api/messages";
import { saveSettings } from "./settings";
import { beside, corpus, scene, session } from "./state";

/** As it is kept: without a take, it is another solve of whichever take is open. */
interface Kept {
  take: string | null;
  solve: string | null;
}

/** Show another take or solve beside the first face, or none. */
export function showBeside(choice: { take: string; solve: string | null } | null): void {
  beside.value = choice;
  const kept: Kept | null = choice && { ...choice, take: choice.take === scene.value?.take ? null : choice.take };
  void saveSettings({ beside: kept });
}

/** What to show beside a take by the person's last choice; nothing where the take or solve is not there. */
export function recallBeside(shown: Scene): { take: string; solve: string | null } | null {
  const kept = session.value?.settings["beside"] as Partial<Kept> | null | undefined;
  if (typeof kept !== "object" || kept === null) return null;
  const { take = null, solve = null } = kept;
  if (take === null) return solve !== null && shown.solves.includes(solve) ? { take: shown.take, solve } : null;
  const row = corpus.value?.takes.find((one) => one.take === take);
  const isThere = row !== undefined && row.solve !== null && row.refusal === null && row.mode !== "none";
  return isThere && take !== shown.take ? { take, solve } : null;
}
