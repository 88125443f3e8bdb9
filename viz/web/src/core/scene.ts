// The robots' poses, tracks by the visits that drove them, goals, scans, plans and maps. They come from records of
// robot topics (smachpy.network.observations); poses also from feedback, as long as there are none from topics.
// Times are milliseconds since the epoch; places are [m], angles [rad], in the map frame.

import { own } from "#core/fold.ts";
import { countWhile } from "#core/lists.ts";
import { namedPlaces, placeIn, placeText } from "#core/places.ts";
import type {
  Box,
  DrivenGoal,
  EventOf,
  GridMap,
  Observed,
  Piece,
  Point,
  Pose,
  Robot,
  RunEvent,
  Scan,
  Series,
} from "#core/types.ts";

export const COLOURS = 8; // of tracks; from the ninth state on they repeat, dashed
const MOST_POSES = 60_000; // of one robot
const MOST_SEEN = 4_000; // scans, and plans, of one robot; values of one topic
const MOST_SERIES = 400; // numbers of topics
const NEAR = 0.3; // [m] a goal this near to a named place has its name
const ENDED = { Left: 1, Failed: 1, Finished: 1 };

/** The name of the robot: the namespace of an action. */
export const robotOf = (action: unknown) =>
  String(action ?? "")
    .replace(/^\//, "")
    .replace(/\/?[^/]*$/, "");

const GOALS = ["target_pose", "pose", "goal_pose", "goal"];
const FEEDBACK = ["base_position", "current_pose"];

/** The number of entries up to the time `t`; they are in order of their times. */
export const countUntil = (list: { t: number }[], t: number) => countWhile(list, (one) => one.t <= t);

/** The newest goal sent by `t`, if it had not ended then. */
function newestAt<G extends { t: number; to: number | null }>(goals: G[], t: number) {
  const goal = goals[countUntil(goals, t) - 1];
  return goal && (goal.to === null || t <= goal.to) ? goal : null;
}

const newRobot = (): Robot => ({
  poses: [],
  observed: null,
  scans: [],
  plans: [],
  goals: [],
  tasks: [],
  pieces: [],
  done: 0,
});

export class Scene {
  robots: Map<string, Robot> = new Map();
  maps: { t: number; robot: string; map: GridMap }[] = [];
  /** values of topics, for plots */
  series: Map<string, Series> = new Map();
  /** beginning of the visit of each running state, by path */
  entered: Map<string, number> = new Map();
  /** paths of the states that drive, in order of their first drive, which determines their colours */
  drivers: string[] = [];
  names: { t: number; name: string; x: number; y: number }[] = [];
  revision = 0; // counts the changes

  #robot(name: string) {
    let robot = this.robots.get(name);
    if (!robot) {
      robot = newRobot();
      this.robots.set(name, robot);
    }
    return robot;
  }

  addEvents(events: RunEvent[]) {
    for (const e of events) this.#event(e, e.stamp_ns / 1e6);
    if (events.length) this.revision += 1;
  }

  #event(e: RunEvent, t: number) {
    if (e.kind === "Entered" || e.kind === "Started") this.entered.set(e.path, t);
    else if (Object.hasOwn(ENDED, e.kind)) this.entered.delete(e.path);
    else if (e.kind === "UserdataWritten") {
      for (const named of namedPlaces(e.value)) this.names.push({ t, ...named });
    } else if (e.kind === "GoalSent") this.#goalSent(e, t);
    else if (e.kind === "GoalFeedback") {
      const place = placeIn(e.feedback, FEEDBACK);
      if (place) this.#pose(robotOf(e.action), { t, ...place }, false);
    } else if (e.kind === "GoalDone") {
      const robot = this.robots.get(robotOf(e.action));
      const goal = robot?.goals.findLast((one) => one.id === e.goal_id);
      if (goal) Object.assign(goal, { to: t, status: e.status, text: e.text });
      const task = robot?.tasks.findLast((one) => one.id === e.goal_id);
      if (task) task.to = t;
    }
  }

  #goalSent(e: EventOf<"GoalSent">, t: number) {
    const place = placeIn(e.goal, GOALS);
    const robot = this.#robot(robotOf(e.action));
    const from = this.entered.get(e.path) ?? t;
    if (!place) {
      robot.tasks.push({ id: e.goal_id, path: e.path, visit: from, t, to: null });
      if (robot.poses.length && robot.poses[robot.poses.length - 1].t > t) this.#resetPieces(robot);
      return;
    }
    const goal: DrivenGoal = {
      id: e.goal_id,
      path: e.path,
      visit: from,
      t,
      to: null,
      status: "ACTIVE",
      text: "",
      ...place,
    };
    robot.goals.push(goal);
    if (!this.drivers.includes(e.path)) this.drivers.push(e.path);
    // The event came after poses that are later: their pieces belong to this goal.
    if (robot.poses.length && robot.poses[robot.poses.length - 1].t > t) this.#resetPieces(robot);
  }

  /** Make the pieces of a robot's track anew. */
  #resetPieces(robot: Robot) {
    robot.pieces = [];
    robot.done = 0;
  }

  #pose(name: string, pose: Pose, observed: boolean) {
    const robot = this.#robot(name);
    if (observed && robot.observed === null) {
      robot.observed = pose.t; // poses from feedback since then are replaced by those from the topic
      robot.poses.length = countUntil(robot.poses, pose.t);
      this.#resetPieces(robot);
    }
    if (!observed && robot.observed !== null && pose.t >= robot.observed) return;
    const last = robot.poses.at(-1);
    if (last && last.t > pose.t) {
      robot.poses.splice(countUntil(robot.poses, pose.t), 0, pose);
      this.#resetPieces(robot);
    } else if (!last || last.t < pose.t || last.x !== pose.x || last.y !== pose.y) robot.poses.push(pose);
    if (robot.poses.length > MOST_POSES) {
      robot.poses.splice(0, MOST_POSES / 4);
      this.#resetPieces(robot);
    }
  }

  addObserved(records: Observed[]) {
    for (const record of records) {
      const t = record.stamp_ns / 1e6;
      const take = own(OBSERVERS as Record<string, Observer>, record.what);
      take?.(this, record, t, this.#robot(record.robot));
      if (record.what === "pose") {
        const [x, y, yaw] = record.at;
        this.#pose(record.robot, { t, x, y, yaw }, true);
      }
    }
    if (records.length) this.revision += 1;
  }

  /** Whether there is anything to show on a map. */
  get isEmpty() {
    return !this.maps.length && ![...this.robots.values()].some((robot) => robot.poses.length || robot.goals.length);
  }

  /** The track of a robot, cut where another visit, or none, drives it. */
  piecesOf(robot: Robot): Piece[] {
    for (; robot.done < robot.poses.length; robot.done++) {
      const pose = robot.poses[robot.done];
      // The visit that drives: that of a goal with a place, otherwise that of any other goal.
      const goal = newestAt(robot.goals, pose.t) ?? newestAt(robot.tasks, pose.t);
      const path = goal?.path ?? null;
      const visit = goal?.visit ?? null;
      const last = robot.pieces.at(-1);
      const moved = robot.done > 0 && robot.poses[robot.done - 1].x !== pose.x;
      if (path !== null && moved && !this.drivers.includes(path)) this.drivers.push(path);
      if (last && last.path === path && last.visit === visit) last.poses.push(pose);
      else {
        const before = last?.poses.at(-1);
        robot.pieces.push({ path, visit, poses: before ? [before, pose] : [pose] });
      }
    }
    return robot.pieces;
  }

  /** The number of the colour of a state's tracks; -1 if it has not driven. */
  colourOf(path: string) {
    return this.drivers.indexOf(path);
  }

  /** The pose of a robot at an instant; null if it is not known yet. */
  poseAt(robot: Robot, t: number): Pose | null {
    return robot.poses[countUntil(robot.poses, t) - 1] ?? null;
  }

  /** The map at an instant; before the first one, the first one. */
  mapAt(t: number) {
    return (this.maps[countUntil(this.maps, t) - 1] ?? this.maps[0])?.map ?? null;
  }

  /** The name of a goal's place; "" if it has none. */
  placeName(goal: DrivenGoal) {
    const near = (one: { x: number; y: number }) => Math.hypot(one.x - goal.x, one.y - goal.y) < NEAR;
    return this.names.findLast(near)?.name ?? "";
  }

  /** The newest goal of a visit. */
  goalOf(path: string, visit: number): DrivenGoal | null {
    for (const robot of this.robots.values()) {
      const goal = robot.goals.findLast((one) => one.path === path && one.visit === visit);
      if (goal) return goal;
    }
    return null;
  }

  /** The goal with an id, if it leads to a place. */
  goalWithId(id: string): DrivenGoal | null {
    for (const robot of this.robots.values()) {
      const goal = robot.goals.findLast((one) => one.id === id);
      if (goal) return goal;
    }
    return null;
  }

  /**
   * The piece of a track nearest to a place, and the time at which the robot was there.
   * @param within [m]
   * @param until later poses are ignored [ms]
   */
  nearest(
    x: number,
    y: number,
    within: number,
    until: number = Infinity,
  ): { piece: Piece; t: number; far: number } | null {
    let best: { piece: Piece; t: number; far: number } | null = null;
    for (const robot of this.robots.values())
      for (const piece of this.piecesOf(robot))
        for (let i = 0; i < piece.poses.length && piece.poses[i].t <= until; i++) {
          const a = piece.poses[Math.max(0, i - 1)];
          const b = piece.poses[i];
          const { far, part } = toSegment(x, y, a, b);
          // Where the robot was several times, the newest pass; the tolerance is for rounding.
          if (far > within || (best && far > best.far + 1e-6)) continue;
          best = { piece, t: a.t + part * (b.t - a.t), far };
        }
    return best;
  }

  /** The box around all places, and the map. */
  extent(t: number): Box | null {
    const xs = [];
    const ys = [];
    const map = this.mapAt(t);
    if (map)
      for (const [u, v] of [
        [0, 0],
        [map.width, 0],
        [0, map.height],
        [map.width, map.height],
      ]) {
        const place = cellAt(map, u, v);
        xs.push(place.x);
        ys.push(place.y);
      }
    else
      for (const robot of this.robots.values())
        for (const { x, y } of [...robot.poses, ...robot.goals]) {
          xs.push(x);
          ys.push(y);
        }
    if (!xs.length) return null;
    const least = (all: number[]) => all.reduce((a, b) => Math.min(a, b));
    const most = (all: number[]) => all.reduce((a, b) => Math.max(a, b));
    const [x, y] = [least(xs), least(ys)];
    return { x, y, w: Math.max(1, most(xs) - x), h: Math.max(1, most(ys) - y) };
  }
}

