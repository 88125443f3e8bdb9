import assert from "node:assert/strict";
import { test } from "node:test";
import { inflateSync } from "node:zlib";
import { namedPlaces, placeOf } from "#core/places.ts";
import { cellAt, robotOf, Scene, scanPoints } from "#core/scene.ts";
import type { GridMap, Robot, RunEvent } from "#core/types.ts";
import { fixture } from "./fixtures.ts";

const OBSERVED = fixture("observed.json");
const message = (type: string, fields: object) => ({ $msg: type, fields });
const stamped = (x: unknown, y: unknown, frame_id = "map") =>
  message("geometry_msgs/PoseStamped", {
    header: message("std_msgs/Header", { frame_id }),
    pose: message("geometry_msgs/Pose", {
      position: message("geometry_msgs/Point", { x, y, z: 0 }),
      orientation: message("geometry_msgs/Quaternion", { x: 0, y: 0, z: 0, w: 1 }),
    }),
  });

/** @param t [s] */
const at = (t: number, kind: string, path: string, facts: object = {}) =>
  ({ kind, path, stamp_ns: t * 1e9, t, seq: 0, ...facts }) as RunEvent;
const A = { action: "move_base", goal_id: "1" };
const B = { action: "/robot_1/move_base", goal_id: "2" };
const sent = (x: number) => ({ goal: message("MoveBaseGoal", { target_pose: stamped(x, 0) }) });
const fed = (x: unknown) => ({ feedback: message("MoveBaseFeedback", { base_position: stamped(x, 0) }) });
const DRIVE = [
  at(1, "Entered", "/M/GO"),
  at(1, "GoalSent", "/M/GO", { ...A, ...sent(4) }),
  at(2, "GoalFeedback", "/M/GO", { ...A, ...fed(1) }),
  at(3, "GoalFeedback", "/M/GO", { ...A, ...fed(2) }),
  at(4, "GoalDone", "/M/GO", { ...A, status: "SUCCEEDED", text: "arrived" }),
  at(4, "Left", "/M/GO", { outcome: "succeeded" }),
  at(5, "Entered", "/M/BACK"),
  at(5, "GoalSent", "/M/BACK", { ...A, goal_id: "3", ...sent(0) }),
  at(6, "GoalFeedback", "/M/BACK", { ...A, goal_id: "3", ...fed(1) }),
];

const pieces = (scene: Scene, name: string = "") =>
  scene
    .piecesOf(scene.robots.get(name) as Robot)
    .map(({ path, visit, poses }) => [path, visit, poses.map(({ t, x }) => [t / 1000, x])]);

test("a robot is what stands in front of its actions", () => {
  assert.deepEqual(["move_base", "/move_base", "/robot_0/move_base", "a/b/go"].map(robotOf), [
    "",
    "",
    "robot_0",
    "a/b",
  ]);
});

test("feedback makes a track, cut by the visits that drove it", () => {
  const scene = new Scene();
  scene.addEvents(DRIVE);
  assert.deepEqual(pieces(scene), [
    ["/M/GO", 1000, [[2, 1], [3, 2]]],
    ["/M/BACK", 5000, [[3, 2], [6, 1]]],
  ]); // biome-ignore format: points
  assert.deepEqual(scene.drivers, ["/M/GO", "/M/BACK"]);
  assert.equal(scene.colourOf("/M/BACK"), 1);
  assert.equal(scene.goalOf("/M/GO", 1000)?.status, "SUCCEEDED");
  assert.equal(scene.goalOf("/M/GO", 2000), null);
});

test("what topics tell goes before feedback, in whichever order they come", () => {
  for (const order of [0, 1]) {
    const scene = new Scene();
    if (order) scene.addEvents(DRIVE);
    scene.addObserved(OBSERVED);
    if (!order) scene.addEvents(DRIVE);
    // Observed at 0, 2 and 3 s; from then on feedback is the same told twice.
    assert.deepEqual(
      pieces(scene).map(([path, , points]) => [path, points]),
      [
        [null, [[0, 1]]],
        ["/M/GO", [[0, 1], [2, 2], [3, 3]]],
      ], // biome-ignore format: points
    );
    assert.equal(scene.mapAt(0)?.width, 3);
    assert.deepEqual(scene.series.get("battery")?.points, [{ t: 0, value: 75 }]);
  }
});

test("a track leads to the instant and the visit", () => {
  const scene = new Scene();
  scene.addEvents(DRIVE);
  const found = scene.nearest(1.5, 0.1, 0.5, 4000);
  assert.equal(found?.t, 2500);
  assert.equal(found?.piece.path, "/M/GO");
  assert.equal(scene.nearest(1.5, 0.1, 0.5)?.piece.path, "/M/BACK", "the newest of equals");
  assert.equal(scene.nearest(1.5, 3, 0.5), null);
  assert.equal(scene.nearest(1.5, 0, 0.5, 0), null, "nothing has happened yet");
});

