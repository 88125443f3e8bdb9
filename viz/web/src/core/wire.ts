// What the server and its pages tell each other. Made by viz/web/wire_types.py.

export type Json = null | boolean | number | string | Json[] | { [key: string]: Json };

/** The answer of a command. */
export interface Done {
  ok: true;
  text: string;
}

/** Whether a machine is paused, and its breakpoints: path, and outcome or null for any. */
export interface ControlState {
  paused: boolean;
  breakpoints: [string, string | null][];
}

/** A machine in the list; `questions`: number of open ones. */
export interface MachineSummary {
  name: string;
  label: string;
  epoch: string;
  revision: number;
  stale: number | null;
  control: ControlState | null;
  recorded: boolean;
  node: string;
  behind: number | null;
  before: string | null;
  after: string | null;
  refused: number;
  refusal: string;
  noted: number;
  active: string[];
  started: number | null;
  ended: number | null;
  outcome: string | null;
  questions: number;
}

/** The transitions of one container from one state to one target. */
export interface Edge {
  source: string;
  target: string;
  to_outcome: boolean;
  outcomes: string[];
  implicit: boolean;
  back: boolean;
  change: string;
  note: string;
}

/** How several children of a container decide on its outcome together. */
export interface RulePicture {
  outcome: string;
  conditions: [string, string][];
  text: string;
  change: string;
}

/** An outcome on the border of an open container. */
export interface Pill {
  outcome: string;
  by_default: boolean;
}

/** A state in a picture. */
export interface Node {
  path: string;
  label: string;
  kind: string;
  type_name: string;
  doc: string;
  details: [string, string][];
  outcomes: string[];
  hidden: number;
  children: Node[];
  initial: string[];
  edges: Edge[];
  rules: RulePicture[];
  default_outcome: string | null;
  pills: Pill[];
  change: string;
  note: string;
  caption: string;
  tokens: number;
  success: string[] | null;
}

/** The userdata keys of a state; `remapping`: pairs of its own name and its container's. */
export interface StateKeys {
  inputs: string[];
  outputs: string[];
  remapping: [string, string][];
}

/** The model of a machine as it is now. */
export interface RevisedModel {
  explicit: Node;
  implicit: Node;
  keys: Record<string, StateKeys>;
  revision: number;
}

/** Of recorded runs: the visits of a state; durations [s]. */
export interface StateStatistics {
  visits: number;
  outcomes: Record<string, number>;
  median: number | null;
  p95: number | null;
  total: number;
  failures: number;
  retries: number;
}

/** Of recorded runs of a machine; durations [s]. */
export interface RunStatistics {
  runs: number;
  outcomes: Record<string, number>;
  median: number | null;
  p95: number | null;
  states: Record<string, StateStatistics>;
}

/** One cause in the chain. */
export interface Cause {
  path: string;
  stamp_ns: number;
  what: string;
  kind: string;
  reason: string;
  detail: string;
  written: [string, string, string][];
  outcome: string;
  read: [string, string, string, number][];
}

/** The causes of a run's end (`smachpy_viz.model.why.Explanation`), also as text. */
export interface WhyAnswer {
  label: string;
  outcome: string | null;
  began: number | null;
  ended: number | null;
  steps: Cause[];
  text: string;
}

/** A machine to draw, without and with its implicit transitions; `keys` by path. */
export interface MachineModel {
  explicit: Node;
  implicit: Node;
  keys: Record<string, StateKeys>;
}

/** A state in which two machines differ. */
export interface Difference {
  path: string;
  change: "added" | "removed" | "changed" | "numbers";
  text: string;
}

/** A machine and another one, `with`, in one drawing. */
export interface Comparison {
  with: string;
  model: MachineModel;
  listed: Difference[];
  runs: number[];
}

/** A userdata value, unabridged. */
export interface WholeValue {
  ok: true;
  text: string;
}

/** A durable mission; `can`: the commands that it accepts now. */
export interface MissionFacts {
  id: string;
  journal: string;
  status: "queued" | "running" | "interrupted" | "ended" | "cancelled";
  active: string[];
  problem: string;
  can: ("resume" | "cancel")[];
}

/** A run in the list. */
export interface RunRow {
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
  strip: [number, string, number, number | null, "success" | "failure" | "preempted" | "other" | "active" | "waiting"][];
  outages: [number, number][];
  run: string;
  asks: boolean;
  stamp: number | null;
  mission: MissionFacts | null;
}

/** A store of durable missions. */
export interface JournalPlace {
  name: string;
  problem: string;
}

/** Live and past runs. */
export interface RunList {
  runs: RunRow[];
  folders: string[];
  journals: JournalPlace[];
}

