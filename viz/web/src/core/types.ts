// Data that modules share. What crosses the border to the server is in wire.ts, made from Python's types; here, some of
// it has shorter names.
import type { Difference, Edge, Json, Node, PreemptFacts, StateKeys } from "#core/wire.ts";

export type {
  ActionList as ActionsSeen,
  ActionSeen as ActionServer,
  BatchRow as Batch,
  Cause,
  CheckProblem as Problem,
  ControlState as Control,
  Edge,
  EventKind,
  EventOf,
  FieldProblem,
  FleetPage as FleetRuns,
  FleetRow,
  FormField,
  GoalFacts as GoalRun,
  Json,
  MachineFacts,
  MachineSummary,
  MissionFacts as Mission,
  Observation as Observed,
  PreemptFacts as PreemptRequest,
  ProgressFacts as Progress,
  QuestionFacts as Question,
  RunEvent,
  RunFacts as RunState,
  RunRow,
  RunStatistics as Statistics,
  SentGoal,
  ServerGoal,
  Settings,
  Snapshot,
  StateFacts as StateRun,
  StateStatistics,
  WhyAnswer as Why,
  WrittenFacts as UserdataEntry,
} from "#core/wire.ts";

export type Theme = "system" | "light" | "dark";

export type OutcomeClass = "success" | "failure" | "preempted" | "other";

export interface Span {
  path: string;
  from: number;
  to: number | null;
  outcome: string | null;
  preempt: number | null;
  asked: PreemptFacts | null;
  serviced: number | null;
  abandoned: number | null;
  sent?: { id: string; goal: Json }; // its newest goal
  note?: string; // its newest note
  attempt?: number; // its newest attempt, from the second one on
  purpose?: string; // of the goal, when the visit has ended
}

export interface Wait {
  path: string;
  kind: "paused" | "asks";
  from: number;
  to: number | null;
  text: string;
}

export interface PreemptedSpan extends Span {
  preempt: number;
}

export interface Preempt {
  from: number;
  to: number | null;
  rows: PreemptedSpan[];
  holds: PreemptedSpan[];
}

/** How a part differs, where two versions are drawn; "" if not. */
export type Change = "" | "added" | "removed" | "changed" | "numbers";

export interface Link extends Edge {
  rule: string | null;
  join: number | null; // number of the join that it leads to
}

export interface Join {
  outcome: string;
  text: string;
  conditions: [string, string][];
  need: number; // number of conditions that must hold
  change: string;
}

/** A state of a machine; `Model` adds the fields beyond those of the server. */
export interface StateNode extends Omit<Node, "children" | "hidden" | "default_outcome"> {
  children: StateNode[];
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
export interface MachinePayload {
  explicit: StateNode;
  implicit: StateNode;
  keys: Record<string, StateKeys>;
}

export interface Box {
  x: number;
  y: number;
  w: number;
  h: number;
}

export interface Point {
  x: number;
  y: number;
}

export type Direction = "DOWN" | "RIGHT";

export interface Place extends Point {
  yaw: number;
}

export interface Pose extends Place {
  t: number;
}

export interface Scan {
  t: number;
  at: [number, number, number];
  first: number;
  step: number;
  ranges: number[];
}

export interface GridMap {
  resolution: number;
  width: number;
  height: number;
  origin: [number, number, number];
  cells: string;
}

export interface DrivenGoal extends Place {
  id: string;
  path: string;
  visit: number;
  t: number;
  to: number | null;
  status: string;
  text: string;
}

export interface Piece {
  path: string | null;
  visit: number | null;
  poses: Pose[];
}

export interface Robot {
  poses: Pose[];
  observed: number | null; // time from which poses come from its topics
  scans: Scan[];
  plans: { t: number; points: [number, number][] }[];
  goals: DrivenGoal[];
  tasks: Pick<DrivenGoal, "id" | "path" | "visit" | "t" | "to">[]; // goals without a place
  pieces: Piece[];
  done: number; // number of poses that are in pieces
}

export interface Series {
  name: string;
  unit: string;
  points: { t: number; value: number }[];
}

export interface Visit {
  path: string;
  from: number;
}

export interface Comparison {
  with: string;
  model: MachinePayload;
  alone: MachinePayload;
  listed: Difference[];
  runs: number[];
}
