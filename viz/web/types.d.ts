// Types of the server's messages (viz/live) and of data that modules share; only for the type checker.

type Theme = "system" | "light" | "dark";
type OutcomeClass = "success" | "failure" | "preempted" | "other";

// An event as written by `smachpy.events.to_record`; its fields depend on `kind`.
interface RunEvent {
  kind: string;
  path: string;
  stamp_ns: number;
  seq: number;
  dropped?: number;
  progress?: Progress;
  [field: string]: any;
}

interface Progress {
  fraction: number | null;
  distance: number | null;
  text: string;
}

interface PreemptRequest {
  source: string | null;
  by: string | null;
  why: string | null;
  grace: number | null;
}

// `smachpy.events.run_state.RunState`. Times are nanoseconds since the epoch, `seconds` is of finished visits.
interface StateRun {
  visits: number;
  since: number | null;
  left?: number | null;
  outcome: string | null;
  outcomes: Record<string, number>;
  seconds: number;
  error?: string | null;
  attempt?: number;
  item?: number;
  waits?: string | null;
  preempt?: number | null;
  asked?: PreemptRequest | null;
  serviced?: number | null;
  abandoned?: number | null;
  question?: Question; // of its newest visit
  marking?: string[]; // of a plan: ids of its places that hold tokens
  fired?: string; // id of its newest transition
  held?: Record<string, string>; // id of a transition -> why it does not fire
}

interface Question {
  text: string;
  answers: string[];
  words: string[];
  default: string;
  patience: number; // [s]
  service: string;
  has_picture: boolean;
  asked: number;
  answer: string | null;
  by: string | null;
  answered: number | null;
}

interface GoalRun {
  path: string;
  action: string;
  since: number;
  goal: any;
  feedback: any;
  first_feedback: any;
  status: string;
  text: string;
  result: any;
  ended: number | null;
  attempt: number;
  progress?: Progress;
}

interface UserdataEntry {
  key: string;
  value: any;
  writer: string;
  at: number;
  container: string;
}

interface RunState {
  run: number;
  started: number | null;
  ended: number | null;
  outcome: string | null;
  states: Record<string, StateRun>;
  goals: Record<string, GoalRun>;
  userdata: Record<string, UserdataEntry>;
  outages?: [number, number][]; // times without a process
  dropped?: number;
}

// The time of a visit; `to` is null while it runs, `outcome` is null if its end is unknown.
interface Span {
  path: string;
  from: number;
  to: number | null;
  outcome: string | null;
  preempt: number | null;
  asked: PreemptRequest | null;
  serviced: number | null;
  abandoned: number | null;
}
interface PreemptedSpan extends Span {
  preempt: number;
}
interface Preempt {
  from: number;
  to: number | null;
  rows: PreemptedSpan[];
  holds: PreemptedSpan[];
}

// A machine from `viz.live.assets.model`, with the fields that the page's `Model` adds to each node.
type Change = "" | "added" | "removed" | "changed" | "numbers";
interface Edge {
  source: string;
  target: string;
  to_outcome: boolean;
  outcomes: string[];
  implicit: boolean;
  back: boolean;
  change: Change;
  note: string;
}
interface Link extends Edge {
  rule: string | null;
  join: number | null; // number of the join that it leads to
}
// The bar at which the arrows of a rule over several children end.
interface Join {
  outcome: string;
  text: string;
  conditions: [string, string][];
  need: number; // number of conditions that must hold
  change: Change;
}
interface StateNode {
  path: string;
  label: string;
  kind: string;
  type_name: string;
  doc: string;
  details: [string, string][];
  outcomes: string[];
  children: StateNode[];
  initial: string[];
  edges: Edge[];
  rules: { outcome: string; conditions: [string, string][]; text: string; change: Change }[];
  pills: { outcome: string; by_default: boolean }[];
  change: Change;
  note: string;
  caption: string; // shown in place of the label, for places and transitions of a net
  tokens: number;
  parent: StateNode | null;
  depth: number;
  number: number;
  total: number;
  name: string;
  shown: string;
  isRepeated: boolean; // whether several states have its name
  links: Link[];
  joins: Join[];
  wired: string[];
}
interface MachinePayload {
  explicit: StateNode;
  implicit: StateNode;
  keys: Record<string, { inputs: string[]; outputs: string[]; remapping: [string, string][] }>;
}

// The server's facts about a machine, besides its events.
interface Control {
  paused: boolean;
  breakpoints: [string, string | null][];
}
interface Problem {
  path: string;
  text: string;
  severity: string;
}
interface MachineFacts {
  name: string;
  label: string;
  epoch: string;
  revision: number;
  stale: number | null;
  control: Control | null;
  recorded: boolean;
  node: string;
  behind: number | null;
  before?: string | null; // the machine of the previous program
  after?: string | null; // of a previous program: the machine that took its place
}
interface MachineSummary extends MachineFacts {
  active: string[];
  started: number | null;
  ended: number | null;
  outcome: string | null;
  questions?: number; // number of unanswered questions
}
interface Snapshot extends MachineFacts {
  seq: number;
  problems: Problem[];
  base: RunState | null;
  events: RunEvent[];
}
interface Settings {
  follow: boolean;
  control: boolean;
  kept?: number;
  beat?: number;
  home?: boolean;
}
interface StateStatistics {
  visits: number;
  outcomes: Record<string, number>;
  median: number | null;
  p95: number | null;
  total: number;
  failures: number;
}
interface Statistics {
  runs: number;
  outcomes: Record<string, number>;
  median: number | null;
  p95: number | null;
  states: Record<string, StateStatistics>;
}
interface Comparison {
  with: string;
  model: MachinePayload;
  alone: MachinePayload;
  listed: { path: string; change: Exclude<Change, "">; text: string }[];
  runs: number[];
}
interface Answer {
  wants_token?: boolean;
  ok?: boolean;
  text?: string;
  [fact: string]: any;
}

