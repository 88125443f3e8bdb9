import assert from "node:assert/strict";
import { test } from "node:test";
import { parseRepr, rounded } from "#core/repr.js";

test("a repr is a tree", () => {
  assert.deepEqual(parseRepr("Waypoint(name='dock, (2)', pose=Pose2D(x=9.8, yaw=-1.5e-7))"), {
    name: "Waypoint",
    end: ")",
    items: [
      ["name", "'dock, (2)'"],
      [
        "pose",
        {
          name: "Pose2D",
          end: ")",
          items: [
            ["x", "9.8"],
            ["yaw", "-1.5e-7"],
          ],
        },
      ],
    ],
  });
  assert.deepEqual(parseRepr("[1, None, ]")?.items, [
    [null, "1"],
    [null, "None"],
  ]);
  assert.deepEqual(parseRepr("{'a': (1, 2), 3: 'x'}")?.items.length, 2);
});

test("what is no repr, or was cut, is none", () => {
  const others = [
    "",
    "hello",
    "to the dock (again",
    "f(x",
    "f(x))",
    "a b(c)",
    "f()",
    "[1 2]",
    "f(=1)",
    "{'a' 1}",
    "'x'",
    "f(a=…",
  ];
  for (const text of [...others, "(".repeat(5000), "[".repeat(30) + "]".repeat(30)])
    assert.equal(parseRepr(text), null, text);
  assert.equal(parseRepr("<Thing at 0x7f>"), null);
});

test("numbers are rounded for people, and nothing else", () => {
  assert.equal(rounded("yaw=1.5708000000000002, n=12.5"), "yaw=1.5708, n=12.5");
  assert.equal(rounded("-0.333333333"), "-0.33333");
  for (const text of ["1.2.345678", "v1.234567", "123456789", "0.1234", "a1.23456789b"])
    assert.equal(rounded(text), text);
});
