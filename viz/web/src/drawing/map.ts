// The map: floor, tracks in the colours of the states that drove them, goals, plans, scans, robots.
// A click on a track goes to the instant at which the robot was there.

import { outcomeClass } from "#core/outcomes.ts";
import type { Scene } from "#core/scene.ts";
import { COLOURS, countUntil, scanPoints, sceneText } from "#core/scene.ts";
import { store } from "#core/store.ts";
import type { DrivenGoal, Piece, Point, Robot } from "#core/types.ts";
import { Floor, type MapScale, pixelOf, placeAt } from "#drawing/floor.ts";
import { Labels } from "#drawing/labels.ts";
import { Colours, FONT, fitted } from "#drawing/theme.ts";
import { grab } from "#drawing/viewport.ts";

const MARGIN = 10; // around the map [px]
const MARKED = 20; // around goals and robots without a map: their signs are whole [px]
const ROBOT_M = 8; // shown around a followed robot, and at least without a map [m]
const REACH = 9; // greatest distance of the pointer from a track that it is on [px]
const SCAN_MS = 1500; // an older scan is not shown
const RADIUS_M = 0.25; // of a robot
const SMALLEST = 6; // of a robot [px]
const [CLOSEST, FARTHEST] = [400, 0.5]; // [px/m]
const SCALES_M = [0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];

export class MapView {
  canvas: HTMLCanvasElement;
  context: CanvasRenderingContext2D;
  /** the robot that is kept in the middle; null: the whole map */
  followed: string | null = null;
  /** px per metre, and the place in the middle [m]; null: all */
  view: { k: number; x: number; y: number } | null = null;
  /** shown in place of the page's run, without links to it */
  given: { scene: Scene; now: number } | null = null;
  #colours = new Colours();
  #floor = new Floor(this.#colours, () => this.draw());
  #labels: Labels;
  #scale: MapScale = { k: 1, left: 0, bottom: 0 };

