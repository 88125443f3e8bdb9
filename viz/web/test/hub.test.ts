import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { Hub } from "#core/hub.ts";
import { Clock } from "./fixtures.ts";

/** Streams that were opened, the newest last; each does what the test tells it. */
let streams: Stream[] = [];
let clock = new Clock();

class Stream extends EventTarget {
  url: string;
  query: URLSearchParams;
  readyState = 1;
  onopen = () => {};
  onerror = () => {};
  constructor(url: string) {
    super();
    this.url = url;
    this.query = new URL(url, "http://x").searchParams;
    streams.push(this);
  }
  close() {
    this.readyState = 2;
  }
  say(event: string, data: any, lastEventId = "") {
    this.dispatchEvent(Object.assign(new Event(event), { data: JSON.stringify(data), lastEventId }));
  }
}

/** A page with the messages that it got. */
class Page {
  got: any[] = [];
  onmessage: any = null;
  postMessage = (message: any) => this.got.push(message);
  constructor(hub: Hub) {
    hub.add(this);
  }
  tell(told: any) {
    this.onmessage({ data: told });
  }
  follow(machine: string, last = "", hidden = false) {
    this.tell({ kind: "follow", machine, last, seen: -1, hidden });
  }
  events = () =>
    this.got.map(({ event }) => event).filter((event) => !["settings", "machines", "standing"].includes(event));
}

beforeEach(() => {
  streams = [];
  clock = new Clock();
  clock.install();
  Object.assign(globalThis, { EventSource: Stream });
});

const newest = () => streams.at(-1) as Stream;

function opened() {
  const hub = new Hub({ isShared: true });
  const [one, two] = [new Page(hub), new Page(hub)];
  one.follow("a");
  clock.pass(100);
  newest().say("settings", { beat: 2 });
  newest().say("snap", { name: "a", events: [] }, "e%3A5");
  return { hub, one, two };
}

test("all pages of a browser share one stream, which follows what they show", () => {
  const { one, two } = opened();
  two.follow("b");
  clock.pass(100);
  assert.equal(streams.length, 2);
  assert.equal(streams[0].readyState, 2);
  assert.deepEqual(newest().query.getAll("machine"), ["a", "b"]);
  assert.deepEqual(newest().query.getAll("last"), ["e:5", ""]); // the first page goes on where it was
  newest().say("snap", { name: "b", events: [] });
  newest().say("events", { name: "a", seq: 6, events: [{}] }, "e%3A6 f%3A1");
  assert.deepEqual(one.events(), ["snap", "events"]);
  assert.deepEqual(two.events(), ["snap"]);
});

test("a page of the same machine gets a snapshot of its own", () => {
  const { one, two } = opened();
  two.follow("a");
  newest().say("events", { name: "a", seq: 6, events: [{}] }, "e%3A6");
  assert.deepEqual(two.events(), []); // it has nothing to which it could add
  clock.pass(100);
  assert.deepEqual(newest().query.getAll("last"), [""]);
  newest().say("snap", { name: "a", events: [] }, "e%3A6");
  assert.deepEqual(two.events(), ["snap"]);
  assert.deepEqual(one.events(), ["snap", "events", "snap"]); // and leaves out what it has
});

test("a page that asks for no machine stays with the first one that is there", () => {
  const hub = new Hub({ isShared: true });
  const page = new Page(hub);
  page.follow("");
  clock.pass(100);
  assert.deepEqual(newest().query.getAll("machine"), []);
  newest().say("machines", {
    machines: [
      { name: "b", stale: null },
      { name: "a", stale: 5 },
    ],
    gone: [],
  });
  clock.pass(100);
  assert.deepEqual(newest().query.getAll("machine"), ["b"]);
  newest().say("machines", { machines: [{ name: "a", stale: null }], gone: [] });
  page.follow("");
  clock.pass(100);
  assert.deepEqual(newest().query.getAll("machine"), ["a"]);
});

test("hidden pages get the list only, and continue where they were", () => {
  const { one } = opened();
  one.follow("a", "e:5", true);
  newest().say("events", { name: "a", seq: 6, events: [{}] }, "e%3A6");
  clock.pass(10_000);
  assert.deepEqual(newest().query.getAll("machine"), []);
  newest().say("machines", { machines: [{ name: "a", stale: null, questions: 1 }], gone: [] });
  assert.equal(one.got.at(-1).event, "machines");
  one.follow("a", "e:5");
  clock.pass(100);
  assert.deepEqual(newest().query.getAll("last"), ["e:5"]);
  newest().say("events", { name: "a", seq: 6, events: [{}] }, "e%3A6");
  assert.deepEqual(one.events(), ["snap", "events"]);
});

test("without a shared worker a hidden page closes its stream", () => {
  const hub = new Hub({ isShared: false });
  const page = new Page(hub);
  page.follow("a");
  clock.pass(100);
  page.follow("a", "e:5", true);
  clock.pass(10_000);
  assert.equal(newest().readyState, 2);
});

test("pages that are gone are followed no longer, whether they said so or not", () => {
  const { one, two } = opened();
  two.follow("b");
  clock.pass(100);
  two.tell({ kind: "bye" });
  clock.pass(10_000);
  assert.deepEqual(newest().query.getAll("machine"), ["a"]);
  clock.pass(200_000); // the other one was killed
  one.tell({ kind: "here" });
  two.follow("b");
  clock.pass(100);
  assert.deepEqual(newest().query.getAll("machine").includes("b"), true);
});

test("a stream without beats is opened again, later if the link is slow", () => {
  const { one } = opened();
  const count = streams.length;
  clock.pass(6_000);
  assert.equal(streams.length, count + 1);
  assert.equal(one.got.findLast(({ standing }) => standing).standing.state, "lost");
  newest().onopen();
  assert.equal(one.got.at(-1).standing.state, "live");
});

test("a page learns why the server refuses the stream", async () => {
  const { one } = opened();
  const refusal = { ok: false, text: "token: missing", wants_token: true };
  Object.assign(globalThis, { fetch: async () => ({ ok: false, json: async () => refusal }) });
  newest().close();
  newest().onerror();
  for (let i = 0; i < 10; i++) await Promise.resolve();
  assert.deepEqual(one.got.at(-1).standing, { state: "lost", problem: "token: missing", wantsToken: true });
  const count = streams.length;
  clock.pass(1_500);
  assert.equal(streams.length, count + 1); // it keeps trying
});