test("robots are kept apart, and goals that are no places are passed over", () => {
  const scene = new Scene();
  scene.addEvents([
    ...DRIVE,
    at(7, "GoalSent", "/M/GO", { ...B, ...sent(9) }),
    at(8, "GoalFeedback", "/M/GO", { ...B, ...fed(8) }),
    at(8, "GoalFeedback", "/M/GO", { ...B, ...fed("nan") }),
    at(8, "GoalSent", "/M/X", { ...B, goal: null }),
    at(8, "GoalSent", "/M/X", { ...B, goal: "some text" }),
    at(8, "GoalSent", "/M/X", { ...B, goal: message("ChargeGoal", { until: 1 }) }),
    at(8, "GoalSent", "/M/X", { ...B, goal: message("G", { target_pose: stamped(1, 0, "base_link") }) }),
    at(8, "GoalDone", "/M/X", { action: "nobody/knows", goal_id: "9", status: "LOST", text: "" }),
  ]);
  assert.deepEqual([...scene.robots.keys()], ["", "robot_1"]);
  assert.deepEqual(pieces(scene, "robot_1"), [["/M/GO", 7000, [[8, 8]]]]);
  assert.deepEqual(scene.drivers, ["/M/GO", "/M/BACK"]);
});

test("a goal that is no place drives as well, where the robot moves", () => {
  const scene = new Scene();
  scene.addEvents([
    at(1, "GoalSent", "/M/DELIVER", { action: "deliver", goal_id: "7", goal: message("G", { item: "cup" }) }),
    at(4, "GoalDone", "/M/DELIVER", { action: "deliver", goal_id: "7", status: "SUCCEEDED", text: "" }),
    at(4, "GoalSent", "/M/CHARGE", { action: "charge", goal_id: "8", goal: message("G", { until: 1 }) }),
  ]);
  assert.equal(scene.isEmpty, true);
  scene.addObserved(OBSERVED);
  assert.deepEqual(
    pieces(scene).map(([path]) => path),
    [null, "/M/DELIVER"],
  );
  assert.deepEqual(scene.drivers, ["/M/DELIVER"]);
});

test("places have the names that states wrote", () => {
  const scene = new Scene();
  scene.addEvents([
    at(0, "UserdataWritten", "/M/NEXT", {
      key: "waypoint",
      value: {
        $object: "Waypoint",
        fields: { name: "dock", pose: { $object: "Pose2D", fields: { x: 4.05, y: -0.1 } } },
      },
    }),
    at(0, "UserdataWritten", "/M/NEXT", { key: "n", value: 3 }),
    ...DRIVE,
  ]);
  const [go, back] = (scene.robots.get("") as Robot).goals;
  assert.deepEqual([scene.placeName(go), scene.placeName(back)], ["dock", ""]);
});

test("named places are found in objects, lists and dicts", () => {
  const names = (value: any) => namedPlaces(value).map(({ name, x }) => `${name} ${x}`);
  const dock = { $object: "Waypoint", fields: { name: "dock", x: 1, y: 2 } };
  assert.deepEqual(names(dock), ["dock 1"]);
  assert.deepEqual(names([dock, 3, { ...dock, fields: { label: "lab", x: 4, y: 2 } }]), ["dock 1", "lab 4"]);
  assert.deepEqual(names({ kitchen: { x: 5, y: 6 }, count: 3 }), ["kitchen 5"]);
  for (const odd of [null, 3, "dock", {}, [null], { $object: "P", fields: { name: "x", x: "1", y: 2 } }])
    assert.deepEqual(names(odd), []);
});

test("a message that is none has no place", () => {
  for (const some of [null, undefined, 3, "x", {}, { $msg: "a/B" }, { pose: { position: { x: "1", y: 2 } } }])
    assert.equal(placeOf(some), null);
});

test("a map's cells, its corners and a scan's points", () => {
  const scene = new Scene();
  scene.addObserved(OBSERVED);
  const map = scene.mapAt(0) as GridMap;
  assert.deepEqual([...inflateSync(Buffer.from(map.cells, "base64"))], [0, 1, 2, 0, 2, 0]);
  assert.deepEqual(scene.extent(0), { x: 1, y: 2, w: 1.5, h: 1 });
  assert.deepEqual(cellAt({ ...map, origin: [1, 2, Math.PI / 2] }, 2, 0), { x: 1, y: 3 });
  const points = scanPoints((scene.robots.get("") as Robot).scans[0]);
  assert.deepEqual(
    points.map(({ x, y }) => [x.toFixed(2), y.toFixed(2)]),
    [
      ["1.54", "0.16"],
      ["3.50", "1.00"],
    ],
  );
});

test("numbers of topics are series by their paths", () => {
  const scene = new Scene();
  const record = { kind: "Observed", path: "", robot: "", n: 1, stamp_ns: 1e9, what: "values" } as const;
  scene.addObserved([
    { ...record, topic: "arm/current", values: { data: 1.5 } },
    { ...record, topic: "joints", values: { "position.0": 2, "position.1": 3 } },
    { ...record, stamp_ns: 2e9, topic: "joints", values: { "position.0": 4 } },
  ]);
  assert.deepEqual([...scene.series.keys()], ["arm/current", "joints.position.0", "joints.position.1"]);
  assert.deepEqual(
    scene.series.get("joints.position.0")?.points.map(({ value }) => value),
    [2, 4],
  );
});
