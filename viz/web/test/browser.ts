// Stands for the browser where panels are rendered to text: import it before them.

/** Words that a canvas was told to write, and the bars that it was told to fill. */
export class Paper {
  texts: string[] = [];
  bars: { x: number; y: number; w: number; h: number; colour: string; opacity: number }[] = [];
  fillStyle = "";
  globalAlpha = 1;
  font = "";
  #path: { x: number; y: number; w: number; h: number } | null = null;

  measureText = (text: string) => ({ width: 6 * text.length }); // each character is 6 px wide
  fillText = (text: string) => this.texts.push(text);
  beginPath() {
    this.#path = null;
  }
  roundRect(x: number, y: number, w: number, h: number) {
    this.#path = { x, y, w, h };
  }
  fill() {
    if (this.#path) this.bars.push({ ...this.#path, colour: this.fillStyle, opacity: this.globalAlpha });
  }
}

const ignored = () => {};

/** A canvas of a size whose context is `paper`; what the paper does not note is ignored. */
export function canvasOf(paper: Paper, width: number, height: number) {
  const known = paper as unknown as Record<string | symbol, unknown>;
  const context = new Proxy(known, { get: (_, name) => (name === "canvas" ? canvas : (known[name] ?? ignored)) });
  const canvas = {
    ...{ clientWidth: width, clientHeight: height, width, height, title: "" },
    getContext: () => context,
    addEventListener: ignored,
    setAttribute: ignored,
  };
  for (const name of ["beginPath", "roundRect", "fill"]) known[name] = (known[name] as () => void).bind(paper);
  return canvas as unknown as HTMLCanvasElement;
}

/** As much of an SVG element as drawings use; its text is XML. */
export class Shape {
  attributes: Map<string, string> = new Map();
  children: (Shape | string)[] = [];
  style: Record<string, unknown> = { setProperty: ignored };
  tag: string;
  constructor(tag: string) {
    this.tag = tag;
  }
  setAttribute = (name: string, value: string) => this.attributes.set(name, value);
  getAttribute = (name: string) => this.attributes.get(name) ?? null;
  append = (...more: (Shape | string)[]) => this.children.push(...more);
  prepend = (...more: (Shape | string)[]) => this.children.unshift(...more);
  replaceChildren(...next: (Shape | string)[]) {
    this.children = next;
  }
  set textContent(text: string) {
    this.children = [text];
  }
  get classList() {
    const names = () => new Set((this.getAttribute("class") ?? "").split(" ").filter(Boolean));
    const set = (name: string, on: boolean) => {
      const next = names();
      if (on) next.add(name);
      else next.delete(name);
      this.setAttribute("class", [...next].join(" "));
    };
    return {
      contains: (name: string) => names().has(name),
      add: (name: string) => set(name, true),
      remove: (name: string) => set(name, false),
      toggle: set,
    };
  }
  /** @param selector a class */
  querySelectorAll(selector: string): Shape[] {
    const inside = this.children.flatMap((one) =>
      typeof one === "string" ? [] : [one, ...one.querySelectorAll(selector)],
    );
    return [...new Set(inside)].filter((one) => one.classList.contains(selector.slice(1)));
  }
  toString(): string {
    const given = [...this.attributes].map(([name, value]) => ` ${name}="${value}"`).join("");
    const inside = this.children.join("");
    return this.tag ? `<${this.tag}${given}>${inside}</${this.tag}>` : inside;
  }
}

const style = { getPropertyValue: (name: string) => name.slice(2), setProperty: ignored };
Object.assign(globalThis, {
  matchMedia: () => ({ matches: false, addEventListener: ignored }),
  document: {
    documentElement: { style, dataset: {} },
    getElementById: () => null,
    createElement: () => canvasOf(new Paper(), 0, 0),
    createElementNS: (_: string, tag: string) => new Shape(tag),
    createDocumentFragment: () => new Shape(""),
  },
  getComputedStyle: () => style,
  addEventListener: ignored,
  location: new URL("http://127.0.0.1/"),
  devicePixelRatio: 1,
  ResizeObserver: class {
    observe() {}
  },
});
