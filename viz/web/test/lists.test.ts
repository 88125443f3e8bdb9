import assert from "node:assert/strict";
import { test } from "node:test";
import { countWhile, innermost } from "#core/lists.ts";

test("entries at the beginning of a list are counted", () => {
  const list = [1, 2, 2, 5];
  const upTo = (most: number) => countWhile(list, (entry) => entry <= most);
  assert.deepEqual([0, 1, 2, 4, 5].map(upTo), [0, 1, 3, 3, 4]);
  assert.equal(
    countWhile([], () => true),
    0,
  );
});

test("innermost entries contain no other, and names that only begin alike do not count", () => {
  const paths = ["/A", "/A/B", "/A/BC", "/A/B/C", "/D"];
  assert.deepEqual(
    innermost(paths, (path) => path),
    ["/A/BC", "/A/B/C", "/D"],
  );
});

test("the innermost of many entries are found without comparing each with each", () => {
  const paths = ["/A", ...Array.from({ length: 1000 }, (_, number) => `/A/S${number}`)];
  let looks = 0;
  const found = innermost(paths, (path) => {
    looks += 1;
    return path;
  });
  assert.equal(found.length, 1000);
  assert.ok(looks <= 2 * paths.length);
});
