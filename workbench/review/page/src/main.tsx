/** Where the page begins. */
import { mount } from "./shell/app";
import { faces } from "./stage/faces";
import * as state from "./state/state";

declare global {
  interface Window {
    /** For tests and the curious: what the page shows. To be read, not to be written. */
    mimique?: { clock: typeof state.clock; state: typeof state; faces: typeof faces };
  }
}

const root = document.getElementById("app");
if (root !== null) {
  window.mimique = { clock: state.clock, state, faces };
  mount(root);
}
