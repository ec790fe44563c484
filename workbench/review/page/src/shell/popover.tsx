/** A button with something that opens below it: closes on Escape, on a click elsewhere, and when focus leaves. */
import type { ComponentChildren } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";

export interface PopoverProps {
  /** What stands on the button. */
  button: ComponentChildren;
  /** The button's name for screen readers and as its hint. */
  label: string;
  buttonClass?: string;
  class?: string;
  role?: "menu" | "dialog";
  /** Which edge of the button it keeps to. */
  side?: "left" | "right";
  disabled?: boolean;
  children: (close: () => void) => ComponentChildren;
}

export function Popover(props: PopoverProps) {
  const [isOpen, setOpen] = useState(false);
  const whole = useRef<HTMLDivElement>(null);
  const button = useRef<HTMLButtonElement>(null);
  const close = () => setOpen(false);

  useEffect(() => {
    if (!isOpen) return;
    const elsewhere = (event: Event) => {
      if (event.target instanceof Node && !whole.current?.contains(event.target)) close();
    };
    document.addEventListener("pointerdown", elsewhere, true);
    document.addEventListener("focusin", elsewhere, true);
    const first = whole.current?.querySelector<HTMLElement>(
      ".menu [data-first], .menu button:not(:disabled), .menu input",
    );
    first?.focus();
    return () => {
      document.removeEventListener("pointerdown", elsewhere, true);
      document.removeEventListener("focusin", elsewhere, true);
    };
  }, [isOpen]);

  return (
    <div
      class="popover"
      ref={whole}
      onKeyDown={(event) => {
        if (!isOpen) return;
        if (event.key === "Escape") {
          close();
          button.current?.focus();
          event.stopPropagation();
        } else if (event.key === "ArrowDown" || event.key === "ArrowUp") {
          if (walk(whole.current, event.key === "ArrowDown" ? 1 : -1)) event.preventDefault();
          event.stopPropagation();
        }
      }}
    >
      <button
        ref={button}
        type="button"
        class={`button ${props.buttonClass ?? "button-quiet"}`}
        aria-label={props.label}
        title={props.label}
        aria-haspopup={props.role ?? "menu"}
        aria-expanded={isOpen}
        disabled={props.disabled ?? false}
        onClick={() => setOpen(!isOpen)}
      >
        {props.button}
      </button>
      {isOpen && (
        <div class={`menu menu-${props.side ?? "left"} ${props.class ?? ""}`} role={props.role ?? "menu"}
          aria-label={props.label}>
          {props.children(close)}
        </div>
      )}
    </div>
  );
}

/** Move the focus among the items of a menu. */
function walk(within: HTMLElement | null, step: 1 | -1): boolean {
  const items = [...(within?.querySelectorAll<HTMLElement>(".menu-item:not(:disabled)") ?? [])];
  if (items.length === 0) return false;
  const at = items.findIndex((one) => one === document.activeElement);
  const next = at < 0 ? (step === 1 ? 0 : items.length - 1) : (at + step + items.length) % items.length;
  items[next]?.focus();
  return true;
}
