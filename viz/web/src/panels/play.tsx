// The play bar: the instant shown, the speed of playing, and jumps.

import type { ComponentChildren } from "preact";
import { useState } from "preact/hooks";
import { isFile } from "#core/page_file.ts";
import { parseInstant, RATES } from "#core/playback.ts";
import { store } from "#core/store.ts";
import { shorten } from "#core/text.ts";
import type { Page } from "#drawing/page.ts";
import { fieldValue } from "#panels/components.tsx";

/** drawn in a box of 16 x 16 */
const ICONS: Record<string, string> = {
  begin: "M4 3v10M13 3 6 8l7 5Z",
  back: "M11 3 5 8l6 5Z",
  play: "M5 3l8 5-8 5Z",
  pause: "M5 3v10M11 3v10",
  forward: "M5 3l6 5-6 5Z",
  end: "M12 3v10M3 3l7 5-7 5Z",
  loop: "M12 7V5H3.5M5.5 3l-2 2 2 2M4 9v2h8.5M10.5 9l2 2-2 2",
};
/** kind, sign, key */
const KINDS: [string, string, string][] = [
  ["failure", "\u2715", "F"],
  ["preempt", "\u2298", "P"],
  ["goal", "\u25ce", "G"],
];

const IconButton = ({
  name,
  title,
  ...more
}: {
  name: string;
  title: string;
  onClick: () => void;
  id?: string;
  disabled?: boolean;
  "aria-pressed"?: boolean;
  class?: string;
}) => (
  <button class="icon-button" title={title} aria-label={title} {...more}>
    <svg viewBox="0 0 16 16" aria-hidden="true">
      <path d={ICONS[name]} />
    </svg>
  </button>
);

export function PlayBar({ page }: { page: Page }) {
  store.playback.watch();
  const first = store.data.run.first();
  if (first === null) return null;
  const goes = store.playback.goes.value;
  const live = store.playback.cursor.value === null;
  const end = isFile() || store.data.facts.value?.recorded ? "End" : "Live";
  return (
    <div class="play" role="region" aria-label="play bar">
      <span class="group">
        <IconButton name="begin" title="to the beginning (Home)" onClick={() => store.playback.seek(first)} />
        <IconButton name="back" title="one event back (,)" onClick={() => store.playback.seekEvent(-1)} />
        <IconButton
          name={goes ? "pause" : "play"}
          title={goes ? "hold the picture" : "play"}
          id="play"
          onClick={() => store.playback.togglePlaying()}
        />
        <IconButton name="forward" title="one event forward (.)" onClick={() => store.playback.seekEvent(1)} />
        <IconButton
          name="end"
          class="icon-button to-end"
          title="to the end (End)"
          onClick={() => page.timeline.live()}
        />
      </span>
      <Clock />
      <label class="rate">
        <span class="hidden">speed</span>
        <select
          value={store.playback.rate.value}
          title="speed"
          onChange={(e: Event) => store.playback.setRate(Number(fieldValue(e)))}
        >
          {RATES.map((rate) => (
            <option value={rate}>{rate} ×</option>
          ))}
        </select>
      </label>
      <LoopButton />
      <Jumps />
      <span class="spread" />
      <button
        title="back to now (l)"
        class={`live-button ${live ? "on" : ""}`}
        aria-pressed={live}
        onClick={() => page.timeline.live()}
      >
        {end}
      </button>
    </div>
  );
}

function LoopButton() {
  const [on, found] = [store.playback.looping.value, store.playback.stretch.value];
  const what = found
    ? `from ${store.clock.instantText(found.from)} to ${store.clock.instantText(found.to)}`
    : "over the selected state's visit; drag in the timeline to select a stretch";
  return (
    <IconButton
      name="loop"
      class={`icon-button ${on ? "on" : ""}`}
      aria-pressed={on}
      id="loop"
      title={`loop ${what} (r)`}
      onClick={() => store.playback.toggleLoop()}
    />
  );
}

/** The instant shown, as a text field. */
function Clock() {
  store.playback.watch();
  const last = store.data.run.last() ?? 0;
  // The run must not overwrite what is being typed.
  const [typed, setTyped] = useState<string | null>(null);
  const onChange = (e: Event) => {
    const seconds = parseInstant(fieldValue(e));
    if (seconds === null)
      store.view.notify(`Instant: got ${shorten(fieldValue(e), 30)}; expected such as 01:32.5`, "error");
    else store.playback.seek((store.playback.began() ?? 0) + seconds * 1000);
    (e.target as HTMLInputElement).blur();
  };
  const onFocus = (e: Event) => {
    setTyped(fieldValue(e));
    (e.target as HTMLInputElement).select();
  };
  const text = typed ?? store.clock.runText(store.playback.nowMs());
  return (
    <span class="clock">
      <input
        value={text}
        style={{ width: `${Math.max(9, text.length + 1.5)}ch` }}
        aria-label="instant shown; type another one"
        title="type an instant to go there"
        autocomplete="off"
        onInput={(e: Event) => setTyped(fieldValue(e))}
        onChange={onChange}
        onFocus={onFocus}
        onBlur={() => setTyped(null)}
      />
      <small>/ {store.clock.runText(Math.max(last, store.playback.nowMs()))}</small>
    </span>
  );
}

function Jumps() {
  store.playback.watchSlowly();
  const keys = [...store.data.marks.keys].sort();
  const key = store.playback.followedKey.value ?? keys[0];
  const choose = (e: Event) => {
    store.playback.followedKey.value = fieldValue(e);
  };
  return (
    <span class="jumps" role="group" aria-label="go to the next">
      <span class="hint">Next</span>
      {KINDS.map(([kind, sign, letter]) => (
        <Jump name={`kind ${kind}`} letter={letter}>
          <i class={`to-${kind}`}>{sign}</i> <span class="kind">{kind}</span>
        </Jump>
      ))}
      {keys.length > 0 && (
        <>
          <select value={key} onChange={choose} aria-label="key of userdata" title={`key of userdata: ${key}`}>
            {keys.map((one) => (
              <option value={one}>{shorten(one, 24)}</option>
            ))}
          </select>
          <Jump name={`key ${key}`} letter="K">
            <i>{"\u0394"}</i> <span class="kind">change</span>
          </Jump>
        </>
      )}
    </span>
  );
}

function Jump({ name, letter, children }: { name: string; letter: string; children?: ComponentChildren }) {
  const ahead = store.playback.jumpOf(name, 1) !== null;
  const title = `${ahead ? "go there" : "none ahead"} (${letter.toLowerCase()}); before it: Shift+${letter}`;
  return (
    <button
      class={ahead ? "" : "none"}
      aria-disabled={!ahead}
      title={title}
      onClick={(e: MouseEvent) => store.playback.jump(name, e.shiftKey ? -1 : 1)}
    >
      {children}
      <kbd>{letter}</kbd>
    </button>
  );
}