/** The place of a point in a map's grid. @param u column @param v row */
export function cellAt({ resolution, origin: [x, y, yaw] }: GridMap, u: number, v: number) {
  const [c, s] = [Math.cos(yaw) * resolution, Math.sin(yaw) * resolution];
  return { x: x + c * u - s * v, y: y + s * u + c * v };
}

function toSegment(x: number, y: number, a: Pose, b: Pose) {
  const [dx, dy] = [b.x - a.x, b.y - a.y];
  const long = dx * dx + dy * dy;
  const part = long ? Math.max(0, Math.min(1, ((x - a.x) * dx + (y - a.y) * dy) / long)) : 1;
  return { far: Math.hypot(a.x + part * dx - x, a.y + part * dy - y), part };
}

function pushLimited<T>(list: T[], one: T) {
  list.push(one);
  if (list.length > MOST_SEEN) list.splice(0, MOST_SEEN / 4);
}

function pushSeries(scene: Scene, name: string, unit: string, point: { t: number; value: number }) {
  const known = scene.series.get(name);
  if (known) pushLimited(known.points, point);
  else if (scene.series.size < MOST_SERIES) scene.series.set(name, { name, unit, points: [point] });
}

type Observer<R = Observed> = (scene: Scene, record: R, t: number, robot: Robot) => void;
type Observers = { [K in Observed["what"]]?: Observer<Extract<Observed, { what: K }>> };