  constructor(canvas: HTMLCanvasElement) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d") as CanvasRenderingContext2D;
    this.#labels = new Labels(this.context, this.#colours);
    canvas.addEventListener("pointermove", (e) => this.#hover(e));
    canvas.addEventListener("pointerleave", () => store.pointer.hover(null));
    grab(canvas, {
      onPan: (dx, dy) => this.#pan(dx, dy),
      onZoom: (factor, px, py) => this.#zoom(factor, px, py),
      onTap: (e) => this.#goTo(e),
    });
    canvas.addEventListener("wheel", (e) => this.#wheel(e), { passive: false });
    canvas.addEventListener("dblclick", () => this.show(null));
    canvas.addEventListener("keydown", (e) => this.#key(e));
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  /** Read the colours again. */
  restyle() {
    this.#colours.forget();
    this.#floor.forget();
  }

  /** Reset the view for another machine. */
  reset() {
    this.view = null;
    this.followed = null;
    this.#floor.forget();
  }

  /** Show the whole map, or one robot. */
  show(robot: string | null) {
    this.followed = robot;
    this.view = null;
    this.draw();
  }

  /** The pixel of a place. @param place [m] @returns [px] */
  at(place: Point): [number, number] {
    return pixelOf(this.#scale, place);
  }

  #frame(scene: Scene, now: number, width: number, height: number) {
    const box = scene.extent(now);
    const robot = this.followed === null ? null : scene.robots.get(this.followed);
    const pose = robot && scene.poseAt(robot, now);
    const [margin, most] = scene.mapAt(now) ? [MARGIN, Infinity] : [MARKED, Math.min(width, height) / ROBOT_M];
    const whole = box
      ? {
          k: Math.min(most, (width - 2 * margin) / box.w, (height - 2 * margin) / box.h),
          x: box.x + box.w / 2,
          y: box.y + box.h / 2,
        }
      : { k: 20, x: 0, y: 0 };
    const view = this.view ?? whole;
    const k = !this.view && pose ? Math.min(width, height) / ROBOT_M : view.k;
    const middle = pose ?? view;
    this.#scale = { k, left: width / 2 - middle.x * k, bottom: height / 2 + middle.y * k };
  }

  draw() {
    const { canvas, context: g } = this;
    const size = fitted(g);
    if (!size) return;
    const { width, height, ratio } = size;
    const { scene, now } = this.given ?? { scene: store.data.scene, now: store.playback.nowMs() };
    this.#frame(scene, now, width, height);
    const map = scene.mapAt(now);
    g.fillStyle = this.#colours.of(map ? "unknown" : "floor");
    g.fillRect(0, 0, width, height);
    if (map) this.#floor.draw(g, map, this.#scale, ratio);
    else this.#floor.drawGrid(g, this.#scale, width, height);
    const until = (this.given ? null : store.playback.cursor.value) ?? Infinity;
    for (const robot of scene.robots.values()) this.#seen(scene, robot, now, until);
    for (const robot of scene.robots.values()) this.#tracks(scene, robot, until);
    this.#labels.forget();
    this.#labels.keepFree(this.#scaleBox(width, height));
    this.#goals(scene, until);
    for (const [name, robot] of scene.robots) this.#robot(scene, name, robot, now);
    this.#scaleBar(width, height);
    canvas.setAttribute("aria-label", sceneText(scene, now));
  }

  /** The scan and the plan of a robot. */
  #seen(scene: Scene, robot: Robot, now: number, until: number) {
    const g = this.context;
    const scan = robot.scans[countUntil(robot.scans, now) - 1];
    const pose = scene.poseAt(robot, now);
    if (scan && pose && now - scan.t < SCAN_MS) {
      const points = scanPoints(scan).map((point) => this.at(point));
      g.fillStyle = this.#colours.of("active");
      g.globalAlpha = 0.1;
      g.beginPath();
      g.moveTo(...this.at({ x: scan.at[0], y: scan.at[1] }));
      for (const point of points) g.lineTo(...point);
      g.fill();
      g.globalAlpha = 0.75;
      for (const [x, y] of points) g.fillRect(x - 1, y - 1, 2, 2);
      g.globalAlpha = 1;
    }
    const plan = robot.plans[countUntil(robot.plans, Math.min(now, until)) - 1];
    if (!plan?.points.length) return;
    g.strokeStyle = this.#colours.of("active");
    g.lineWidth = 1.5;
    g.setLineDash([2, 4]);
    this.#line(plan.points.map(([x, y]) => ({ x, y })));
    g.setLineDash([]);
  }

  #line(points: Point[]) {
    const g = this.context;
    g.lineCap = g.lineJoin = "round";
    g.beginPath();
    for (const point of points) g.lineTo(...this.at(point)); // the first call acts as moveTo
    g.stroke();
  }

  #tracks(scene: Scene, robot: Robot, until: number) {
    const g = this.context;
    const lit = store.pointer.hovered.value;
    const pieces = scene.piecesOf(robot);
    const isLit = (one: Piece) => lit !== null && one.path === lit.path && one.visit === lit.from;
    const anyLit = pieces.some(isLit);
    for (const piece of pieces) {
      const count =
        piece.poses[piece.poses.length - 1].t <= until ? piece.poses.length : countUntil(piece.poses, until);
      if (count < 1) break;
      const poses = count === piece.poses.length ? piece.poses : piece.poses.slice(0, count);
      if (isLit(piece)) {
        g.strokeStyle = this.#colours.of("ink");
        g.lineWidth = 12;
        this.#line(poses);
        g.strokeStyle = this.#colours.of("halo");
        g.lineWidth = 10;
        this.#line(poses);
      }
      const number = piece.path === null ? -1 : scene.colourOf(piece.path);
      g.strokeStyle = this.#colours.of(number < 0 ? "muted" : `s${1 + (number % COLOURS)}`);
      g.lineWidth = number < 0 ? 1 : 2.5;
      if (number >= COLOURS) g.setLineDash([6, 4]);
      g.globalAlpha = anyLit && !isLit(piece) ? 0.4 : 0.9;
      this.#line(poses);
      g.globalAlpha = 1;
      g.setLineDash([]);
    }
  }

