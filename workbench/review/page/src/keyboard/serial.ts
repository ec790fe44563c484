/**
 * Edits one after the other: what a key means depends on what the key before it did.
 *
 * Split and then a label: the label is for the part behind the cut, which is known once the server has the cut. While
 * the server does not answer nothing is kept waiting; the edit is refused there, with a word.
 */
import { saving } from "../state/state";
import { tell } from "../state/actions";
import { say } from "../words";

/** ms after which a waiting key is not what the person means any more. */
const PATIENCE = 2000;
/** Keys that wait at most; what is held down repeats faster than any server answers. */
const MOST_WAITING = 6;

let last: Promise<unknown> = Promise.resolve();
let waiting = 0;

/** Run an action once those before it are done. */
export function inTurn(action: () => unknown): Promise<unknown> {
  if (saving.peek().state === "unsaved") return Promise.resolve(action());
  if (waiting >= MOST_WAITING) return last;
  const asked = performance.now();
  waiting += 1;
  const turn = last.then(async () => {
    waiting -= 1;
    if (performance.now() - asked > PATIENCE) tell(say("keys.too-slow"), "warning");
    else await action();
  });
  last = turn.catch(() => undefined);
  return turn;
}
