// ELK, which lays out graphs, in its worker.

import type { ElkNode } from "elkjs/lib/elk-api.d.ts";

export class Elk {
  worker: Worker;
  ready: Promise<unknown>;
  #calls: Map<number, { done: (graph: ElkNode) => void; fail: (error: Error) => void }> = new Map();
  #count = 0;

  constructor(worker: Worker) {
    this.worker = worker;
    worker.onmessage = ({ data }) => {
      const call = this.#calls.get(data.id);
      this.#calls.delete(data.id);
      if (!call) return;
      if (data.error) call.fail(new Error(data.error.message ?? String(data.error)));
      else call.done(data.data);
    };
    worker.onerror = (e) => {
      for (const { fail } of this.#calls.values()) fail(new Error(e.message || "its worker could not start"));
      this.#calls.clear();
    };
    this.ready = this.#ask({ cmd: "register", algorithms: ["layered"] });
    this.ready.catch(() => {}); // `layout` awaits it and throws the error
  }

  async layout<G extends ElkNode>(graph: G): Promise<G> {
    await this.ready;
    // The same graph, with places.
    return (await this.#ask({ cmd: "layout", graph, layoutOptions: {}, options: {} })) as G;
  }

  #ask(message: object): Promise<ElkNode> {
    const id = this.#count++;
    return new Promise((done, fail) => {
      this.#calls.set(id, { done, fail });
      this.worker.postMessage({ id, ...message });
    });
  }
}
