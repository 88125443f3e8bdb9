// Everything over the diagram: why nothing is shown, banners, the legend, notices, help.

import { useState } from "preact/hooks";
import { choose, takeToken } from "#core/connection.ts";
import { CHANGE_SIGNS } from "#core/model.ts";
import { isFile } from "#core/page_file.ts";
import { heatScale } from "#core/statistics.ts";
import { store } from "#core/store.ts";
import { askerText, duration, holdText, shorten } from "#core/text.ts";
import type { MachineSummary } from "#core/types.ts";
import type { Page } from "#drawing/page.ts";
import { Dialog, fieldValue, StateLink } from "#panels/components.tsx";

const MOST_NAMES = 12; // machines
const MOST_HOLDS = 3; // states in the banner for which a preempt waits
const LEGEND: [string, string][] = [
  ["active", "running"],
  ["success", "succeeded"],
  ["failure", "failed"],
  ["preempted", "preempted"],
  ["waiting", "waiting"],
];
const KEYS: [string, string][] = [
  ["Ctrl+K", "find or do by name"],
  ["/", "search"],
  ["c", "instants by the run, by the wall clock, or relative to now"],
  ["0", "fit everything"],
  ["f p g k", "next failure, preempt, goal, change of a key; with Shift the previous one"],
  ["Home End", "the beginning, the end"],
  ["m", "the map: + \u2212 zoom, 0 shows all"],
  ["o", "follow the running states"],
  ["+ \u2212", "zoom"],
  ["\u2190 \u2191 \u2192 \u2193", "move the view, or select a neighbour of the selected state"],
  ["Enter", "open or close the selected state"],
  [", .", "one event back or forward"],
  ["l", "return to live"],
  ["1 \u2026 9", "levels to open"],
  ["r [ ]", "loop over the selected stretch of the run; move its beginning or end to the instant shown"],
  ["w", "the causes of the run's end"],
  ["n", "note at the instant shown"],
  ["t", "states, on a small screen"],
  ["i", "implicit transitions"],
  ["a", "actions"],
  ["h", "runs"],
  ["d", "dark or light"],
  ["Space", "play or pause the view; pause or resume the mission (with control)"],
  ["s", "step (with control)"],
  ["Esc", "clear the selection"],
];

export function Overlay({ page }: { page: Page }) {
  const stale = store.data.facts.value?.stale;
  if (store.data.failure.value && store.data.model.value)
    return <div class="banner waiting">{store.data.failure.value}</div>;
  if (store.data.failure.value)
    return (
      <div class="empty">
        <p class="error">{store.data.failure.value}</p>
      </div>
    );
  if (!store.data.model.value) return <Empty />;
  if (store.status.runStatus.value.word === "stale" && stale != null)
    return (
      <div class="banner waiting">
        Stale: no message from this machine since {new Date(stale / 1e6).toLocaleTimeString("en-GB")}. You see its last
        known state.
      </div>
    );
  if (store.data.connection.value === "lost")
    return (
      <div class="banner waiting">
        {store.data.problem.value || "The viewer's server does not answer."} You see the last known state; this page
        keeps trying.
      </div>
    );
  if (store.playback.cursor.value !== null) {
    const isOver = store.data.facts.value?.recorded || isFile();
    const ago = ((store.data.run.last() ?? store.playback.cursor.value) - store.playback.cursor.value) / 1000;
    const when = isOver ? "before the end" : "ago";
    return (
      <div class="banner past">
        Viewing <b>{store.clock.instantText(store.playback.cursor.value)}</b>
        <span class="ago">
          , {duration(ago)} {when}
        </span>
        <button onClick={() => page.timeline.live()}>Back to {isOver ? "the end" : "live"}</button>
      </div>
    );
  }
  const after = store.data.facts.value?.after;
  if (after)
    return (
      <div class="banner other">
        You see an earlier run.<button onClick={() => choose(after)}>Show the newest</button>
      </div>
    );
  return <PreemptBanner page={page} />;
}

/** A notice that the program was started again, with a link to its previous run. */
function RestartBanner({ before }: { before: string }) {
  const dismiss = () => {
    store.view.dismissed.value = before;
  };
  return (
    <div class="banner other restarted" role="status">
      A new run began.<button onClick={() => choose(before)}>Look at the one before</button>
      <button aria-label="dismiss" onClick={dismiss}>
        ✕
      </button>
    </div>
  );
}

/** The banner of a running preempt: its origin, and the states for which it waits. */
function PreemptBanner({ page }: { page: Page }) {
  store.playback.watch();
  const now = store.playback.nowMs();
  const found = store.data.run.now.ended == null ? store.data.run.preemptAt(now) : null;
  const before = store.data.facts.value?.before;
  if (!found || found.to !== null)
    return before && store.view.dismissed.value !== before ? <RestartBanner before={before} /> : null;
  const by = askerText(found.rows[0].asked);
  const more = found.holds.length - MOST_HOLDS;
  return (
    <div class="banner preempted preempt-banner" role="status">
      <span>
        Preempt
        {by ? (
          <>
            {" "}
            by <b>{by}</b>
          </>
        ) : (
          ""
        )}
        . Held up by{" "}
      </span>
      {found.holds.slice(0, MOST_HOLDS).map((row, i) => (
        <>
          {i > 0 ? ", " : ""}
          <StateLink path={row.path} page={page} />
          <span class="times"> for {holdText(row, now)}</span>
        </>
      ))}
      {more > 0 ? ` and ${more} more` : ""}
    </div>
  );
}

