// The states as a tree. Only the rows in view are drawn, as machines can have thousands of states.

import { useRef, useState } from "preact/hooks";
import { own } from "#core/fold.ts";
import { endClass } from "#core/outcomes.ts";
import { purposeOfState } from "#core/purposes.ts";
import { store } from "#core/store.ts";
import type { StateNode, StateRun } from "#core/types.ts";
import type { Page } from "#drawing/page.ts";

const ROW = 24; // [px]
const MARGIN = 6; // above and below the rows
const SPARE = 4; // rows that are drawn above and below the view
const MOST_INDENT = 12; // levels
const GLYPHS: Record<string, string> = {
  action: "\u25b6",
  service: "\u21c4",
  monitor: "\u25c9",
  condition: "?",
  machine: "\u25a3",
  sequence: "\u2192",
  concurrence: "\u2016",
  iterator: "\u21bb",
  missing: "\u2715",
};
const ENDED = { success: "\u2713", failure: "\u2715", preempted: "\u25a0", other: "\u2022" };

export function Tree({ page }: { page: Page }) {
  const [top, setTop] = useState(0);
  const [folded, setFolded] = useState(() => new Map() as Map<string, boolean>); // by the user
  const [chosen, setChosen] = useState<string | null>(null);
  const box = useRef<HTMLDivElement | null>(null);
  store.playback.watch();
  const model = store.data.model.value;
  if (!model) return <aside class="tree" />;
  const states = store.playback.shown().states;
  const isOpen = (node: StateNode) =>
    folded.get(node.path) ?? (own(states, node.path)?.since != null || store.view.opened.value.has(node.path));
  const rows = visibleRows(model.root, isOpen);
  const height = box.current?.clientHeight ?? 800;
  const first = Math.max(0, Math.floor(top / ROW) - SPARE);
  const inView = rows.slice(first, first + Math.ceil(height / ROW) + 2 * SPARE);
  const at = Math.max(
    0,
    rows.findIndex((node) => node.path === (chosen ?? store.view.selected.value)),
  );
  const fold = (node: StateNode) => setFolded(new Map(folded).set(node.path, !isOpen(node)));
  const goTo = (node: StateNode) => {
    setChosen(node.path);
    page.goTo(node.path);
    store.view.treeOpen.value = false;
  };
  const choose = (row: number) => {
    const to = Math.max(0, Math.min(row, rows.length - 1));
    const y = to * ROW + MARGIN;
    setChosen(rows[to].path);
    if (box.current) box.current.scrollTop = Math.max(y + ROW - height, Math.min(box.current.scrollTop, y - MARGIN));
  };
  const onKeyDown = (e: KeyboardEvent) => {
    if (e.ctrlKey || e.metaKey || e.altKey) return;
    const node = rows[at];
    const isContainer = node.children.length > 0;
    const screen = Math.max(1, Math.floor(height / ROW) - 1);
    const ends = { Home: 0, End: rows.length - 1, PageDown: at + screen, PageUp: at - screen };
    const row = { ArrowDown: at + 1, ArrowUp: at - 1, ...ends }[e.key];
    if (row !== undefined) choose(row);
    else if (e.key === "Enter" || e.key === " ") page.goTo(node.path);
    else if (e.key === "ArrowRight") {
      if (isContainer && !isOpen(node)) fold(node);
      else if (isContainer) choose(at + 1);
    } else if (e.key === "ArrowLeft") {
      if (isContainer && isOpen(node)) fold(node);
      else if (node.parent) choose(rows.indexOf(node.parent));
    } else return;
    e.preventDefault();
    e.stopPropagation();
  };
  return (
    <div
      class="tree"
      aria-label="states"
      role="tree"
      ref={box}
      tabindex={0}
      onScroll={(e: Event) => setTop((e.target as HTMLElement).scrollTop)}
      aria-activedescendant={`row-${rows[at].number}`}
      onKeyDown={onKeyDown}
    >
      <div style={{ height: `${rows.length * ROW}px` }} class="rows">
        {inView.map((node, i) => (
          <Row
            key={node.path}
            node={node}
            state={own(states, node.path)}
            open={isOpen(node)}
            place={first + i}
            isAt={first + i === at}
            onClick={() => goTo(node)}
            onFold={() => fold(node)}
          />
        ))}
      </div>
    </div>
  );
}

function visibleRows(root: StateNode, isOpen: (node: StateNode) => boolean) {
  const rows: StateNode[] = [];
  const walk = (node: StateNode) => {
    rows.push(node);
    if (isOpen(node)) node.children.forEach(walk);
  };
  walk(root);
  return rows;
}

function Row({
  node,
  state,
  open,
  place,
  isAt,
  onClick,
  onFold,
}: {
  node: StateNode;
  state: StateRun | undefined;
  open: boolean;
  place: number;
  isAt: boolean;
  onClick: () => void;
  onFold: () => void;
}) {
  const active = state?.since != null;
  const selected = store.view.selected.value === node.path;
  const isContainer = node.children.length > 0;
  const kind = state?.outcome != null ? endClass(node, state.outcome) : null;
  const visits = state?.visits ?? 0;
  const classes = ["row", isAt && "at", active && "active", active && state.preempt && "preempting"];
  const style = { top: `${place * ROW}px`, paddingLeft: `${8 + Math.min(node.depth, MOST_INDENT) * 14}px` };
  const onFoldClick = (e: Event) => {
    e.stopPropagation();
    onFold();
  };
  return (
    <div
      role="treeitem"
      id={`row-${node.number}`}
      aria-level={node.depth + 1}
      aria-selected={selected}
      aria-expanded={isContainer ? open : undefined}
      title={node.path}
      style={style}
      onClick={onClick}
      class={[...classes, selected && "selected"].filter(Boolean).join(" ")}
    >
      {isContainer ? (
        <button class="fold" tabindex={-1} aria-label={open ? "close" : "open"} onClick={onFoldClick}>
          {open ? "\u25be" : "\u25b8"}
        </button>
      ) : (
        <span class="kind">{GLYPHS[node.kind] ?? "\u00b7"}</span>
      )}
      <span class="name">{node.name}</span>
      {active && !isContainer && <span class="purpose">{purposeOfState(node.path)}</span>}
      {!active && kind && <span class={`ended ${kind}`}>{ENDED[kind]}</span>}
      {visits > 1 && <span class="times">×{visits}</span>}
    </div>
  );
}