/** Where a robot is. */
export interface PoseRecord {
  kind: "Observed";
  path: string;
  stamp_ns: number;
  robot: string;
  n?: number;
  what: "pose";
  at: [number, number, number];
}

/** A scan from the pose `at`: distances [cm], -1 for nothing, at `first` + i `step` [rad]. */
export interface ScanRecord {
  kind: "Observed";
  path: string;
  stamp_ns: number;
  robot: string;
  n?: number;
  what: "scan";
  at: [number, number, number];
  first: number;
  step: number;
  ranges: number[];
}

/** The way that a robot wants to take, [x, y] in the map frame [m]; empty for none. */
export interface PlanRecord {
  kind: "Observed";
  path: string;
  stamp_ns: number;
  robot: string;
  n?: number;
  what: "plan";
  points: [number, number][];
}

/** A map; `origin` is the pose of its lower left corner. */
export interface MapRecord {
  kind: "Observed";
  path: string;
  stamp_ns: number;
  robot: string;
  n?: number;
  what: "map";
  resolution: number;
  width: number;
  height: number;
  origin: [number, number, number];
  cells: string;
}

/** A value with a name and a unit, such as the battery's charge [%]. */
export interface ValueRecord {
  kind: "Observed";
  path: string;
  stamp_ns: number;
  robot: string;
  n?: number;
  what: "value";
  name: string;
  value: number;
  unit: string;
}

/** Numbers of a message: path in the message ("linear.x") -> number. */
export interface ValuesRecord {
  kind: "Observed";
  path: string;
  stamp_ns: number;
  robot: string;
  n?: number;
  what: "values";
  topic: string;
  values: Record<string, number>;
}

/** A record of a robot's topic. */
export type Observation = PoseRecord | ScanRecord | PlanRecord | MapRecord | ValueRecord | ValuesRecord;

/** The fields of each kind of event (`smachpy.events`), besides common ones. */
export interface EventFields {
  Started: { initial: string[] };
  Recovered: { mission: string; began_ns: number; outages: [number, number][]; active: [string, number][] };
  Finished: { outcome: string | null };
  Entered: object;
  Left: { outcome: string };
  Failed: { error: string; trace: string };
  PreemptRequested: { source: string; by: string; why: string; grace: number | null };
  PreemptServiced: object;
  Preempted: { label: string };
  Abandoned: { grace: number; stack: string };
  TimedOut: { timeout: number };
  Retried: { attempt: number; reason: string };
  Iterated: { number: number };
  Noted: { text: string };
  ResourceUse: { resource: string; status: string; holder: string };
  CallbackFailed: { callback: string; error: string };
  UserdataWritten: { key: string; value: Json };
  Paused: { reason: string };
  Resumed: object;
  Jumped: { label: string };
  OutcomeForced: { outcome: string };
  Fired: { transition: string; marking: string[] };
  HeldBack: { transitions: string[]; guards: string[]; truths: string[] };
  QuestionAsked: { text: string; answers: string[]; words: string[]; default: string; patience: number; service: string; has_picture: boolean };
  QuestionAnswered: { answer: string; by: string };
  GoalSent: { action: string; goal_id: string; goal: Json };
  GoalFeedback: { action: string; goal_id: string; feedback: Json; progress?: ProgressFacts };
  GoalDone: { action: string; goal_id: string; status: string; text: string; result: Json };
}

export type EventKind = keyof EventFields;

/** An event of one kind; `dropped` events are missing before it. */
export type EventOf<K extends EventKind> = EventFields[K] & {
  kind: K;
  path: string;
  t: number;
  stamp_ns: number;
  seq: number;
  dropped?: number;
};

/** An event of any kind. */
export type RunEvent = { [K in EventKind]: EventOf<K> }[EventKind];

/** The progress of a goal: `smachpy_viz.model.progress.Progress`. */
export interface ProgressFacts {
  fraction: number | null;
  distance: number | null;
  text: string;
}

/** A live run with the data for the common map. */
export interface FleetRow {
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
  strip: [number, string, number, number | null, "success" | "failure" | "preempted" | "other" | "active" | "waiting"][];
  outages: [number, number][];
  run: string;
  asks: boolean;
  stamp: number | null;
  mission: MissionFacts | null;
  observed: Observation[];
  events: RunEvent[];
}

/** Some of the live runs: those after `skip` of `total`. */
export interface FleetPage {
  rows: FleetRow[];
  skip: number;
  total: number;
}