function Empty() {
  const name = store.data.wanted.value;
  const list = store.data.machines.value;
  if (store.data.connection.value === "lost")
    return (
      <div class="empty">
        <p>{store.data.problem.value || "The viewer's server does not answer."} This page keeps trying.</p>
      </div>
    );
  if (!store.data.isMissing.value) return null; // the machine is being loaded
  const text = name ? `No machine is called \u201c${shorten(name, 80)}\u201d.` : "No machine on the network yet.";
  const others = list.slice(0, MOST_NAMES);
  const more = list.length - others.length;
  const button = (one: MachineSummary) => <button onClick={() => choose(one.name)}>{shorten(one.name, 60)}</button>;
  return (
    <div class="empty">
      <p>{text} This page shows it as soon as it runs.</p>
      {list.length ? (
        <>
          <p>These are there:</p>
          <p class="others">
            {others.map(button)}
            {more > 0 && `and ${more} more, in the list above`}
          </p>
        </>
      ) : (
        <pre>smachpy run patrol --start-robot</pre>
      )}
    </div>
  );
}

/** The progress of a long layout. */
export function Laying() {
  const laid = store.view.laidOut.value;
  if (!laid) return null;
  const { done, all } = laid;
  const text = `${done.toLocaleString("en")} of ${all.toLocaleString("en")} states`;
  return (
    <div class="laying" role="progressbar" aria-valuenow={done} aria-valuemax={all} aria-label={text}>
      <i style={`width:${(100 * done) / all}%`} />
      <span>{text}</span>
    </div>
  );
}

export function Legend() {
  if (store.data.comparison.value) {
    const changes = ["added", "removed", "changed"] as const;
    return (
      <div class="legend" aria-hidden="true">
        {changes.map((change) => (
          <span>
            <b class={change} />
            {CHANGE_SIGNS[change]} {change}
          </span>
        ))}
      </div>
    );
  }
  store.playback.watchSlowly();
  const scale = heatScale(store.view.numbers.value, store.playback.shown().states, store.data.model.value);
  return (
    <div class="legend" aria-hidden="true">
      {scale && (
        <span class="scale">
          {scale[0]}
          <b class="heat" />
          {scale[1]}
        </span>
      )}
      {LEGEND.map(([kind, text]) => (
        <span>
          <b class={kind} />
          {text}
        </span>
      ))}
      {store.view.overview.value && (
        <span class="hint" title="double-click opens a state with its arrows">
          double-click opens one
        </span>
      )}
    </div>
  );
}

export function Notice() {
  const notice = store.view.notice.value;
  return (
    <div class="notices" aria-live="assertive">
      {notice && <div class={`notice ${notice.kind}`}>{notice.text}</div>}
    </div>
  );
}

export function Help() {
  if (!store.view.help.value) return null;
  const close = () => {
    store.view.help.value = false;
  };
  return (
    <Dialog label="keys" class="keys" onClose={close}>
      <header>
        <h2>Keys</h2>
        <button onClick={close}>Close</button>
      </header>
      <dl>
        {KEYS.map(([key, text]) => (
          <>
            <dt>
              <kbd>{key}</kbd>
            </dt>
            <dd>{text}</dd>
          </>
        ))}
      </dl>
    </Dialog>
  );
}

/** Asks for the new token, in an old tab after a restart of the viewer. */
export function TokenDialog() {
  const [text, setText] = useState("");
  const [wrong, setWrong] = useState(false);
  if (!store.view.tokenAsked.value) return null;
  const close = () => {
    store.view.tokenAsked.value = false;
  };
  const onSubmit = (e: Event) => {
    e.preventDefault();
    const taken = takeToken(text);
    setWrong(!taken);
    if (taken) setText("");
  };
  return (
    <Dialog label="token" class="token" onClose={close}>
      <form onSubmit={onSubmit}>
        <h2>The viewer has a new token</h2>
        <p>It was restarted. Paste the printed address, or the token at its end.</p>
        <input
          aria-label="address or token"
          autocomplete="off"
          spellcheck={false}
          value={text}
          autofocus
          onInput={(e: Event) => setText(fieldValue(e))}
        />
        {wrong && <p class="problem">no token; expected ADDRESS/#token=TOKEN, or TOKEN</p>}
        <p>
          <button class="primary" type="submit">
            Use it
          </button>{" "}
          <button type="button" onClick={close}>
            Only look
          </button>
        </p>
      </form>
    </Dialog>
  );
}
