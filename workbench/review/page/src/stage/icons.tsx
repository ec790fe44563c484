/** Icons of stage and transport: own line drawings on a 16 × 16 grid; the button around them carries the name. */
import type { ComponentChildren } from "preact";

function Icon(props: { children: ComponentChildren }) {
  return (
    <svg viewBox="0 0 16 16" aria-hidden="true" focusable="false">
      {props.children}
    </svg>
  );
}

export const PlayIcon = () => <Icon><path class="stage-solid" d="M5 3.2v9.6L12.8 8z" /></Icon>;
export const PauseIcon = () => <Icon><path class="stage-solid" d="M4.5 3.5h2v9h-2zM9.5 3.5h2v9h-2z" /></Icon>;
export const StartIcon = () => <Icon><path d="M4 3.5v9M12 3.5L6.5 8l5.5 4.5z" /></Icon>;
export const EndIcon = () => <Icon><path d="M12 3.5v9M4 3.5L9.5 8 4 12.5z" /></Icon>;
export const BackIcon = () => <Icon><path d="M10.5 3.5L5 8l5.5 4.5" /></Icon>;
export const ForwardIcon = () => <Icon><path d="M5.5 3.5L11 8l-5.5 4.5" /></Icon>;
export const LoopIcon = () => (
  <Icon>
    <path d="M4 6.5V6a2.5 2.5 0 0 1 2.5-2.5H13M11 1.5l2 2-2 2M12 9.5v.5a2.5 2.5 0 0 1-2.5 2.5H3M5 14.5l-2-2 2-2" />
  </Icon>
);
export const NearerIcon = () => <Icon><path d="M8 3.5v9M3.5 8h9" /></Icon>;
export const FartherIcon = () => <Icon><path d="M3.5 8h9" /></Icon>;
export const FrontIcon = () => (
  <Icon>
    <path d="M8 2.5c2.8 0 4.3 2 4.3 4.7S10.5 13.5 8 13.5 3.7 9.9 3.7 7.2 5.2 2.5 8 2.5z" />
    <path d="M6.2 7v.1M9.8 7v.1M6.5 10.3c.9.7 2.1.7 3 0" />
  </Icon>
);
/** What one sees of the signer's left side: a head that looks to the left of the picture. */
export const LeftSideIcon = () => (
  <Icon>
    <path d="M11 13.5V11c1.2-1 2-2.4 2-4.1 0-2.6-2-4.4-4.7-4.4C5.7 2.5 4.2 4.1 4 6.3" />
    <path d="M4 6.3L2.7 8.5l1.2.6v2.1c0 .6.4 1 1 1h1.6v1.3" />
    <path d="M6.7 6.7v.1" />
  </Icon>
);
export const RightSideIcon = () => (
  <Icon>
    <path d="M5 13.5V11c-1.2-1-2-2.4-2-4.1 0-2.6 2-4.4 4.7-4.4 2.6 0 4.1 1.6 4.3 3.8" />
    <path d="M12 6.3l1.3 2.2-1.2.6v2.1c0 .6-.4 1-1 1H9.5v1.3" />
    <path d="M9.3 6.7v.1" />
  </Icon>
);