/** Something about a visit that can be compared. */
export interface Fact {
  name: string;
  unit: string;
  here: string;
  number: number | null;
  good: number[];
  texts: string[];
  differs: boolean;
}

/** The comparison. */
export interface GoodRuns {
  path: string;
  runs: number;
  facts: Fact[];
  text: string;
}

/** The machine that shows a run. */
export interface Opened {
  ok: true;
  name: string;
}

/** A batch of simulated runs (`smachpy_viz.live.simulations.Batch`). */
export interface BatchRow {
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

/** The missions that may be simulated, name -> description, and the batches, newest first. */
export interface SimulationList {
  missions: Record<string, string>;
  batches: BatchRow[];
}

/** Where a reproduced run first differs (`smachpy.reproduce.compare.Difference`); times in s. */
export interface RunDifference {
  number: number;
  at: number;
  path: string;
  before: string[];
  recorded: string;
  now: string;
  recorded_next: string[];
  now_next: string[];
  later: number;
}

/** What a reproduction has found (`smachpy_viz.live.reproductions.Found`). */
export interface Found {
  kind: "same" | "differs" | "failed" | "test";
  text: string[];
  same: number;
  events: number;
  difference: RunDifference | null;
  changed: string[];
  notes: string[];
  machine: string;
  test: string;
  file: string;
}

/** A reproduction; `found` is null while it runs, and where there is a problem. */
export interface Reproduction {
  running: boolean;
  problem: string;
  found: Found | null;
}

/** The length of an array; null for any. */
export interface ArrayLength {
  length: number | null;
}

/** A constant that is meant for a field. */
export interface ConstantChoice {
  name: string;
  value: string;
  comment: string;
}

/** A field of a goal's form; `least` and `most` of an integer, the last three of a message. */
export interface FormField {
  name: string;
  type: string;
  base: string;
  comment: string;
  array: ArrayLength | null;
  choices: ConstantChoice[];
  kind: "bool" | "integer" | "float" | "string" | "time" | "message";
  least?: string;
  most?: string;
  fields?: FormField[];
  about?: string;
  default?: Record<string, Json>;
}

/** The data for a goal's form; numbers in `values` are texts. */
export interface GoalForm {
  name: string;
  type: string;
  about: string;
  fields: FormField[];
  values: Record<string, Json>;
  yaml: string;
}

/** A running goal of a server; `sender`: the node in its id, `gone` if that is no client now. */
export interface ServerGoal {
  id: string;
  status: string;
  stamp: number;
  text: string;
  sender: string;
  gone: boolean;
  mission: string;
}

/** A note at an instant of a run, by the robot's clock; `by`: who wrote it. */
export interface RunNote {
  stamp_ns: number;
  text: string;
  by: string;
}

/** A goal that was read from YAML. */
export interface CheckedGoal {
  ok: true;
  values: Record<string, Json>;
  yaml: string;
}

/** The id of a goal that was sent. */
export interface GoalAccepted {
  ok: true;
  goal: string;
}

/** The batch that was started. */
export interface BatchStarted {
  ok: true;
  batch: string;
}

/** The reproduction that was started. */
export interface ReproductionStarted {
  ok: true;
  id: string;
}

/** The first message of a stream. */
export interface Settings {
  follow: boolean;
  control: boolean;
  beat: number;
  kept: number;
  home: boolean;
  reproduces: boolean;
}

/** The summaries that have changed, in the first message all, and the names that are gone. */
export interface MachineChanges {
  machines: MachineSummary[];
  gone: string[];
}

/** A finding of `smachpy check`. */
export interface CheckProblem {
  rule: string;
  severity: string;
  path: string;
  text: string;
}

/** Who asked a state to stop: fields of `PreemptRequested`; None in older recordings. */
export interface PreemptFacts {
  source: string | null;
  by: string | null;
  why: string | null;
  grace: number | null;
}

/** A question: fields of `QuestionAsked`, when it was asked, and the answer. */
export interface QuestionFacts {
  text: string;
  answers: string[];
  words: string[];
  default: string;
  patience: number;
  service: string;
  has_picture: boolean;
  asked: number;
  answer: string | null;
  by: string | null;
  answered: number | null;
}

/** What is known of one state. */
export interface StateFacts {
  visits: number;
  since: number | null;
  outcome: string | null;
  outcomes: Record<string, number>;
  seconds: number;
  left?: number;
  error?: string | null;
  preempt?: number | null;
  asked?: PreemptFacts | null;
  serviced?: number | null;
  abandoned?: number | null;
  attempt?: number;
  item?: number;
  waits?: string | null;
  note?: string;
  resource?: string;
  question?: QuestionFacts;
  marking?: string[];
  fired?: string;
  held?: Record<string, string>;
}

/** What is known of one goal; `attempt` is that of the visit that sent it. */
export interface GoalFacts {
  path: string;
  action: string;
  since: number;
  goal: Json;
  feedback: Json;
  first_feedback: Json;
  status: string;
  text: string;
  result: Json;
  ended: number | null;
  attempt?: number;
  progress?: ProgressFacts;
}

/** The newest value of a key of userdata, who wrote it, and when. */
export interface WrittenFacts {
  key: string;
  value: Json;
  writer: string;
  at: number;
  container: string;
}

/** The facts of a run; times are nanoseconds since the Unix epoch. */
export interface RunFacts {
  run: number;
  started: number | null;
  ended: number | null;
  outcome: string | null;
  states: Record<string, StateFacts>;
  goals: Record<string, GoalFacts>;
  userdata: Record<string, WrittenFacts>;
  outages?: [number, number][];
  dropped?: number;
}

/** Everything about a run: the state before the events, and these. */
export interface Snapshot {
  name: string;
  label: string;
  epoch: string;
  revision: number;
  stale: number | null;
  control: ControlState | null;
  recorded: boolean;
  node: string;
  behind: number | null;
  before: string | null;
  after: string | null;
  refused: number;
  refusal: string;
  noted: number;
  seq: number;
  problems: CheckProblem[];
  base: RunFacts;
  events: RunEvent[];
}

/** A snapshot came because the page was too far behind: so many events are only in its base. */
export interface Gap {
  name: string;
  missed: number;
}

/** What the server knows of a machine besides its events (`smachpy_viz.live.machines.Machine`). */
export interface MachineFacts {
  name: string;
  label: string;
  epoch: string;
  revision: number;
  stale: number | null;
  control: ControlState | null;
  recorded: boolean;
  node: string;
  behind: number | null;
  before: string | null;
  after: string | null;
  refused: number;
  refusal: string;
  noted: number;
}

/** New events of a machine; `seq` of the last one. */
export interface NewEvents {
  name: string;
  epoch: string;
  seq: number;
  events: RunEvent[];
}

/** New data of the topics of a machine's robots. */
export interface NewObservations {
  name: string;
  records: Observation[];
}

/** An action on the network; `servers`: number of its servers. */
export interface ActionSeen {
  name: string;
  type: string;
  node: string;
  servers: number;
}

/** A goal that was sent from here; `fraction` 0 to 1, `distance` [m]. */
export interface SentGoal {
  id: string;
  action: string;
  type: string;
  state: string;
  status: string;
  text: string;
  sent: number;
  ended: number | null;
  feedback_count: number;
  cancelled: boolean;
  fraction: number | null;
  distance: number | null;
  feedback?: string;
  result?: string;
}

/** The actions on the network, the names of those without servers, and the newest goals. */
export interface ActionList {
  actions: ActionSeen[];
  gone: string[];
  goals: SentGoal[];
}

/** A problem with a value of a goal; `path` of its field, "" for the whole goal. */
export interface FieldProblem {
  path: string;
  text: string;
}

/** The answer of any route that refuses or fails. */
export interface Failure {
  ok: false;
  text: string;
  wants_token: boolean;
  problems: FieldProblem[];
}

/** What each route answers, unless it fails. */
export interface Answers {
  "POST /api/login": Done;
  "GET /api/machines": MachineSummary[];
  "GET /api/model": RevisedModel;
  "GET /api/statistics": RunStatistics | null;
  "GET /api/why": WhyAnswer;
  "GET /api/compare": Comparison;
  "GET /api/value": WholeValue;
  "GET /api/runs": RunList;
  "GET /api/fleet": FleetPage;
  "GET /api/good": GoodRuns;
  "GET /api/open": Opened;
  "GET /api/simulations": SimulationList;
  "GET /api/reproduction": Reproduction;
  "GET /api/action": GoalForm;
  "GET /api/goals": ServerGoal[];
  "GET /api/notes": RunNote[];
  "POST /api/control": Done;
  "POST /api/action": CheckedGoal | GoalAccepted | Done;
  "POST /api/simulate": BatchStarted | Done;
  "POST /api/mission": Done;
  "POST /api/notes": Done;
  "POST /api/reproduce": ReproductionStarted | Done;
}

/** The data of each server-sent event. */
export interface StreamData {
  "settings": Settings;
  "machines": MachineChanges;
  "snap": Snapshot;
  "gap": Gap;
  "facts": MachineFacts;
  "events": NewEvents;
  "observed": NewObservations;
  "actions": ActionList;
  "beat": number;
}