const OBSERVERS: Observers = {
  scan: (_scene, { at, first, step, ranges }, t, robot) => pushLimited(robot.scans, { t, at, first, step, ranges }),
  plan: (_scene, { points }, t, robot) => pushLimited(robot.plans, { t, points }),
  map(scene, { robot, resolution, width, height, origin, cells }, t) {
    scene.maps.push({ t, robot, map: { resolution, width, height, origin, cells } });
    scene.maps.sort((a, b) => a.t - b.t);
    if (scene.maps.length > 20) scene.maps.splice(1, 1);
  },
  value: (scene, { robot, name, value, unit }, t) =>
    pushSeries(scene, [robot, name].filter(Boolean).join("/"), unit, { t, value }),
  values(scene, { topic, values }, t) {
    for (const [path, value] of Object.entries(values))
      pushSeries(scene, path === "data" ? topic : `${topic}.${path}`, "", { t, value });
  },
};

/** The points at which a scan's rays hit something. */
export function scanPoints({ at: [x, y, yaw], first, step, ranges }: Scan): Point[] {
  const points: Point[] = [];
  ranges.forEach((cm, i) => {
    const turn = yaw + first + i * step;
    if (cm >= 0) points.push({ x: x + (cm / 100) * Math.cos(turn), y: y + (cm / 100) * Math.sin(turn) });
  });
  return points;
}

/** The map as text, for screen readers. */
export function sceneText(scene: Scene, now: number) {
  const parts = [...scene.robots].flatMap(([name, robot]) => {
    const pose = scene.poseAt(robot, now);
    const goal = robot.goals.findLast((one) => one.t <= now && (one.to === null || one.to > now));
    const to = goal ? `, on its way to ${scene.placeName(goal) || placeText(goal)}` : "";
    return pose ? [`${name || "the robot"} at ${placeText(pose)}${to}`] : [];
  });
  return `map: ${parts.join("; ") || "no robot yet"}`;
}
