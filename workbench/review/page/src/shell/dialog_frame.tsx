/** The frame of every dialog: a native <dialog>, so that focus stays inside, and returns where it was. */
import type { ComponentChildren } from "preact";
import { useEffect, useId, useRef } from "preact/hooks";
import { say } from "../words";
import { CloseIcon } from "./icons";

export interface DialogFrameProps {
  title: string;
  onClose: () => void;
  /** Wider than text needs: tables; or as large as the window. */
  size?: "usual" | "wide" | "full";
  /** The buttons below; wrap what belongs at the left in <div class="dialog-foot-left">. */
  foot?: ComponentChildren;
  /** False for a panel beside the page, which stays usable (the manual). */
  modal?: boolean;
  class?: string;
  children: ComponentChildren;
}

export function DialogFrame(props: DialogFrameProps) {
  const element = useRef<HTMLDialogElement>(null);
  const title = useId();
  const modal = props.modal ?? true;
  const size = props.size === "wide" ? " dialog-wide" : props.size === "full" ? " dialog-full" : "";

  useEffect(() => {
    const dialog = element.current;
    if (dialog === null) return;
    const before = document.activeElement;
    if (modal) dialog.showModal();
    else dialog.show();
    // The browser would give the focus to the first button, which closes: an early Enter would do that.
    if (dialog.querySelector("[autofocus]") === null) dialog.focus({ preventScroll: true });
    return () => {
      dialog.close();
      if (before instanceof HTMLElement && before.isConnected) before.focus({ preventScroll: true });
    };
  }, [modal]);

  return (
    <dialog
      ref={element}
      class={`dialog${size}${props.class === undefined ? "" : ` ${props.class}`}`}
      aria-labelledby={title}
      tabIndex={-1}
      onCancel={(event) => {
        // Escape: the page's own state closes it, so that both agree.
        event.preventDefault();
        props.onClose();
      }}
    >
      <div class="dialog-head">
        <h2 id={title} class="elide">{props.title}</h2>
        <button type="button" class="button button-quiet button-icon" aria-label={say("dialog.close")}
          onClick={props.onClose}>
          <CloseIcon />
        </button>
      </div>
      <div class="dialog-body">{props.children}</div>
      {props.foot !== undefined && <div class="dialog-foot">{props.foot}</div>}
    </dialog>
  );
}
