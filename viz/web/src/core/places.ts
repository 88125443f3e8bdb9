// Places in messages and in values of userdata: [m] and [rad], in the map frame.

import { own } from "#core/fold.ts";
import type { Place } from "#core/types.ts";
import { fieldsOf, isTree, type Tree } from "#core/values.ts";

const LONGEST_NAME = 40; // of a place
const MOST_NAMES = 200; // in one value

/** The fields of a message in a record; a value of another kind has none. */
const fields = (value: unknown): Tree => fieldsOf(value) ?? {};

const isNumber = (value: unknown): value is number => Number.isFinite(value);

/** @param stamped a PoseStamped, or a Pose */
export function placeOf(stamped: unknown): Place | null {
  const outer = fields(stamped);
  const { position, orientation } = fields(outer.pose ?? stamped);
  const { x, y } = fields(position);
  if (!isNumber(x) || !isNumber(y)) return null;
  const turn = fields(orientation);
  const [qx, qy, qz, qw] = [turn.x, turn.y, turn.z, turn.w].map((v) => (isNumber(v) ? v : 0));
  const frame = fields(outer.header).frame_id ?? "map";
  const yaw = Math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz));
  return /(^|\/)map$/.test(String(frame)) ? { x, y, yaw } : null;
}

/** The first place in some fields of a message. */
export const placeIn = (message: unknown, names: string[]) =>
  names.map((name) => placeOf(own(fields(message), name))).find((place) => place !== null) ?? null;

/**
 * The named places in a value of userdata: Waypoint(name='dock', x=1.0, y=2.0), a list of these, or a dict of places.
 */
export function namedPlaces(value: unknown): { name: string; x: number; y: number }[] {
  const one = namedPlace(value, null);
  if (one) return [one];
  const parts = isTree(value) ? value.$tuple : value;
  const named = Array.isArray(parts)
    ? parts.slice(0, MOST_NAMES).map((part) => namedPlace(part, null))
    : Object.entries(fields(value))
        .slice(0, MOST_NAMES)
        .map(([key, part]) => namedPlace(part, key));
  return named.filter((place) => place !== null);
}

/** @param key under which it is in a dict */
function namedPlace(value: unknown, key: string | null) {
  const { name, label, x, y, pose } = fields(value);
  const called = name ?? label ?? key;
  if (typeof called !== "string" || !called || called.length > LONGEST_NAME) return null;
  const place: Tree | Place = isNumber(x) && isNumber(y) ? { x, y } : (placeOf(pose ?? value) ?? fields(pose));
  return isNumber(place.x) && isNumber(place.y) ? { name: called, x: place.x, y: place.y } : null;
}

export const placeText = ({ x, y }: { x: number; y: number }) => `(${x.toFixed(1)}, ${y.toFixed(1)})`;
