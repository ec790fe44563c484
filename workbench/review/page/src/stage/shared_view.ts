/** The viewpoint that all faces share: turned on one, both turn, so that they can be compared. */
import { signal } from "@preact/signals";
import { register } from "../keyboard/commands";
import { lookFrom, type Side, type Viewpoint } from "./viewpoint";

export const viewpoint = signal<Viewpoint>(lookFrom("front"));

export function look(side: Side): void {
  viewpoint.value = lookFrom(side);
}

/** Come nearer (below 1) or go away, within what makes sense. */
export function zoom(factor: number): void {
  const { distance, ...rest } = viewpoint.value;
  viewpoint.value = { ...rest, distance: Math.min(Math.max(distance * factor, 0.15), 4) };
}

/** Make the views known to the keyboard, the menus and the help page. */
export function registerViews(): void {
  register(
    { id: "view.front", group: "view", name: "command.view-front", keys: ["F"], run: () => look("front") },
    { id: "view.left", group: "view", name: "command.view-left", keys: ["Q"], run: () => look("left") },
    { id: "view.right", group: "view", name: "command.view-right", keys: ["W"], run: () => look("right") },
  );
}
