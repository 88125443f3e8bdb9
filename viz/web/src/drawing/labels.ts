// Names beside places of the map, each on a side where no other name and no place is.

import { type Colours, FONT } from "#drawing/theme.ts";

type Area = { left: number; top: number; right: number; bottom: number };

export class Labels {
  #g: CanvasRenderingContext2D;
  #colours: Colours;
  #taken: Area[] = [];

  constructor(g: CanvasRenderingContext2D, colours: Colours) {
    this.#g = g;
    this.#colours = colours;
  }

  /** Begin a new picture. */
  forget() {
    this.#taken = [];
  }

  /** Keep names away from an area [px]. */
  keepFree(area: Area) {
    this.#taken.push(area);
  }

  /** Write a name beside a place [px]. */
  write(text: string, x: number, y: number, strong: boolean) {
    if (!text) return;
    const g = this.#g;
    g.font = strong ? `620 ${FONT}` : FONT;
    const wide = g.measureText(text).width;
    const sides = [
      [x + 12, y],
      [x - 12 - wide, y],
      [x - wide / 2, y + 16],
      [x - wide / 2, y - 16],
    ].map(([left, middle]) => ({ left, top: middle - 7, right: left + wide, bottom: middle + 7 }));
    const side = sides.find((one) => this.#isFree(one)) ?? sides[0];
    this.#taken.push(side);
    g.textAlign = "left";
    g.strokeStyle = this.#colours.of("floor");
    g.lineWidth = 3;
    g.lineJoin = "round";
    g.strokeText(text, side.left, side.top + 7);
    g.fillStyle = this.#colours.of("ink");
    g.fillText(text, side.left, side.top + 7);
  }

  #isFree(a: Area) {
    const isInside = a.left > 2 && a.right < this.#g.canvas.clientWidth - 2;
    const meets = (b: Area) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
    return isInside && !this.#taken.some(meets);
  }
}
