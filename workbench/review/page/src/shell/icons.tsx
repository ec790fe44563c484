/** Icons: own line drawings on a 16 × 16 grid, in the colour of the text. The button around them carries the name. */
import type { ComponentChildren } from "preact";

function Icon(props: { children: ComponentChildren }) {
  return (
    <svg viewBox="0 0 16 16" aria-hidden="true" focusable="false">
      {props.children}
    </svg>
  );
}

export const CloseIcon = () => <Icon><path d="M4 4l8 8M12 4l-8 8" /></Icon>;
export const UndoIcon = () => <Icon><path d="M6 3.5L2.5 7 6 10.5M3 7h6.5a3.5 3.5 0 0 1 0 7H7" /></Icon>;
export const RedoIcon = () => <Icon><path d="M10 3.5L13.5 7 10 10.5M13 7H6.5a3.5 3.5 0 0 0 0 7H9" /></Icon>;
export const MenuIcon = () => <Icon><path d="M2.5 4.5h11M2.5 8h11M2.5 11.5h11" /></Icon>;
export const CheckIcon = () => <Icon><path d="M3 8.5l3.5 3.5L13 4.5" /></Icon>;
export const WarningIcon = () => <Icon><path d="M8 2.5L14.5 13.5h-13zM8 6.5v3.2M8 11.6v.1" /></Icon>;
export const LeftPanelIcon = () => <Icon><path d="M2 3h12v10H2zM6 3v10" /></Icon>;
export const RightPanelIcon = () => <Icon><path d="M2 3h12v10H2zM10 3v10" /></Icon>;
export const DownIcon = () => <Icon><path d="M4.5 6.5L8 10l3.5-3.5" /></Icon>;
export const LoopIcon = () => (
  <Icon>
    <path d="M11 2l2.5 2.5L11 7M13 4.5H5A2.5 2.5 0 0 0 2.5 7M5 14l-2.5-2.5L5 9M3 11.5h8A2.5 2.5 0 0 0 13.5 9" />
  </Icon>
);
export const PreviousIcon = () => <Icon><path d="M10 3.5L5.5 8l4.5 4.5" /></Icon>;
export const NextIcon = () => <Icon><path d="M6 3.5L10.5 8 6 12.5" /></Icon>;