  /** Draw each goal's place once, with the status of the newest goal there. */
  #goals(scene: Scene, until: number) {
    const g = this.context;
    const places: Map<string, DrivenGoal> = new Map();
    for (const robot of scene.robots.values())
      for (const goal of robot.goals)
        if (goal.t <= until) places.set(`${goal.x.toFixed(1)} ${goal.y.toFixed(1)}`, goal);
    g.textBaseline = "middle";
    for (const goal of places.values()) {
      const [x, y] = this.at(goal);
      this.#labels.keepFree({ left: x - 8, top: y - 8, right: x + 8, bottom: y + 8 });
    }
    for (const goal of places.values()) {
      const [x, y] = this.at(goal);
      const runs = goal.to === null || goal.to > until;
      const kind = runs ? "active" : outcomeClass(goal.status);
      g.fillStyle = this.#colours.of(runs ? "floor" : `${kind}-fill`);
      g.strokeStyle = this.#colours.of(kind);
      g.lineWidth = 1.75;
      if (kind === "preempted") g.setLineDash([3, 2]);
      g.beginPath();
      g.arc(x, y, 7, 0, 7);
      g.fill();
      g.stroke();
      g.setLineDash([]);
      g.beginPath();
      if (runs) {
        g.fillStyle = this.#colours.of(kind);
        g.arc(x, y, 3, 0, 7);
        g.fill();
      } else if (kind === "success") {
        g.moveTo(x - 3, y);
        g.lineTo(x - 1, y + 2.5);
        g.lineTo(x + 3.5, y - 2.5);
        g.stroke();
      } else {
        g.moveTo(x - 2.5, y - 2.5);
        g.lineTo(x + 2.5, y + 2.5);
        if (kind === "failure") {
          g.moveTo(x + 2.5, y - 2.5);
          g.lineTo(x - 2.5, y + 2.5);
        }
        g.stroke();
      }
      this.#labels.write(scene.placeName(goal), x, y, runs);
    }
  }

  #robot(scene: Scene, name: string, robot: Robot, now: number) {
    const pose = scene.poseAt(robot, now);
    if (!pose) return;
    const g = this.context;
    const [x, y] = this.at(pose);
    const r = Math.max(SMALLEST, RADIUS_M * this.#scale.k);
    g.save();
    g.translate(x, y);
    g.rotate(-pose.yaw);
    g.fillStyle = this.#colours.of("active");
    g.strokeStyle = this.#colours.of("floor");
    g.lineWidth = 1.5;
    g.beginPath();
    g.arc(0, 0, r, 0, 7);
    g.fill();
    g.stroke();
    g.fillStyle = this.#colours.of("floor");
    g.beginPath();
    g.moveTo(0.7 * r, 0);
    g.lineTo(-0.35 * r, 0.5 * r);
    g.lineTo(-0.35 * r, -0.5 * r);
    g.fill();
    g.restore();
    if (scene.robots.size > 1) this.#labels.write(name, x, y - r - 7, true);
  }

  /** The box of the scale, at the bottom right. */
  #scaleBox(width: number, height: number) {
    const metres = SCALES_M.find((m) => m * this.#scale.k >= 44) ?? 1000;
    const long = metres * this.#scale.k;
    const [left, top] = [width - long - 20, height - 27];
    return { metres, long, left, top, right: left + long + 12, bottom: top + 22 };
  }

  #scaleBar(width: number, height: number) {
    const g = this.context;
    const { metres, long, left, top } = this.#scaleBox(width, height);
    const [x, y] = [left + 6, top + 17];
    g.globalAlpha = 0.85;
    g.fillStyle = this.#colours.of("floor");
    g.fillRect(left, top, long + 12, 22);
    g.globalAlpha = 1;
    g.strokeStyle = g.fillStyle = this.#colours.of("ink");
    g.lineWidth = 1.25;
    g.beginPath();
    g.moveTo(x, y - 3);
    g.lineTo(x, y);
    g.lineTo(x + long, y);
    g.lineTo(x + long, y - 3);
    g.stroke();
    g.font = FONT;
    g.textAlign = "center";
    g.textBaseline = "middle";
    g.fillText(`${metres} m`, x + long / 2, y - 9);
  }

  // -- input --------------------------------------------------------------------------------------

  #nearest(e: PointerEvent | MouseEvent) {
    if (this.given) return null;
    const { x, y } = placeAt(this.#scale, e.offsetX, e.offsetY);
    return store.data.scene.nearest(x, y, REACH / this.#scale.k, store.playback.cursor.value ?? Infinity);
  }

  #hover(e: PointerEvent) {
    const found = this.#nearest(e);
    this.canvas.style.cursor = found ? "pointer" : "";
    const { path, visit } = found?.piece ?? { path: null, visit: null };
    store.pointer.hover(path === null || visit === null ? null : { path, from: visit });
  }

  /** Go to the instant at which a robot was at the pointer. */
  #goTo(e: PointerEvent) {
    const found = this.#nearest(e);
    if (!found) return;
    store.playback.seek(found.t);
    if (found.piece.path) store.view.selected.value = found.piece.path;
  }

  #pan(dx: number, dy: number) {
    this.followed = null;
    const middle = placeAt(this.#scale, this.canvas.clientWidth / 2 - dx, this.canvas.clientHeight / 2 - dy);
    this.view = { k: this.#scale.k, ...middle };
    this.draw();
  }

  #wheel(e: WheelEvent) {
    e.preventDefault();
    this.#zoom(Math.exp(-e.deltaY * 0.0016), e.offsetX, e.offsetY);
  }

  /** @param py the place that stays */
  #zoom(factor: number, px: number = this.canvas.clientWidth / 2, py: number = this.canvas.clientHeight / 2) {
    const held = placeAt(this.#scale, px, py);
    const k = Math.max(FARTHEST, Math.min(this.#scale.k * factor, CLOSEST));
    const [w, h] = [this.canvas.clientWidth, this.canvas.clientHeight];
    this.view = { k, x: held.x + (w / 2 - px) / k, y: held.y - (h / 2 - py) / k };
    this.draw();
  }

  #key(e: KeyboardEvent) {
    const zoom = { "+": 1.25, "=": 1.25, "-": 0.8 }[e.key];
    if (zoom) this.#zoom(zoom);
    else if (e.key === "0") this.show(null);
    else return;
    e.preventDefault();
    e.stopPropagation();
  }
}
