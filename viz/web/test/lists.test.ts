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