// Actions on the network, and goals sent from the page.
interface ActionServer {
  name: string;
  type: string;
  node: string;
  servers: number;
}
interface SentGoal {
  id: string;
  action: string;
  state: string;
  status: string;
  text: string;
  sent: number;
  ended: number | null;
  feedback_count: number;
  cancelled: boolean;
  fraction: number | null;
  distance: number | null;
  feedback: string | null;
  result: string | null;
}
interface ActionsSeen {
  actions: ActionServer[];
  gone: string[];
  goals: SentGoal[];
  known: boolean;
}

// A field of a goal's form (viz/live/forms.py), and a problem with its value.
interface FormField {
  name: string;
  type: string;
  base: string;
  comment: string;
  array: { length: number | null } | null;
  choices: { name: string; value: string; comment: string }[];
  kind: "bool" | "integer" | "float" | "string" | "time" | "message";
  fields: FormField[];
  about: string;
  default: Record<string, any>;
}
interface FieldProblem {
  path: string;
  text: string;
}

interface Box {
  x: number;
  y: number;
  w: number;
  h: number;
}
interface Point {
  x: number;
  y: number;
}
type Direction = "DOWN" | "RIGHT";

interface Window {
  smachpy: unknown;
}

// The causes of a run's end from `viz.model.why`, from the first one to the outcome.
interface WhyStep {
  path: string;
  stamp_ns: number;
  what: string;
  kind: OutcomeClass;
  reason: string;
  detail: string;
  written: [string, string, string][]; // key, value, value before or ""
  outcome: string; // of the end of a state; else ""
}
interface Why {
  label: string;
  outcome: string | null;
  began: number | null;
  ended: number | null;
  steps: WhyStep[];
  text: string;
}

// Records of robot topics (smachpy.network.observations), and the page's data made from them (core/scene.js).
interface Observed {
  what: string;
  robot: string;
  stamp_ns: number;
  n: number;
  [field: string]: any;
}
interface Place extends Point {
  yaw: number;
}
interface Pose extends Place {
  t: number;
}
interface Scan {
  t: number;
  at: [number, number, number];
  first: number;
  step: number;
  ranges: number[];
}
interface GridMap {
  resolution: number;
  width: number;
  height: number;
  origin: [number, number, number];
  cells: string;
}
// A goal with a place; `visit` is the beginning of the visit that sent it.
interface DrivenGoal extends Place {
  id: string;
  path: string;
  visit: number;
  t: number;
  to: number | null;
  status: string;
  text: string;
}
interface Piece {
  path: string | null;
  visit: number | null;
  poses: Pose[];
}
interface Robot {
  poses: Pose[];
  observed: number | null; // time from which poses come from its topics
  scans: Scan[];
  plans: { t: number; points: [number, number][] }[];
  goals: DrivenGoal[];
  tasks: Pick<DrivenGoal, "id" | "path" | "visit" | "t" | "to">[]; // goals without a place
  pieces: Piece[];
  done: number; // number of poses that are in pieces
}
interface Series {
  name: string;
  unit: string;
  points: { t: number; value: number }[];
}
interface Visit {
  path: string;
  from: number;
}

// A run in the list (viz/runs/listing.py); times are nanoseconds since the epoch.
interface RunRow {
  id: string;
  name: string | null;
  machine: string;
  robots: string[];
  live: boolean;
  began: number | null;
  ended: number | null;
  last: number | null;
  outcome: string | null;
  reason: string;
  problem: string;
  file: string;
  strip: [number, string, number, number | null, string][]; // row, state, from and to [s], class
  outages: [number, number][]; // [s]
  run: string; // id of the run of a durable mission
  asks: boolean; // whether a question is open
  stamp: number | null; // `began` by the mission's own time, which may be virtual
  mission: Mission | null;
}

// `viz.live.journals.Journals`: a durable mission.
interface Mission {
  id: string;
  journal: string;
  status: string; // queued, running, interrupted, ended or cancelled
  active: string[];
  problem: string;
  can: string[]; // "resume", "cancel"
}

declare module "gifenc" {
  type Palette = number[][];
  interface Encoder {
    writeFrame(index: Uint8Array, width: number, height: number, options?: object): void;
    finish(): void;
    bytes(): Uint8Array<ArrayBuffer>;
  }
  function GIFEncoder(): Encoder;
  function quantize(rgba: Uint8ClampedArray, colours: number): Palette;
  function applyPalette(rgba: Uint8ClampedArray, palette: Palette): Uint8Array;
}

// `viz.live.simulations.Batch`
interface Batch {
  id: string;
  mission: string;
  runs: number;
  vary: string[];
  seed: number;
  limit: string;
  compare: string;
  began_ns: number;
  outcomes: Record<string, number>;
  failed: number;
  first_failure: string;
  running: boolean;
  problem: string;
  report: boolean;
}

// A live run with the data for the common map.
interface FleetRow extends RunRow {
  observed: Observed[];
  events: RunEvent[];
}
