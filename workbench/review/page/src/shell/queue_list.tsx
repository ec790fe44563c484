/** The queue as a list of which only the rows in sight exist: ten thousand segments scroll like ten. */
import { useEffect, useLayoutEffect, useRef, useState } from "preact/hooks";
import type { QueueItem } from "../api/messages";
import { openItem } from "../state/actions";
import { corpus, scene, selection, shownQueue } from "../state/state";
import { place } from "../state/walking";
import { say } from "../words";
import { formatFixed, formatTime } from "../words/numbers";
import { coloursOf } from "../labels/shown";
import { Confidence, StatusBadge, Swatch } from "./pieces";
import { ROW, rowsInSight } from "./rows";

export function QueueList() {
  const items = shownQueue.value;
  const here = place.value;
  const box = useRef<HTMLDivElement>(null);
  const [top, setTop] = useState(0);
  const [height, setHeight] = useState(600);
  const [walked, setWalked] = useState<number | null>(null);
  const active = walked !== null && walked < items.length ? walked : here;

  useLayoutEffect(() => {
    const element = box.current;
    if (element === null) return;
    const observer = new ResizeObserver(() => setHeight(element.clientHeight));
    observer.observe(element);
    return () => observer.disconnect();
  }, []);

  const show = (index: number) => {
    const element = box.current;
    if (element === null || index < 0) return;
    const { scrollTop, clientHeight } = element;
    if (index * ROW < scrollTop) element.scrollTop = Math.max(0, (index - 1) * ROW);
    else if ((index + 1) * ROW > scrollTop + clientHeight) element.scrollTop = (index + 2) * ROW - clientHeight;
  };
  // The chosen segment stays in sight when it changes, not when the list is scrolled by hand.
  useEffect(() => {
    setWalked(null);
    show(here);
  }, [here, selection.value[0]]);

  const walk = (to: number) => {
    const index = Math.min(Math.max(to, 0), items.length - 1);
    setWalked(index);
    show(index);
  };
  const { first, end } = rowsInSight(items.length, top, height);
  return (
    <div
      class="queue-list"
      ref={box}
      role="listbox"
      tabIndex={0}
      aria-label={say("queue.list")}
      aria-activedescendant={active >= first && active < end ? `queue-${active}` : undefined}
      onScroll={(event) => setTop(event.currentTarget.scrollTop)}
      onMouseDown={(event) => {
        // The focus stays where it was: after a click the page's keys go on.
        if (event.target !== event.currentTarget) event.preventDefault();
      }}
      onKeyDown={(event) => {
        const page = Math.max(1, Math.floor(height / ROW) - 1);
        const steps: Record<string, number> = { ArrowDown: 1, ArrowUp: -1, PageDown: page, PageUp: -page };
        const step = steps[event.key];
        const item = items[active];
        if (event.ctrlKey || event.altKey || event.metaKey || event.shiftKey) return;
        if (step !== undefined) walk(active + step);
        else if (event.key === "Home") walk(0);
        else if (event.key === "End") walk(items.length - 1);
        else if (event.key === "Enter" && walked !== null && item !== undefined) void openItem(item);
        else return;
        event.preventDefault();
        event.stopPropagation();
      }}
    >
      <div class="queue-rows" style={{ height: `${items.length * ROW}px` }}>
        {items.slice(first, end).map((item, index) => (
          <Row
            key={`${item.take}\n${item.tier}\n${item.id}`} item={item} index={first + index} count={items.length}
            isChosen={first + index === here} isActive={first + index === active}
          />
        ))}
      </div>
    </div>
  );
}

interface RowProps {
  item: QueueItem;
  index: number;
  count: number;
  isChosen: boolean;
  isActive: boolean;
}

function Row({ item, index, count, isChosen, isActive }: RowProps) {
  const rate = scene.value?.take === item.take ? scene.value.rate : rateOf(item);
  return (
    <div
      class={`queue-row ${isActive ? "queue-row-active" : ""} ${item.status === "proposed" ? "" : "queue-row-done"}`}
      id={`queue-${index}`} role="option" aria-selected={isChosen} aria-posinset={index + 1} aria-setsize={count}
      style={{ transform: `translateY(${index * ROW}px)` }} onClick={() => void openItem(item)}
      data-segment={item.id}
    >
      <span class="queue-row-line">
        <Swatch colours={coloursOf(item.label, item.tier)} />
        <strong class="elide">{item.label}</strong>
        {item.second !== "" && item.status === "proposed" && (
          <span class="soft small elide">{say("queue.second", { label: item.second })}</span>
        )}
        <span class="grow" />
        {item.status === "proposed" ? <Confidence value={item.confidence} /> : <StatusBadge status={item.status} />}
      </span>
      <span class="queue-row-line soft small">
        <span class="elide" title={item.take}>{item.take}</span>
        <span class="grow" />
        <span class="number">{formatTime(item.onset, rate)} · {formatFixed(item.seconds, 2)} s</span>
      </span>
    </div>
  );
}

/** Frames per second of an item's take: by its take, else by its own length. */
function rateOf(item: QueueItem): number {
  const row = corpus.value?.takes.find((one) => one.take === item.take);
  return row?.rate ?? (item.seconds > 0 ? (item.offset - item.onset) / item.seconds : 1);
}
